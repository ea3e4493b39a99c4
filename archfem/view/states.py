"""A state that is to be drawn: of which model, at which coordinates, and what its joints carry."""

import logging

import xarray as xr

from archfem.arrays import Array
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, flagged
from archfem.joints.resultants import check_instant, joint_dataset
from archfem.models.gauges import Gauges
from archfem.models.model import Model
from archfem.models.moving import Moving
from archfem.statics.equilibrium import Equilibrium

logger = logging.getLogger("archfem")


def drawn(model: Model, state: Equilibrium | Array) -> tuple[Model, Array]:
    """Return the model and the coordinates (n,) of a state.

    Args:
        model: what stands.
        state: an equilibrium of it, whose own model knows how it came about, or coordinates (n,).

    Raises:
        InvalidInput: the state is another model's.
    """
    found, q = (state.model, state.q) if isinstance(state, Equilibrium) else (model, state)
    if len(q) != model.size:
        raise InvalidInput(
            f"there are {len(q)} coordinates, and the model has {model.size}: give the model, of "
            "the same cells and degree, that they were computed with"
        )
    return found, q


def joints_at(
    model: Model, q: Array, joints: xr.Dataset | None, criteria: Criteria | None
) -> xr.Dataset:
    """Return what the joints carry in a state that is to be drawn.

    Coordinates alone do not tell shear forces where joints have slid: then it warns.

    Args:
        model: with what its joints remember.
        q: coordinates (n,).
        joints: at that instant, where they are known.
        criteria: what makes a joint fail; by default those of `joints`, or else the usual ones.

    Raises:
        InvalidInput: `joints` has several instants, or those of another structure.
    """
    if joints is not None:
        check_instant(model.structure, joints)
        return flagged(joints, criteria)
    further = model.remembered(q) - model.memory
    if not model.memory.any() and further.any():
        logger.warning(
            "joints slide at these coordinates, and the model does not remember how far they had "
            "slid before: what is drawn of shear and sliding may be wrong; give the equilibrium "
            "in place of its coordinates, or joints=run.joints.sel(time=…)"
        )
    gauges, moved = Gauges.on(model), isinstance(model, Moving)
    faces = gauges.faces(gauges.read(q)) if moved else None
    return joint_dataset(
        model.structure, model.resultants(q), criteria=criteria, faces=faces, moved=moved
    )
