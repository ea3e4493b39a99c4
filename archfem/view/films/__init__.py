"""Films, still pictures and a viewer of moving structures.

    encoder   video files
    film      films and pictures
    frames    content of frames and their timing
    renderer  drawing of a frame
    settings  visible region, magnification and colour scale of a film
    viewer    interactive viewer

Only this package imports imageio and pyvista.
"""
