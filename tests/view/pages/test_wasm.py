"""The kernels of pages are those of Python: stamp, size, and runs in Node and Chromium."""

import gzip
import json
import runpy
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from chromium import browser, complaints
from live_scripts import run_in_node

import archfem as af
from archfem.dynamics import LooseBlocks, RigidBlockSimulation
from archfem.view.pages import live

RUNS = """
(async () => {
  const module = new WebAssembly.Module(await inflate(given.wasm));
  const engine = { module, leaves: given.leaves };
  return given.scales.map((scale) => {
    const { frames, lost, fell } = shake(engine, given.arch, given.motion, scale);
    return { frames: frames.slice(0, given.frames).map((each) => [...each]), lost, fell };
  });
})()
"""


@cache
def ring():
    return af.circular_arch(radius=2.95, thickness=0.35, embrace=159.0, voussoirs=11)


def shaken(pga, duration=2.0):
    """An earthquake as a page has it: its samples are rounded."""
    motion = af.Motion.synthetic(seed=1, duration=duration, dt=0.01, pga=pga)
    return af.Motion(np.round(motion.horizontal, 5), 0.01, np.round(motion.vertical, 5))


def script_input(motion, scales=(1.0,), frames=101):
    """What the scripts of a page need for runs of the ring."""
    return {
        "wasm": live._pack(live.WASM.read_bytes()),
        "leaves": json.loads(live.LAYOUT.read_text())["leaves"],
        "arch": live.describe_arch(ring()),
        "motion": live.list_motions([motion])[0],
        "scales": scales,
        "frames": frames,
    }


def simulate(motion, end):
    """Poses of the simulation of Python, every 20 ms."""
    simulation = RigidBlockSimulation(ring(), dt=5e-4)
    frames = simulation.frames(LooseBlocks.as_built(ring()), end, motion)
    return np.array([frame.poses for frame in frames])


def test_the_kernels_are_those_of_the_sources():
    stamp = json.loads(live.LAYOUT.read_text())["digest"]
    exporter = runpy.run_path(str(Path(__file__).parents[3] / "docs" / "page_kernels.py"))
    assert stamp == exporter["digest_sources"](), "run `make wasm`, and commit what it writes"


def test_the_kernels_are_small():
    assert len(gzip.compress(live.WASM.read_bytes())) < 100e3


def test_a_run_in_node_is_that_of_python():
    """Bodies, workspace and first step agree: rounding alone differs, before it grows."""
    motion = shaken(12.0)
    (found,) = run_in_node(script_input(motion), RUNS)
    poses = simulate(motion, 2.0)
    assert np.abs(poses).max() > 0.05  # it rocks
    assert np.reshape(found["frames"], poses.shape) == pytest.approx(poses, abs=1e-12)


@pytest.mark.slow
def test_a_run_in_chromium_is_that_of_python(tmp_path):
    motion = shaken(12.0)
    analysis = af.Analysis(ring(), fidelity="rigid", damping="effective")
    path = analysis.page(motions=[motion]).save(tmp_path / "page.html")
    with browser() as driver:
        driver.get(path.as_uri())
        program = f"const given = arguments[0], done = arguments[1]; {RUNS.strip()}.then(done)"
        (found,) = driver.execute_async_script(program, script_input(motion))
        assert complaints(driver) == []
    poses = simulate(motion, 2.0)
    assert np.reshape(found["frames"], poses.shape) == pytest.approx(poses, abs=1e-12)


@pytest.mark.slow
def test_outcomes_are_those_of_python():
    """Falls are chaotic: one case in twenty may differ, and none far from the critical scale."""
    motion, scales = shaken(1.0, duration=3.0), np.linspace(2.0, 21.0, 20).tolist()
    found = [run["fell"] is not None for run in run_in_node(script_input(motion, scales, 0), RUNS)]
    simulation, expected = RigidBlockSimulation(ring(), dt=5e-4), []
    for scale in scales:
        frames = simulation.frames(LooseBlocks.as_built(ring()), 7.0, motion.scaled(scale))
        kind = af.dynamics.classify_collapse(ring(), frames).kind
        expected.append(kind in ("partly fallen", "fallen"))
    assert 4 <= sum(expected) <= 16
    assert sum(a != b for a, b in zip(found, expected, strict=True)) <= 1
