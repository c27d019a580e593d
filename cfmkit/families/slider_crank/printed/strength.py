"""Where the stress of a strip is looked at: at the highest place of every linear piece, near the end of the travel.

A largest stress between samples is missed by them, and an optimiser finds the strip for which they miss most. So the
stress is taken at the top of every piece, where a polynomial through nine samples of one smooth segment is highest.
The slope of the stress along the strip is zero there, or the top stays at an end of the piece: the derivative of the
highest stress is that at the place where it is. It need not be largest at the very end of the travel: at the last
points it is interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.outcome.stress import STENCIL
from cfmkit.families.slider_crank.printed.chain import STRIP
from cfmkit.numerics.barycentric import differentiation, interpolation

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path


LAST, BETWEEN = 4, 13
"""Points at which the stress is computed, the last ones, and places from the first to the last of them."""

_NODES = np.arange(float(STENCIL))

_SLOPE = differentiation(_NODES)

_NEWTON = 8


@dataclass(frozen=True)
class Watched:
    """From bending and axial stress at the samples of the last points to the stress looked at.

    Attributes
    ----------
    bending, axial : (4, r, rows) arrays
        To the tops of r pieces, with the signs: both add up on the side where they have the same.
    between : (13, 4) array
        Interpolation between the points.
    """

    bending: FloatArray
    axial: FloatArray
    between: FloatArray

    def stress(self, bending: FloatArray, axial: FloatArray) -> FloatArray:
        """Return the stress (13 r, ...) of stresses (4, rows, ...) at the samples [Pa], or derivatives of theirs."""
        tops = np.array(
            [b @ of + a @ along for b, a, of, along in zip(self.bending, self.axial, bending, axial, strict=True)]
        )
        return np.tensordot(self.between, tops, 1).reshape(-1, *tops.shape[2:])


def watched(path: Path, spots: FloatArray) -> Watched:
    """Return where the stress of a strip is looked at.

    Parameters
    ----------
    path : Path
        Its equilibria at the requested points.
    spots : (p,) array
        Places of these points in a variable in which the stress is smooth.
    """
    sections, last = path.sections(STRIP), path.at_requested[-LAST:]
    beam = path.layout.network.beams[STRIP]
    breaks = np.unique(np.concatenate([beam.shape.course(1.0).breaks, beam.section.stations]))
    breaks = breaks[np.append(True, np.diff(breaks) > 1e-12)]
    place = sections.place[0].reshape(-1, path.sampler.per_segment)
    tops = [_tops(sections.bending_stress[k], sections.axial_stress[k], place, breaks) for k in last]
    between = interpolation(spots[-LAST:], np.linspace(spots[-LAST], spots[-1], BETWEEN))
    return Watched(np.array([one[0] for one in tops]), np.array([one[1] for one in tops]), between)


def _tops(bending: FloatArray, axial: FloatArray, place: FloatArray, breaks: FloatArray) -> FloatArray:
    """Return the matrices from the samples' bending and axial stress to the highest of every piece, (2, r, rows).

    The places are given by segment, (segments, samples): a piece has one or more.
    """
    shape: tuple[int, int] = place.shape[0], place.shape[1]
    stress = (np.abs(bending) + np.abs(axial)).reshape(shape)
    lines, best = np.arange(shape[0]), stress.argmax(axis=1)
    first = np.clip(best - STENCIL // 2, 0, shape[1] - STENCIL)
    rows = (lines * shape[1] + first)[:, None] + np.arange(STENCIL)
    bend, pull = (np.sign(part.reshape(shape)[lines, best])[:, None] for part in (bending, axial))
    near = bend * bending[rows] + pull * axial[rows]
    weights = interpolation(_NODES, _top(near, best - first))
    height = (weights * near).sum(axis=1)
    piece = np.searchsorted(breaks, place.mean(axis=1)) - 1
    chosen = [max(np.flatnonzero(piece == k), key=lambda line: height[line]) for k in range(len(breaks) - 1)]
    found = np.zeros((2, len(chosen), len(bending)))
    for sign, matrix in zip((bend, pull), found, strict=True):
        np.put_along_axis(matrix, rows[chosen], (sign * weights)[chosen], axis=1)
    return found


def _top(near: FloatArray, best: Any) -> FloatArray:
    """Return where polynomials through nine values (n, 9) are highest beside their highest value; Newton's method."""
    slope = near @ _SLOPE.T
    curve = slope @ _SLOPE.T
    low, high = np.maximum(best - 1.0, 0.0), np.minimum(best + 1.0, STENCIL - 1.0)
    at: FloatArray = 0.5 * (low + high)
    for _ in range(_NEWTON):
        weights = interpolation(_NODES, at)
        rise, bend = (weights * slope).sum(axis=1), (weights * curve).sum(axis=1)
        step = np.where(bend < 0, -rise / np.where(bend < 0, bend, -1.0), np.sign(rise))
        at = np.clip(at + step, low, high)
    return at
