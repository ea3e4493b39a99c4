"""Films and stills of structures that move: the one place that knows pyvista."""
