"""Where rollers run on flanks as they were built: the outermost place that no point of the flank forbids.

A roller is larger than the waves of a cut edge: it rides on the crests and bridges hollows
narrower than itself. Its centre is on the design's roller path, moved along the normal until
the circle touches the built flank and cuts it nowhere; the direction of its track is
perpendicular to the contact's normal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.cam.geometry.flank import BuiltFlank, DesignFlank, arc_lengths
from cfmkit.numerics.registration import CurveFrame, feet
from cfmkit.numerics.smoothing import smoothed

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

STEP = 5e-5
"""Distance of the places that are computed [m]."""

REACH = 2e-3
"""How far along the flank, beside the place where the design touches, contact is sought [m]."""


@dataclass(frozen=True)
class BuiltTrack:
    """The track of a roller's centre on a built flank, mirrored to the right, over the slider's position.

    Attributes
    ----------
    slider : (n,) array
        Increasing: height of the slider above the path's first point [m].
    x, y : (n,) array
        Roller centre [m].
    slope : (n,) array
        dy/dx of the track.
    """

    slider: FloatArray
    x: FloatArray
    y: FloatArray
    slope: FloatArray

    def at(self, slider: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return x [m] and slope of the track at slider positions."""
        return np.interp(slider, self.slider, self.x), np.interp(slider, self.slider, self.slope)


def built_flank(design: DesignFlank, points: FloatArray, errors: FloatArray, noise: float) -> BuiltFlank:
    """Return a flank from registered points.

    Parameters
    ----------
    design : DesignFlank
        The right flank.
    points : (n,) array
        Path coordinates of the points' feet [m], in any order; those at one place are averaged.
    errors : (n,) array
        Their distances from the design along its normal [m].
    noise : float
        Standard deviation of the measurement [m].
    """
    arc = arc_lengths(design)
    along = np.interp(points, *arc)
    places, inverse, counts = np.unique(np.round(along, 9), return_inverse=True, return_counts=True)
    mean = np.bincount(inverse, errors) / counts
    return BuiltFlank(design, smoothed(places, mean, noise), arc)


def built_track(flank: BuiltFlank, roller_radius: float, brace_length: float) -> BuiltTrack:
    """Return the track of a roller's centre on a built flank.

    Parameters
    ----------
    flank : BuiltFlank
        Mirrored to the right.
    roller_radius, brace_length : float
        Of the parts built in [m].
    """
    low, high = flank.ends
    places = np.linspace(low, high, max(int((high - low) / STEP), 50) + 1)
    base = flank.design.frame(np.interp(places, flank.arc[1], flank.arc[0]))
    centers = base.points + roller_radius * base.normals
    lift, contact = _lift(flank, places, (centers, base.normals), roller_radius)
    for _ in range(3):
        contact = feet(flank, centers + lift[:, None] * base.normals, contact)
        at = flank.frame(contact)
        gap = centers + lift[:, None] * base.normals - at.points
        lift = lift + (roller_radius - np.hypot(gap[:, 0], gap[:, 1])) / (at.normals * base.normals).sum(axis=1)
    centers = centers + lift[:, None] * base.normals
    return _over_slider(centers, flank.frame(contact), brace_length)


def _lift(
    flank: BuiltFlank, places: FloatArray, nominal: tuple[FloatArray, FloatArray], radius: float
) -> tuple[FloatArray, FloatArray]:
    """Return how far the circle must move along the normal to cut the flank nowhere, and where it then touches."""
    centers, normals = nominal
    points = flank.frame(places).points
    count, reach = len(places), max(int(REACH / (places[1] - places[0])), 2)
    best, where = np.full(count, -np.inf), np.zeros(count, dtype=int)
    for shift in range(-reach, reach + 1):
        other = np.clip(np.arange(count) + shift, 0, count - 1)
        gap = points[other] - centers
        along = (gap * normals).sum(axis=1)
        beside = (gap * gap).sum(axis=1) - along**2
        need = along + np.sqrt(np.maximum(radius**2 - beside, 0.0))
        better = need > best
        best, where = np.where(better, need, best), np.where(better, other, where)
    return best, places[where]


def _over_slider(centers: FloatArray, contact: CurveFrame, brace: float) -> BuiltTrack:
    x, y = centers.T
    slider = y + np.sqrt((brace - x) * (brace + x))
    # Where a wave makes the slider fall the roller jumps to the next place at which it rises beyond.
    rising = slider >= np.maximum.accumulate(slider)
    rising[1:] &= np.diff(np.maximum.accumulate(slider)) > 0
    slope = contact.normals[:, 0] / -contact.normals[:, 1]
    return BuiltTrack(slider[rising], x[rising], y[rising], slope[rising])
