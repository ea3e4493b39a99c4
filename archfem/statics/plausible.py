"""Whether friction can hold what a dead load asks of it; what is at rest but cannot be meant.

Joints that never slide carry any shear, and elastic joints that slide may come to rest far from
where they were drawn. A structure of rigid blocks that no thrust line within friction can hold must
not be found at rest: the safe theorem (Heyman, Int. J. Solids Struct. 2 (1966) 249-279) checks it
by a linear programme that knows nothing of stiffness.
"""

from archfem.errors import DidNotConverge, InvalidInput
from archfem.joints.criteria import judged
from archfem.limit.collapse import stands
from archfem.masonry.naming import listed_joints
from archfem.statics.equilibrium import Equilibrium
from archfem.units import mm

STEEP = 1.0
"""|V| / N that no dry joint of stone bears: rough faces slide at 0.6 to 0.75 [-]."""

SLIPPERY = 0.1
"""Coefficient of friction below which a joint is not one of stones [-]."""

SLID = 1.0 * mm
"""Slip under the weight alone from which a structure is not as it was drawn [m]."""


def dead_load_doubts(dead: Equilibrium, friction: float | None = None) -> tuple[str, ...]:
    """Return why a structure cannot be meant to rest as it was found to, a sentence each.

    Args:
        dead: its dead load.
        friction: |V| / N from which joints are to be judged as sliding [-]; by default, of joints
            that never slide, 1.

    Returns:
        Sentences; none where nothing is doubtful.
    """
    structure, joints = dead.model.structure, judged(dead.joints)
    ratio, names = joints["friction"], joints["name"].values
    most = STEEP if friction is None else friction
    found = []
    if (steep := (ratio > most).values).any():
        found.append(
            f"under dead load |V| / N is {float(ratio.max()):.3g} in "
            f"{listed_joints(names[steep])}, and joints slide from {most:g} on: they hold only "
            "because they never slide"
        )
    slid = abs(joints["slip"])
    if (far := (slid > SLID).values).any():
        found.append(
            f"under dead load joints slide by up to {float(slid.max()) / mm:.3g} mm "
            f"({listed_joints(names[far])}): it does not stand as it was drawn"
        )
    least = min(joint.contact.coefficient for joint in structure.joints)
    if least < SLIPPERY:
        found.append(
            f"the least coefficient of friction is {least:g}: joints of stone have 0.6 to 0.75"
        )
    if not _stands(dead):
        found.append(
            "it was found at rest, but as rigid blocks nothing within friction holds it: "
            "archfem.stands says that it falls"
        )
    return tuple(found)


def _stands(dead: Equilibrium) -> bool:
    """Whether limit analysis finds it standing, or cannot tell."""
    try:
        return stands(dead.model.structure)
    except (InvalidInput, DidNotConverge):  # soft bodies, bonds: nothing to compare with
        return True
