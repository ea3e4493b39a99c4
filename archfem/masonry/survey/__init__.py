"""Structures from surveyed outlines in GeoJSON, DXF or gmsh files.

circle_fit  circle through a surveyed ring
drawings    GeoJSON, DXF and tagged .msh outlines
outlines    Structure from surveyed outlines
snapping    closing gaps between outlines
"""
