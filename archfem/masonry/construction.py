"""Construction stages: the order in which blocks are placed, with and without centring."""

from collections.abc import Sequence
from dataclasses import dataclass

from archfem._validation import check_integer, check_sequence, check_type, validate_arguments
from archfem.errors import InvalidInput
from archfem.masonry.stiffness_ratio import find_yielding_blocks
from archfem.masonry.structure import Structure, find_supported_blocks, suggest_name


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A step of building: the centring is struck, then blocks are placed, stress-free.

    Attributes:
        blocks: numbers or names of blocks, or names of parts; a part stands for its free blocks
            that are not yet placed.
        centring: whether the blocks rest on centring, which fixes them until it is struck.
        strike: whether all existing centring is struck first.
        name: in errors.
    """

    blocks: tuple[int | str, ...] = ()
    centring: bool = False
    strike: bool = False
    name: str = "stage"

    def __post_init__(self) -> None:
        """Check that the stage places blocks or strikes centring."""
        if isinstance(self.blocks, str):
            raise InvalidInput(f"blocks = {self.blocks!r} of '{self.name}': give a row of names")
        object.__setattr__(self, "blocks", tuple(self.blocks))
        if not self.blocks and not self.strike:
            raise InvalidInput(f"'{self.name}' places no block and strikes no centring")
        if self.centring and not self.blocks:
            raise InvalidInput(f"'{self.name}' has centring, and no block that stands on it")


@validate_arguments
def usual_stages(structure: Structure, layers: int = 4) -> tuple[Stage, ...]:
    """Return the usual construction stages of a bridge.

    First all parts that stand without rings and fill: piers and walls; then the rings on centring,
    which is struck; then the fill, in layers from below; then the parts on the fill. Empty stages
    are omitted.

    Args:
        structure: with roles of its parts; its fill (`find_yielding_blocks`) is placed in layers
            where it has many pieces, as `jointed_fill` creates them.
        layers: of the fill.

    Raises:
        InvalidInput: the number of layers is not positive.
    """
    check_integer(layers, "layers of the fill")
    soil = set(find_yielding_blocks(structure))
    rings = {n for n in structure.free if structure.blocks[n].role == "ring"} - soil
    first = find_supported_blocks(structure, set(range(len(structure.blocks))) - soil - rings)
    last = set(structure.free) - soil - rings - first
    stages = [("piers and walls", first & set(structure.free)), ("rings", rings)]
    for number, layer in _divide_into_layers(structure, soil, layers):
        stages.append((f"fill, layer {number}", layer))
    result = []
    for name, blocks in (*stages, ("parts on the fill", last)):
        if blocks:
            centring = name == "rings"
            result.append(Stage(blocks=tuple(sorted(blocks)), centring=centring, name=name))
            if centring:
                result.append(Stage(strike=True, name="centring struck"))
    return tuple(result)


def _divide_into_layers(
    structure: Structure, soil: set[int], count: int
) -> list[tuple[int, set[int]]]:
    """Divide the fill into layers of equal height by centroids, numbered from below."""
    if not soil:
        return []
    height = {number: float(structure.blocks[number].centroid[1]) for number in soil}
    low, high = min(height.values()), max(height.values())
    step = (high - low) / count or 1.0
    layers: dict[int, set[int]] = {}
    for number, y in height.items():
        layers.setdefault(min(int((y - low) / step), count - 1) + 1, set()).add(number)
    return sorted(layers.items())


def resolve_stages(structure: Structure, stages: Sequence[Stage]) -> list[set[int]]:
    """Resolve the stages to the numbers of the blocks that each places."""
    done: set[int] = set()
    placed, centred = [], False
    for stage in check_sequence(stages, "stages"):
        remedy = "give some of Stage(blocks=…), or usual_stages(structure)"
        check_type(stage, Stage, "stages", remedy)
        new = set().union(*(_select_blocks(structure, word, done) for word in stage.blocks))
        if twice := sorted(structure.blocks[n].name for n in new & done):
            raise InvalidInput(f"'{stage.name}' places {twice}, which stand already")
        done |= new
        placed.append(new)
        centred = stage.centring or (centred and not stage.strike)
    if left := [structure.blocks[n].name for n in structure.free if n not in done]:
        names = str(left) if len(left) <= 5 else f"{left[:5]} and {len(left) - 5} more"
        raise InvalidInput(f"no stage places {names}: every block that moves is placed once")
    if centred:
        raise InvalidInput("the centring is never struck: end with Stage(strike=True)")
    return placed


def _select_blocks(structure: Structure, word: int | str, done: set[int]) -> set[int]:
    """Select blocks by number, name or part."""
    names = [block.name for block in structure.blocks]
    parts = [block.part for block in structure.blocks]
    if isinstance(word, str) and word not in names and word not in parts:
        hint = suggest_name(word, [*names, *parts], 0.0)
        raise InvalidInput(f"there is no block or part '{word}': {hint}")
    if isinstance(word, str) and word not in names:
        return {n for n in structure.free if parts[n] == word} - done
    number = structure.block_number(word)
    if structure.blocks[number].fixed:
        raise InvalidInput(f"block '{names[number]}' is fixed: it stands before anything is built")
    return {number}
