"""Films and stills of structures that move: all that knows pyvista and imageio.

    writer   a film, written in one stroke
    colours  what blocks are coloured by, and on which scale
    setup    what stays the same over a film
    shots    what single pictures show, while joints hold and after
    stage    a structure before a camera
    page     title, legend and the ground's motion around a photograph
    scenes   films of runs, and stills
    modes    films of vibration shapes

Start reading at `scenes`.
"""
