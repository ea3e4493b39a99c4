"""What a case says of how its structure was built: [dead_load] as stages."""

from collections.abc import Sequence
from typing import Any

from archfem.cases.settings import checked, chosen
from archfem.errors import InvalidInput
from archfem.masonry.stages import LAYERS, Stage, placed, usual_stages
from archfem.masonry.structure import Structure

DEAD_LOAD = {"stages": str, "layers": int, "stage": [dict]}
STAGE = {"name": str, "blocks": [(int, str)], "centring": bool, "strike": bool}


def stages_asked(given: Any, structure: Structure) -> Sequence[Stage] | None:
    """Return the stages in which a case builds its structure; None where it does so in one go.

    Args:
        given: the table [dead_load] as read: `stages`, "none" or "usual", the latter with `layers`
            of the fill; or `stage`, a table for each.
        structure: of the case.

    Raises:
        InvalidInput: a key or value cannot be meant, or the stages do not build the structure.
    """
    values = checked(given, DEAD_LOAD, "dead_load")
    own = [
        Stage(**{"name": f"stage {k}", **checked(table, STAGE, f"dead_load.stage[{k}]")})
        for k, table in enumerate(values.get("stage", []))
    ]
    if own and len(values) > 1:
        raise InvalidInput("dead_load has stages of its own: take out stages and layers, or those")
    if own:
        placed(structure, own)
        return own
    usual = chosen(values.get("stages", "none"), ("none", "usual"), "dead_load.stages") == "usual"
    if "layers" in values and not usual:
        raise InvalidInput("dead_load.layers are those of stages = 'usual', which is not asked for")
    return usual_stages(structure, values.get("layers", LAYERS)) if usual else None
