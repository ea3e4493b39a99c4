"""archfem: limit analysis, elastic joints in large displacements, and rigid blocks."""

from importlib.metadata import version as installed
from typing import Any

import numpy as np
from scene_tools import at_thickness, bisect, bracketed

import archfem as af

needs: list[str] = []
python = "bench"

# Exact: solved by a linear programme, in which nothing but physics is set
settings: dict[str, list[dict[str, Any]]] = {
    "thickness": [{"width": 1e-6}, {"width": 1e-4}],
    "sideways": [{}],
}


def version() -> str:
    """Return the version of archfem."""
    return f"archfem {installed('archfem')}"


def structure(scene: dict[str, Any]) -> af.Structure:
    """Return the structure of a scene."""
    laws = {
        name: af.Contact(
            law["normal_stiffness"], law["shear_stiffness"], law["friction"], name
        )
        for name, law in scene["laws"].items()
    }
    materials = {
        block["density"]: af.Material(3e10, 0.2, block["density"] * scene["gravity"])
        for block in scene["blocks"]
    }
    blocks = tuple(
        af.Block(
            tuple(map(tuple, block["outline"])),
            materials[block["density"]],
            block["name"],
            fixed=block["fixed"],
            role="ring",
        )
        for block in scene["blocks"]
    )
    joints = tuple(
        af.Joint(
            tuple(joint["blocks"]),
            *map(tuple, joint["ends"]),
            laws[joint["law"]],
            f"joint {k}",
            role="ring",
        )
        for k, joint in enumerate(scene["joints"])
    )
    return af.Structure(blocks, joints, scene["width"], scene["gravity"], scene["id"])


def run(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Answer a scene."""
    return QUESTIONS[scene["action"]["kind"]](scene, settings)


def find_thickness(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Find the least thickness by bisection of limit analyses."""
    low, high = scene["action"]["between"]

    def falls(thickness: float) -> bool:
        return not af.stands(structure(at_thickness(scene, thickness)))

    return bracketed("thickness", bisect(falls, low, high, settings["width"]), "limit analysis")


def find_factor(scene: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Find the horizontal acceleration at collapse by limit analysis."""
    found = af.collapse_factor(structure(scene), live=af.BodyForce(1.0))
    return {"values": {"factor": found.factor}, "said": str(found)}


QUESTIONS = {"thickness": find_thickness, "sideways": find_factor}
