"""HTML pages: the player of a run, an arch to shake, and documents that embed them.

document     sections, tables and figures as HTML
live         page that simulates falling stones in a browser
player       player of a run
player_data  data of the player
wasm         compiled kernels of that page
word         documents for Word
"""
