"""Joints over time: recorded quantities, and their limits."""

from dataclasses import replace

import numpy as np
import pytest
from glued import glued
from pictures import history

import archfem as af
from archfem.view import draw_joint, draw_joints
from archfem.view.histories import most_stressed_joints


def units(axes):
    """Whether every label of axes has a unit."""
    return all("[" in label for label in (axes.get_xlabel(), axes.get_ylabel()) if label)


def test_joint_histories_show_the_recorded_values_and_limits(run):
    figure = draw_joints(run, [6, 9])
    top, *others = figure.axes
    panels = np.array(others).reshape(2, 2)
    assert all(units(axes) for axes in figure.axes)
    for row, number in zip(panels, (6, 9), strict=True):
        for axes, name in zip(row, ("eccentricity", "friction"), strict=True):
            shown = axes.lines[-1].get_ydata()
            own = run.joints.sel(joint=number)
            sense = np.sign(own["V"].values) if name == "friction" else 1.0
            assert shown == pytest.approx(sense * own[name].values)
        assert f"joint {number}" in row[0].get_ylabel()
        assert [text.get_text() for text in row[0].texts] == ["hinge from |e| = 0.46"]
        assert row[1].lines[0].get_ydata()[0] == pytest.approx(0.6)
    drawn = [line for axes in figure.axes for line in axes.lines]
    assert sum(line.get_label() == "horizontal" for line in drawn) == 1  # the ground, once
    ground = {line.get_label(): line.get_ydata() for line in top.lines}
    assert ground["horizontal"] == pytest.approx(run.dataset["ground"].values[:, 0])
    assert ground["vertical"] == pytest.approx(run.dataset["ground"].values[:, 1])


def test_long_names_of_joints_are_broken_into_lines(bridge):
    run = history(bridge, 0.3)
    run.dataset["ground"] = (("time", "axis"), np.zeros((2, 2)))
    names = [joint.name for joint in bridge.joints]
    long = "main arch, voussoir 12 to backfill"
    axes = draw_joints(run, [names.index(long)]).axes[1]
    lines = axes.get_ylabel().splitlines()[:-1]
    assert " ".join(lines) == long
    assert max(map(len, lines)) <= 20


def test_joints_are_drawn_by_name_or_number(run):
    by_name, by_number = (draw_joints(run, [joint]).axes[1] for joint in ("joint 6", 6))
    assert by_name.get_ylabel() == by_number.get_ylabel()
    with pytest.raises(af.InvalidInput, match=r"no joint 18: give a number from 0 to 17"):
        draw_joints(run, [0, 18])
    with pytest.raises(af.InvalidInput, match="no joints to draw: give their names"):
        draw_joints(run, [])


def test_limits_are_those_of_the_criteria_carried(run):
    sharp = af.Criteria(hinge=0.47, friction=2.0)
    axes = draw_joints(run.with_criteria(sharp), [0]).axes
    heights = {float(line.get_ydata()[0]) for each in axes for line in each.lines[:8]}
    assert {0.47, 2.0} <= heights
    assert not {0.46, 0.6} & heights


def test_one_joint_of_several_runs(runs):
    figure = draw_joint(runs, "joint 4")
    upper, lower = figure.axes[:2], figure.axes[2:]
    for axes, below, (name, run) in zip(upper, lower, runs.items(), strict=True):
        assert axes.get_title() == f"{name}: joint 4"
        own = run.joint(4)
        drawn = axes.lines[-1].get_ydata()
        assert np.nanmax(np.abs(drawn)) == pytest.approx(float(own["friction"].max()))
        assert below.lines[-1].get_ydata() == pytest.approx(own["eccentricity"].values, nan_ok=True)
    assert upper[0].get_ylim() == upper[1].get_ylim()
    with pytest.raises(af.InvalidInput, match="joint 44"):
        draw_joint(runs, "joint 44")


def test_cohesion_raises_the_limit_that_is_drawn(ring):
    """By c A / N, where the joint is closed all over."""
    cohesive = [
        replace(joint, contact=replace(joint.contact, cohesion=5e3)) for joint in ring.joints
    ]
    held = history(replace(ring, joints=tuple(cohesive)), 0.1)
    held.dataset["ground"] = (("time", "axis"), np.zeros((2, 2)))
    line = draw_joints(held, [0]).axes[2].lines[0].get_ydata()
    own = held.joints.isel(joint=0)
    assert line == pytest.approx(0.6 + 0.99 * 5e3 * ring.depths[0] / own["N"].values)


def test_joints_that_never_slide_have_no_limit(ring):
    held = history(glued(ring), 0.1)
    held.dataset["ground"] = (("time", "axis"), np.zeros((2, 2)))
    assert len(draw_joints(held, [0]).axes[2].lines) == 1


def test_the_most_stressed_joints_are_no_mirror_images(ring):
    """Joints 4 and 13 hinge equally, mirror images; joint 9 slides for longest, and is second."""
    time = np.linspace(0.0, 1.0, 11)
    found = np.zeros((11, 18, 3))
    found[..., 0] = 1e4
    found[5, [4, 13], 2] = 0.49 * 1e4 * 0.55
    found[3:8, 13, 1] = 0.7e4
    found[3:6, 9, 1] = 0.7e4
    dataset = af.joints.joint_dataset(ring, found, time)
    assert most_stressed_joints(af.History(dataset, ring)) == [4, 9]
    assert most_stressed_joints(af.History(dataset)) == [4, 13]


def test_friction_beyond_the_axis_is_stated(ring):
    """V / N of 9 where μ is 0.6: the axis ends at 1.8, and text states the largest value."""
    time = np.linspace(0.0, 1.0, 11)
    found = np.zeros((11, 18, 3))
    found[..., 0] = 1e4
    found[5, 4, 1] = 9e4
    dataset = af.joints.joint_dataset(ring, found, time)
    dataset["ground"] = (("time", "axis"), np.zeros((11, 2)))
    axes = draw_joints(af.History(dataset, ring), [4]).axes[-1]
    assert axes.get_ylim()[1] == pytest.approx(1.8)
    assert "up to 9" in " ".join(text.get_text() for text in axes.texts)
