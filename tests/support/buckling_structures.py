"""Leaves, arches and columns that buckle on their way: networks of the elastic engine, and drives for them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import cfmkit.elastica as el

if TYPE_CHECKING:
    from collections.abc import Sequence

UP, DOWN = np.pi / 2, -np.pi / 2
LEAF_LENGTH, LEAF_RISE = 35e-3, 35e-3 * np.sin(np.radians(8))
STRIP = el.Section(2e9, 8e-3, 1e-3)
ALONG = el.slider_support(0.0, rotates=True)
STIFF_STRIP = el.Section(2e9, 8e-3, 1e-3, axial=False)


def leaves(
    factors: Sequence[float] = (1.0,), thickness: float = 7e-4, angle: float = 8.0, turns: bool = False, **section: Any
) -> el.Network:
    """Return inclined leaves left and right of one shuttle, with factors on their thickness: pressed down they buckle.

    angle [deg]: to the horizontal; turns: the shuttle may turn, too.
    """
    rise, across = LEAF_LENGTH * np.sin(np.radians(angle)), LEAF_LENGTH * np.cos(np.radians(angle))
    nodes, beams = {"d": el.Node(0, rise, el.slider_support(UP, turns))}, {}
    for k, factor in enumerate(factors):
        down = 5e-3 * (k // 2)
        nodes[f"w{k}"] = el.Node(across * (-1) ** (k + 1), -down, el.CLAMPED_SUPPORT)
        strip = el.Section(1477e6, 6e-3, thickness * factor, **section)
        beams[f"b{k}"] = el.Beam(f"w{k}", "d", strip, end_offset=(0.0, -down))
    return el.Network(nodes, beams)


def ding_leaf(thickness: float = 1e-3) -> el.Network:
    """Return the V-beam of Ding, Li and Li (2022), pressed down at d it buckles twice."""
    length, angle = 35e-3, np.radians(7)
    nodes = {
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "d": el.Node(length * np.cos(angle), length * np.sin(angle), el.slider_support(UP)),
    }
    return el.Network(nodes, {"v": el.Beam("wall", "d", el.Section(1477e6, 6e-3, thickness))})


def column(section: el.Section, clamped: bool) -> el.Network:
    """Return a column of 0.1 m whose far end b is guided along it; else it is pinned at both ends."""
    start, end = (el.CLAMPED_SUPPORT, el.slider_support(0.0)) if clamped else (el.PINNED_SUPPORT, ALONG)
    return el.Network({"a": el.Node(0, 0, start), "b": el.Node(0.1, 0, end)}, {"x": el.Beam("a", "b", section)})


def half_arch(rise: float, thickness: float) -> el.Network:
    """Return half of a clamped cosine arch that spans 0.2 m, its middle guided."""
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "t": el.Node(0.1, rise, el.slider_support(UP))}
    return el.Network(nodes, {"x": el.Beam("a", "t", el.Section(1e9, 1e-2, thickness), el.CosineArch(rise, 0.5))})


def arch(
    rise: float = 0.02, half: float = 0.1, section: el.Section = STRIP, end: el.Support = el.PINNED_SUPPORT
) -> el.Network:
    """Return a cosine arch of two beams; pinned and pushed at its top it sways off before its limit point."""
    nodes = {"a": el.Node(0, 0, end), "t": el.Node(half, rise), "b": el.Node(2 * half, 0, end)}
    shapes = el.CosineArch(rise, 0.5), el.CosineArch(-rise, 0.5)
    return el.Network(nodes, {"x": el.Beam("a", "t", section, shapes[0]), "y": el.Beam("t", "b", section, shapes[1])})


def toggle(
    rise: float,
    section: el.Section = STRIP,
    half: float = 0.1,
    shift: float = 0.0,
    end: el.Support = el.CLAMPED_SUPPORT,
    **more: Any,
) -> el.Network:
    """Return two straight bars that meet at an apex t, the second one longer by a shift."""
    nodes = {"a": el.Node(0, 0, end), "t": el.Node(half, rise), "b": el.Node(2 * half + shift, 0, end)}
    return el.Network(nodes, {"x": el.Beam("a", "t", section), "y": el.Beam("t", "b", section)}, **more)


def cantilever(section: el.Section = STRIP, shape: Any = el.STRAIGHT_SHAPE, **more: Any) -> el.Network:
    """Return a strip of 0.1 m along x, clamped at a, free at t."""
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "t": el.Node(0.1, 0)}
    return el.Network(nodes, {"x": el.Beam("a", "t", section, shape)}, **more)


def press(node: str, points: Any) -> el.Displacement:
    """Return a drive that moves a node down."""
    return el.Displacement(node, DOWN, np.asarray(points, float))


def load(node: str, points: Any, **force: float) -> el.Loading:
    """Return a drive by a load on a node, downwards with 1 N unless stated."""
    return el.Loading((el.PointLoad(node, **(force or {"fy": -1.0})),), np.asarray(points, float))
