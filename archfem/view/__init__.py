"""Pictures and films of structures, what they did, and what they can take.

    style      one look for all pictures
    marks      what a picture shows of the joints at one instant
    loads      live loads as arrows
    states     what a state's joints carry
    moved      where ends of joints and loose blocks are at some time of a run
    structure  a structure at an instant; several side by side
    dead       the dead load with its numbers
    displaced  a structure where its blocks have gone
    names      which joint is which
    joints     joints over time
    envelopes  eccentricity part by part
    stress     a map of principal compression
    modes      vibration shapes
    freebody   a block cut free and its closing polygon
    collapse   mechanism and thrust line of limit analysis; capacity of rings
    pushover   what is resisted over displacement
    motions    accelerograms with their integrals, and spectra
    accuracy   speed against error
    falls      blocks on their way to the ground
    studies    factors at first mechanism, case by case
    incremental  curves of incremental dynamic analysis; fragility
    sensitivity  tornado and convergence
    films      films, stills and a viewer: all that knows imageio, its encoder and pyvista
    pages      the player of a run, and documents, for a browser

It imports from all rooms to its left. Start reading at `structure`, with `style` beside it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
