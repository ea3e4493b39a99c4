"""HTML pages: the player of a run, and documents that embed it.

document     sections, tables and figures as HTML
player       player of a run
player_data  data of the player
"""
