"""Meshes, spaces and forms: the one place that knows FEniCSx and gmsh."""
