"""Films, stills and a viewer of structures that move: all that knows imageio and pyvista.

    writer   a film, written in one stroke
    pace     which instants a film shows, and how fast
    colours  what blocks are coloured by, and on which scale
    setup    what stays the same over a film
    shots    what single pictures show, while joints hold and after
    triangles  polygons cut into triangles
    pen      draws many pieces at once
    stage    a structure drawn at an instant
    page     title, legend and the ground's motion around a structure
    scenes   films of runs, and stills
    modes    films of vibration shapes
    viewer   pyvista's own viewer of a run

Start reading at `scenes`.
"""
