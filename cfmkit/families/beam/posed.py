"""A bent mechanism as a picture shows it: smooth centre lines, and the rigid parts between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.model.network import LineSpring
from cfmkit.elastica.outcome.sections import TURN

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path

_BETWEEN = 4  # points of the picture for a step of the sampling
_NEAR = 1e-9  # of the size: parts shorter than this are not there


def bent(path: Path, beam: str, point: int) -> FloatArray:
    """Return the centre line of a beam at a point of the path, (n, 2) [m].

    Between the samples of the engine it is the cubic that has their places and directions.
    """
    sampler, index = path.sampler, list(path.layout.network.beams).index(beam)
    rows, fitted = sampler.rows(index), path.layout.fits[beam]
    places, turns = path.shape(beam, point), sampler.states[point, rows.index, TURN]
    share = np.arange(_BETWEEN) / _BETWEEN
    pieces = []
    for k in np.flatnonzero(np.diff(rows.t) > 0):
        inside = float(sampler.cut.middle[rows.step[k]])
        angles = np.real(fitted.angle(rows.t[k : k + 2], inside)) + turns[k : k + 2]
        pieces.append(_cubic(places[k], places[k + 1], angles, share))
    return np.concatenate([*pieces, places[-1:]])


def _cubic(start: FloatArray, end: FloatArray, angles: FloatArray, share: FloatArray) -> FloatArray:
    """Return points between two places, of the cubic with the directions [rad] there that follows a circle best."""
    speed = float(np.hypot(*(end - start))) / np.cos(0.25 * (angles[1] - angles[0])) ** 2
    first, last = speed * np.column_stack([np.cos(angles), np.sin(angles)])
    s = share[:, None]
    here = (1 - s) ** 2 * ((1 + 2 * s) * start + s * first)
    points: FloatArray = here + s**2 * ((3 - 2 * s) * end - (1 - s) * last)
    return points


def rigid_parts(path: Path, point: int | None) -> list[FloatArray]:
    """Return links and the arms beside nodes as lines (2, 2) [m], at a point of the path or before any load."""
    network = path.layout.network
    found = [np.array([place(path, one.master, point), place(path, one.node, point)]) for one in network.links]
    for beam in network.beams.values():
        for node, arm in ((beam.start, beam.start_offset), (beam.end, beam.end_offset)):
            at = place(path, node, point)
            angle = 0.0 if point is None else float(path.motion(node)[point, 2])
            turned = complex(*map(float, np.real(arm))) * np.exp(1j * angle)
            found.append(np.array([at, at + np.array([turned.real, turned.imag])]))
    return [line for line in found if np.hypot(*(line[1] - line[0])) > _NEAR * path.layout.scales.length]


def spring_lines(path: Path) -> list[FloatArray]:
    """Return the springs between two places as lines (2, 2) [m], before any load."""
    found = []
    for spring in path.layout.network.springs:
        if isinstance(spring, LineSpring):
            ground = np.array([float(np.real(x)) for x in spring.ground])
            other = ground if spring.end is None else place(path, spring.end, None)
            found.append(np.array([place(path, spring.start, None), other]))
    return found


def place(path: Path, node: str, point: int | None) -> FloatArray:
    """Return where a node is at a point of the path, or before any load [m]."""
    at = np.real(np.array(path.layout.position(node)))
    return at if point is None else at + path.motion(node)[point, :2]
