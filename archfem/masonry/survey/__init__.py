"""Structures from surveyed outlines in GeoJSON, DXF, SVG or gmsh files, or of compas assemblies.

assemblies  outlines of plane assemblies of compas_assembly and compas_dem
circle_fit  least-squares circle through surveyed points
drawings    outlines in GeoJSON, DXF, SVG, IFC and tagged gmsh files
dxf         entities of DXF files
faults      outlines of a drawing in error, with its overlaps and gaps
layers      parts and roles of blocks, by layers of a drawing or by place
outlines    blocks and structure from surveyed outlines, with small gaps closed
ifc         solids of IFC files
svg         closed shapes of SVG files
"""
