"""Films, still pictures and a viewer of moving structures.

    encoder   video files
    film      film and still picture
    frames    frames and their timing
    renderer  drawing of one frame with pyvista
    settings  what stays constant over a film, colour scale
    viewer    interactive viewer

Only this package imports imageio and pyvista.
"""
