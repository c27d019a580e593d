"""The deformed centre line of a leaf by the closed forms, for pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.vcfm.leaves.s_form import BUCKLING_LOAD, POLE_LOAD, axial_root, pose

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip

N_LINE_POINTS = 81


def bent_leaf(
    strip: LeafStrip,  # the leaf
    travel: float,  # of its far end towards the flat pose [m]
    critical: float | None = None,  # load of the buckled form; None: it is not buckled
    # whether the far end moves across as it likes, without axial force, as the corner of a diamond does
    free: bool = False,
) -> FloatArray:
    """Return the centre line of a straight leaf bent into an S, buckled under `critical` [N] where that is given."""
    length, angle = float(strip.length), float(strip.angle)
    at = pose(angle, travel / length)
    stretch = (strip.thickness / length) ** 2 / 3.0
    z = 0.0 if free else float(axial_root(at.shortening, at.turn, stretch))
    if critical is not None:
        z = BUCKLING_LOAD
    place = np.linspace(0.0, 1.0, N_LINE_POINTS)
    slope = float(at.turn) * _s_slope(min(z, POLE_LOAD - 0.05), 2.0 * place - 1.0)
    if critical is not None:
        spare = float(at.shortening) - critical / float(strip.axial) - 0.25 * float(at.turn) ** 2
        slope = slope + 2.0 * np.sqrt(max(spare, 0.0)) * np.sin(2.0 * np.pi * place)
    angles = angle - float(at.turn) + slope
    end = (float(strip.reach), float(strip.rise) - travel)
    if free:
        steps = np.full(N_LINE_POINTS, length / N_LINE_POINTS)
        end = (float((np.cos(angles) * steps).sum()), end[1])
    return line_between(angles, np.full(N_LINE_POINTS, length / N_LINE_POINTS), end)


def _s_slope(z: float, eta: FloatArray) -> FloatArray:
    """Return the slope to the chord over the end slope, at -1 ... 1 along the leaf."""
    if abs(z) < 1e-6:
        return 0.5 * (3.0 * eta**2 - 1.0)
    q = np.sqrt(complex(z))
    mean = np.sin(q) / q
    return np.asarray(np.real((np.cos(q * eta) - mean) / (np.cos(q) - mean)))


def line_between(angles: FloatArray, steps: FloatArray, end: tuple[float, float]) -> FloatArray:
    """Return the line of these directions and step lengths, its far end brought to its place evenly."""
    along = np.column_stack([np.cos(angles), np.sin(angles)])
    middle = 0.5 * (along[1:] + along[:-1]) * steps[1:, None]
    line = np.concatenate([[[0.0, 0.0]], np.cumsum(middle, axis=0)])
    share = np.linspace(0.0, 1.0, len(line))[:, None]
    found: FloatArray = line + share * (np.array(end) - line[-1])
    return found
