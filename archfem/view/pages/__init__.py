"""Pages for a browser: the player of a run, and documents that hold one, in a single file each.

    packing   arrays over time as text in a page
    outlines  points of the blocks that a page draws, and how they move
    scenes    what the player shows of a run
    player    the player, by itself and in a notebook
    document  pages of words, tables, figures and players
    templates  HTML, CSS and JavaScript of the pages

Start reading at `player`. Nothing in a page asks for the network.
"""
