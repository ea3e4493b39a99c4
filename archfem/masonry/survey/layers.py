"""Layers of a drawing: properties of the blocks on each, or of those at a place."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from archfem._typing import Array, Metres
from archfem._validation import check_numbers
from archfem.errors import InvalidInput
from archfem.masonry.structure import join_names, suggest_name
from archfem.masonry.survey.drawings import Outline


@dataclass(frozen=True, kw_only=True)
class Layer:
    """Properties of the blocks on one layer of a drawing (in GeoJSON, of one part).

    Attributes:
        part: part of the structure; by default the name of the layer.
        role: role of the part, "ring", "pier" or "other"; by default inferred from its name.
        material: name of the material; by default that of the whole survey.
        fixed: whether the blocks are abutments or foundations.
        ignore: whether the layer contains no blocks.
        x: of a name that is no layer of the drawing, the limits of x of blocks that it takes from
            layers, by the mean of their corners; None for any, where y is given [m].
        y: limits of y likewise [m].
    """

    part: str | None = None
    role: str | None = None
    material: str | None = None
    fixed: bool = False
    ignore: bool = False
    x: tuple[Metres, Metres] | None = None
    y: tuple[Metres, Metres] | None = None

    def holds(self, place: Array) -> bool:
        """Return whether limits are given, and a place (2,) is within them."""
        limits = [(self.x, place[0]), (self.y, place[1])]
        given = [
            (check_numbers(ends, "limits of x or y [m]", 2), at) for ends, at in limits if ends
        ]
        return given != [] and all(low <= at <= high for (low, high), at in given)


def group_by_place(
    outlines: Sequence[Outline],
    layers: Mapping[str, Layer],
    path: str | Path,
    ignored: Counter[str],
) -> list[Outline]:
    """Return outlines, those within limits of a name on its layer, but ignored ones.

    Raises:
        InvalidInput: nothing is said of a layer, or of one that is missing; or limits overlap.
    """
    placed = [_by_place(outline, layers) for outline in outlines]
    ignored.update(each.layer for each in placed if each.layer in ignored)
    kept = [each for each in placed if each.layer not in ignored]
    if not kept:
        raise InvalidInput(f"{path} has no stones left: those within x and y of names are ignored")
    _check_layers(kept, layers, path, ignored)
    return kept


def _by_place(outline: Outline, layers: Mapping[str, Layer]) -> Outline:
    """Return an outline on the layer within whose limits it is, if any."""
    middle = outline.points.mean(axis=0)
    held = [name for name, layer in layers.items() if layer.holds(middle)]
    if len(held) > 1:
        raise InvalidInput(
            f"'{outline.name}' at {outline.frame.place(middle)} is within x and y of "
            f"{join_names([repr(name) for name in held])}: let these not overlap"
        )
    return replace(outline, layer=(*held, outline.layer)[0])


def _check_layers(
    outlines: list[Outline], layers: Mapping[str, Layer], path: str | Path, ignored: Counter[str]
) -> None:
    """Refuse layers of the file without properties, and properties of missing layers."""
    there = {outline.layer for outline in outlines}
    if strange := sorted(there - set(layers)):
        stones = [outline for outline in outlines if outline.layer == strange[0]]
        about = stones[0].frame.place(stones[0].points.mean(axis=0))
        hints = [suggest_name(strange[0], there & set(layers), 0.7)]
        # a key of the case that no layer of the drawing has is the misspelt one
        for key in (x for x in layers if x not in there):
            if hint := suggest_name(key, [strange[0]], 0.7):
                hints.append(f"for '{key}' of [structure.layers], {hint}")
        hint = next(filter(None, hints), "name its part, or ignore it")
        raise InvalidInput(
            f"{path}: of layer '{strange[0]}' (closed outlines: {len(stones)}, the first about "
            f"{about}) nothing is said: {hint}"
        )
    expected = {name for name, layer in layers.items() if not layer.ignore}
    if missing := sorted(expected - there):
        hidden = ignored.get(f"{missing[0]} (hidden)")
        also = f", and {hidden} outlines on it are hidden, which are not read" if hidden else ""
        if layers[missing[0]].x or layers[missing[0]].y:
            corners = np.concatenate([outline.points for outline in outlines])
            (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
            raise InvalidInput(
                f"{path} has no stones within x and y [m] of '{missing[0]}': by unit = "
                f"'{outlines[0].frame.unit}' they lie within x = [{left:.6g}, {right:.6g}], "
                f"y = [{low:.6g}, {high:.6g}] m; correct the limits, or the unit"
            )
        raise InvalidInput(
            f"{path} has no outlines on layer '{missing[0]}': its layers are {sorted(there)}{also}"
        )
