"""Limit analysis of rigid blocks: collapse factor, least thickness, mechanisms.

    backfill              earth pressure, load spreading
    collapse              collapse_factor
    collapse_warnings     why a factor may be an upper estimate
    cone_programme        second-order cone programmes
    displaced_blocks      limit analysis of blocks at displaced places
    fill_bounds           bounds of the factor with a plastic fill
    fill_mesh             triangles of a fill
    fill_range            range of a result over the assumptions on a fill
    fill_strength         strength of a fill, by pressure or plastic
    finite_mechanism      finite motion of a mechanism, load factor along its path
    instability           why a structure does not stand
    linear_programme      rigid-block equilibrium as a linear programme
    linkage               linkage of rigid bodies: constraints, velocities, equilibrium
    mechanism_count       mechanisms by counting failed joints; duration and opening
    mechanism_kinematics  mechanisms verified by a rigid-block motion
    mechanism_names       plain names of mechanisms
    nonassociated         sliding without dilatancy
    rating                rating for vehicles of codes
    self_weight           linear programme of self-weight, stands
    support_movement      finite movement of a support
    thickness             least thickness
    vehicles              vehicles over a bridge
    worst_places          worst places of a vehicle in states of fill and stones

Imports `masonry`, `joints` and the support modules. Start reading at `collapse`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
