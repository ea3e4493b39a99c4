"""How a structure was built: which blocks were placed when, and which of them stood on centring."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from archfem.arguments import instance, whole
from archfem.errors import InvalidInput
from archfem.masonry.naming import did_you_mean
from archfem.masonry.softness import yielding_blocks
from archfem.masonry.structure import Structure

LAYERS = 4
"""In which a fill is placed, unless said otherwise."""


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A step of building: the centring is struck, then blocks are placed, stress-free.

    Attributes:
        blocks: numbers or names of blocks, or names of parts, whose blocks that move are all
            meant, but for those placed before.
        centring: whether the blocks rest on centring, which holds them as they are until it is
            struck.
        strike: whether all centring that stands is struck first.
        name: what it is called in errors.
    """

    blocks: tuple[int | str, ...] = ()
    centring: bool = False
    strike: bool = False
    name: str = "stage"

    def __post_init__(self) -> None:
        """Refuse a stage in which nothing happens."""
        if isinstance(self.blocks, str):
            raise InvalidInput(f"blocks = {self.blocks!r} of '{self.name}': give a row of names")
        object.__setattr__(self, "blocks", tuple(self.blocks))
        if not self.blocks and not self.strike:
            raise InvalidInput(f"'{self.name}' places no block and strikes no centring")
        if self.centring and not self.blocks:
            raise InvalidInput(f"'{self.name}' has centring, and no block that stands on it")


def usual_stages(structure: Structure, layers: int = LAYERS) -> tuple[Stage, ...]:
    """Return the stages in which a bridge is usually built.

    First what stands without rings and fill: piers and walls; then the rings on centring, which
    is struck; then the fill, in layers from below; then what lies on it. Stages in which nothing
    would happen are left out.

    Args:
        structure: with roles of its parts; its fill is what `yielding_blocks` names, and comes in
            layers where it has many pieces, as `jointed_fill` makes them.
        layers: of the fill.

    Raises:
        InvalidInput: the number of layers is none.
    """
    instance(structure, Structure, "structure", "give one, e.g. bridge(…)")
    whole(layers, "layers of the fill")
    soil = set(yielding_blocks(structure))
    rings = {n for n in structure.free if structure.blocks[n].role == "ring"} - soil
    first = _standing(structure, set(range(len(structure.blocks))) - soil - rings)
    last = set(structure.free) - soil - rings - first
    stages = [
        ("piers and walls", first & set(structure.free), False),
        ("rings", rings, True),
        *((f"fill, layer {k}", layer, False) for k, layer in _layers(structure, soil, layers)),
        ("what lies on the fill", last, False),
    ]
    found = []
    for name, blocks, centring in stages:
        if blocks:
            found.append(Stage(blocks=tuple(sorted(blocks)), centring=centring, name=name))
        if centring and blocks:
            found.append(Stage(strike=True, name="centring struck"))
    return tuple(found)


def _standing(structure: Structure, blocks: set[int]) -> set[int]:
    """Those of some blocks that are joined, through others of them, to a fixed one."""
    held = {number for number in blocks if structure.blocks[number].fixed}
    pairs = [set(joint.blocks) for joint in structure.joints if blocks >= set(joint.blocks)]
    while reached := {number for pair in pairs if pair & held for number in pair} - held:
        held |= reached
    return held


def _layers(structure: Structure, soil: set[int], count: int) -> list[tuple[int, set[int]]]:
    """Blocks of the fill by equal steps of height of their centroids, numbered from below."""
    if not soil:
        return []
    height = {number: float(structure.blocks[number].centroid[1]) for number in soil}
    low, high = min(height.values()), max(height.values())
    step = (high - low) / count or 1.0
    found: dict[int, set[int]] = {}
    for number, y in height.items():
        found.setdefault(min(int((y - low) / step), count - 1) + 1, set()).add(number)
    return sorted(found.items())


def placed(structure: Structure, stages: Sequence[Stage]) -> list[set[int]]:
    """Return the numbers of the blocks that each stage places.

    Args:
        structure: all of whose blocks that move are to be placed.
        stages: in their order.

    Raises:
        InvalidInput: a block is not known, cannot be placed, or is never placed, or the centring
            is never struck.
    """
    done: set[int] = set()
    found, centred = [], False
    for stage in stages:
        instance(stage, Stage, "stages", "give some of Stage(blocks=…), or usual_stages(structure)")
        new = set().union(*(_meant(structure, word, done) for word in stage.blocks))
        if twice := sorted(structure.blocks[n].name for n in new & done):
            raise InvalidInput(f"'{stage.name}' places {twice}, which stand already")
        done |= new
        found.append(new)
        centred = stage.centring or (centred and not stage.strike)
    if left := [structure.blocks[n].name for n in structure.free if n not in done]:
        raise InvalidInput(f"no stage places {_some(left)}: every block that moves is placed once")
    if centred:
        raise InvalidInput("the centring is never struck: end with Stage(strike=True)")
    return found


def _meant(structure: Structure, word: int | str, done: set[int]) -> set[int]:
    """Blocks that a number, a name or a part means."""
    names = [block.name for block in structure.blocks]
    parts = [block.part for block in structure.blocks]
    if isinstance(word, str) and word not in names and word not in parts:
        hint = did_you_mean(word, [*names, *parts], 0.0)
        raise InvalidInput(f"there is no block or part '{word}': {hint}")
    if isinstance(word, str) and word not in names:
        return {n for n in structure.free if parts[n] == word} - done
    number = structure.block_number(word)
    if structure.blocks[number].fixed:
        raise InvalidInput(f"block '{names[number]}' is fixed: it stands before anything is built")
    return {number}


def _some(names: Iterable[str]) -> str:
    """The first of many names."""
    names = list(names)
    return str(names) if len(names) <= 5 else f"{names[:5]} and {len(names) - 5} more"
