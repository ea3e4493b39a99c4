"""Models with large displacements, in corotational coordinates.

    blocks  corotational coordinates of blocks and points
    joints  faces of joints in those coordinates
    model   large-displacement model

Start reading at `model`.
"""
