"""Between poses of a solid the curve is a cubic: how far it is off is measured, and poses are added until it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cfmkit.export import polygon
from cfmkit.solid.meshed_part import MAX_EFFORT_ERROR, HeldOrDriven, Part, _check_interval, refine_path, rings_of
from cfmkit.solid.plane_stress_law import MATERIAL_LAWS


@pytest.fixture(scope="module")
def leaf():
    """Return an inclined leaf, meshed coarsely: its curve has a peak, a valley and a steep end, and no corner."""
    t, way = 1e-3, np.array([0.05, -0.004])
    start, end = np.zeros(2), way
    up = t * np.array([-way[1], way[0]]) / np.hypot(*way)
    corners = [start - up, end - up, end + up, start + up]
    outline = polygon([(float(x), float(y)) for x, y in corners], "cut")
    law = MATERIAL_LAWS["st-venant-kirchhoff"](2e9, 0.3)
    driven = np.array([0.0, -1.0, 0.0])
    shuttle = HeldOrDriven("shuttle", (np.array([start - up, start + up]),), start, driven)
    wall = HeldOrDriven("wall", (np.array([end - up, end + up]),), end)
    return Part(rings_of((outline,)), 2 * t, 0.006, law, (shuttle, wall)).create_mesh(1.5e-3)


STOPS = np.linspace(0.0, 0.009, 25).tolist()


@pytest.fixture(scope="module")
def many(leaf):
    """Return the path with many poses."""
    return leaf.follow_stops(STOPS).course


def thinned(many):
    return replace(many, poses=tuple(pose for pose in many.poses if pose.travel in STOPS[::8]))


def off(course, many):
    """Return by how much the curve of a path misses the poses of another, in parts of the largest force."""
    largest = max(abs(pose.effort) for pose in many.poses)
    return max(abs(float(course.effort(np.array([one.travel]))[0]) - one.effort) for one in many.poses) / largest


def test_poses_are_added_until_the_curve_is_that_of_many_poses(leaf, many):
    few = thinned(many)
    course, between = refine_path(leaf.problem, few)
    assert off(few, many) > 2 * MAX_EFFORT_ERROR  # so few poses do not do
    assert off(course, many) <= min(MAX_EFFORT_ERROR, between)
    assert len(few.poses) < len(course.poses) <= 2 * len(few.poses)


def test_what_is_reported_is_what_many_poses_find(leaf, many):
    # the first check alone: the interval that is expected to be the worst one is, within a factor of three
    few = thinned(many)
    checked, difference = _check_interval(leaf.problem, few, set())
    largest = max(abs(pose.effort) for pose in few.poses)
    assert len(checked.poses) == len(few.poses) + 1
    assert off(few, many) / 3 < difference / largest < 3 * off(few, many)


def test_added_poses_are_equilibria_in_order_of_travel_and_keep_the_requested_ones(leaf):
    stops = [0.0, 0.003, 0.006, 0.009]
    dense = leaf.densely(stops, lambda _share: None, MAX_EFFORT_ERROR)
    travel = dense.course.travel
    assert dense.between <= MAX_EFFORT_ERROR
    assert (np.diff(travel) > 0).all()
    assert set(stops) <= set(travel.tolist())
    assert dense.peaks[0].shape == travel.shape
    supports, elements = leaf.problem.supports, leaf.problem.elements
    for pose in dense.course.poses:
        forces = elements.forces(supports.evaluate_displacements(pose.unknowns, pose.travel))
        out = np.abs(supports.residual(pose.unknowns, pose.travel, forces)).max()
        assert out <= 1e-6 * np.abs(forces).max() + 1e-12


def test_a_curve_of_two_poses_has_no_measured_error(leaf):
    assert np.isnan(leaf.densely([0.0, 0.0001], lambda _share: None, MAX_EFFORT_ERROR).between)
