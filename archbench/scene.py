"""Scenes and references of the bench: files, their format, and checks of them.

A scene is a JSON file that describes blocks, joints, an action, and the quantities in question. It
contains plain numbers in SI units, so that any program can read it. Reference values of a scene
are in a TOML file of the same name.
"""

import json
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent

# Actions on a structure, with the keys that describe each besides "kind"
ACTIONS: dict[str, set[str]] = {
    "thickness": {"between"},
    "sideways": set(),
    "spread": {"block", "direction"},
    "load": {"patch", "fill", "strength"},
    "push": {"point", "force", "dead", "displacements"},
    "motion": {"times", "accelerations", "end"},
    "scaled motion": {"times", "accelerations", "end", "between"},
    "rocking": {"tilt", "impacts", "ratio"},
    # pressure on a stack of a finish, modulus and strength of its stone
    "closing": {"pressure", "finish", "young", "strength"},
}

KINDS = {"E": "measured", "A": "closed form", "P": "program"}
GRADES = {
    "a": "read in its source",
    "b": "read in a file of a repository",
    "c": "computed by another method in the tests",
    "m": "from memory",
}


class BenchError(Exception):
    """A scene, a reference or an answer is not as the format says."""


@dataclass(frozen=True)
class Reference:
    """A value to compare answers with.

    Attributes:
        quantity: of the scene.
        number: the value, in the unit of the quantity.
        uncertainty: half of the range within which the value is known, in the same unit.
        kind: "E" measured, "A" closed form or exact, "P" by a program.
        grade: "a" read in its source, "b" read in a file of a repository, "c" computed by another
            method in the tests, "m" from memory.
        source: author, title, place.
        url: DOI or address.
        licence: terms on which the number is used.
        read_by: when and where it was read; empty for grade "m".
        note: remarks for readers.
    """

    quantity: str
    number: float
    uncertainty: float
    kind: str
    grade: str
    source: str
    url: str
    licence: str
    read_by: str
    note: str = ""

    def problems(self) -> list[str]:
        """Return the fault of the value."""
        found = []
        if self.kind not in KINDS:
            found.append(f"kind {self.kind!r} is none of {sorted(KINDS)}")
        if self.grade not in GRADES:
            found.append(f"grade {self.grade!r} is none of {sorted(GRADES)}")
        if not (math.isfinite(self.number) and math.isfinite(self.uncertainty)):
            found.append(f"{self.number} ± {self.uncertainty} is not finite")
        if not self.uncertainty > 0.0:
            found.append(f"uncertainty {self.uncertainty} is not positive")
        if not (self.source and self.licence):
            found.append("source or licence is missing")
        if self.grade != "m" and not (self.read_by and self.url):
            found.append("a value that was read says where and when: read_by, url")
        return found


def scene_names(folder: Path = HERE) -> list[str]:
    """Return the names of all scenes, in order."""
    return sorted(path.stem for path in (folder / "scenes").glob("*.json"))


def read_scene(name: str, folder: Path = HERE) -> dict[str, Any]:
    """Read a scene by its name and check it.

    Raises:
        BenchError: the file is missing or not as the format says.
    """
    path = folder / "scenes" / f"{name}.json"
    try:
        scene = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BenchError(f"scene {name} cannot be read: {error}") from error
    if found := scene_problems(scene):
        raise BenchError(f"scene {name}: {'; '.join(found)}")
    return scene


def read_references(name: str, folder: Path = HERE) -> list[Reference]:
    """Read the reference values of a scene and check them.

    Raises:
        BenchError: the file is missing, a value has wrong keys, or one is not possible.
    """
    path = folder / "references" / f"{name}.toml"
    try:
        rows = tomllib.loads(path.read_text(encoding="utf-8")).get("value", [])
        values = [Reference(**row) for row in rows]
    except (OSError, TypeError, tomllib.TOMLDecodeError) as error:
        raise BenchError(f"reference {name} cannot be read: {error}") from error
    known = read_scene(name, folder)["quantities"]
    found = [
        f"{value.quantity} = {value.number}: {problem}"
        for value in values
        for problem in (
            *value.problems(),
            *([] if value.quantity in known else ["the scene has no such quantity"]),
        )
    ]
    if found:
        raise BenchError(f"reference {name}: {'; '.join(found)}")
    return values


def scene_problems(scene: dict[str, Any]) -> list[str]:
    """Return the faults of a scene."""
    needed = {"id", "title", "gravity", "width", "blocks", "joints", "laws", "action", "quantities"}
    if missing := needed - set(scene):
        return [f"{sorted(missing)} are missing"]
    found = []
    if unknown := set(scene) - needed - {"note", "damping", "observe", "from_memory"}:
        found.append(f"keys {sorted(unknown)} are unknown")
    action = dict(scene["action"])
    kind = action.pop("kind", None)
    if kind not in ACTIONS:
        found.append(f"action {kind!r} is none of {sorted(ACTIONS)}")
    elif set(action) != ACTIONS[kind]:
        found.append(f"action {kind!r} has keys {sorted(action)}, not {sorted(ACTIONS[kind])}")
    for block in scene["blocks"]:
        found += _block_problems(block, kind == "thickness")
    for joint in scene["joints"]:
        found += _joint_problems(joint, scene, kind == "thickness")
    for name, quantity in scene["quantities"].items():
        if set(quantity) != {"unit", "meaning"}:
            found.append(f"quantity {name!r} needs a unit and a meaning")
    found += [
        f"from_memory has {name!r}, no name of what was not read"
        for name in scene.get("from_memory", ())
        if not isinstance(name, str)
    ]
    if not scene["quantities"]:
        found.append("no quantity is in question")
    return found


def _block_problems(block: dict[str, Any], grows: bool) -> list[str]:
    """Return the faults of a block."""
    keys = {"name", "outline", "density", "fixed"} | ({"growth"} if grows else set())
    if set(block) != keys:
        return [f"block {block.get('name')!r} has keys {sorted(block)}, not {sorted(keys)}"]
    found = []
    outline = block["outline"]
    # the area of a family of structures depends on its thickness
    if not grows and signed_area(outline) <= 0.0:
        found.append(f"outline of block {block['name']!r} is not anticlockwise")
    if grows and len(block["growth"]) != len(outline):
        found.append(f"growth of block {block['name']!r} has not one row a vertex")
    if not block["density"] > 0.0:
        found.append(f"density of block {block['name']!r} is not positive")
    return found


def _joint_problems(joint: dict[str, Any], scene: dict[str, Any], grows: bool) -> list[str]:
    """Return the faults of a joint."""
    keys = {"blocks", "ends", "law"} | ({"growth"} if grows else set())
    if set(joint) != keys:
        return [f"joint {joint.get('blocks')} has keys {sorted(joint)}, not {sorted(keys)}"]
    found = []
    if joint["law"] not in scene["laws"]:
        found.append(f"joint {joint['blocks']} has an unknown law {joint['law']!r}")
    count = len(scene["blocks"])
    if not all(0 <= block < count for block in joint["blocks"]):
        found.append(f"joint {joint['blocks']} names blocks that are not there")
    return found


def signed_area(outline: list[list[float]]) -> float:
    """Return the area of a polygon, positive where its outline is anticlockwise [m²]."""
    after = [*outline[1:], outline[0]]
    return 0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(outline, after, strict=True))
