"""Models with large displacements, in corotational coordinates.

    joints  faces of joints in corotational coordinates
    model   corotational coordinates of blocks and points, large-displacement model

Start reading at `model`.
"""
