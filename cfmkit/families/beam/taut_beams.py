"""Beams that are pulled taut: which ones, and how long the way is from a node to where the network is held.

Assumes: inextensible beams. One that is bent is pulled ever harder as it straightens. Straight ones that turn on pins
bear nothing until they lie in one line with a support, and then cannot follow at all.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import Displacement
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.elastica import Network
    from cfmkit.elastica.results.path import Path

_STRAIGHT_LENGTH_SHARE = 0.995  # of the length of a taut beam or chain lies between its ends
_TAUT_RATIO = 50.0  # N L^2 / EI: it is pulled so hard that only its ends are bent


def taut_beams(path: Path, last: int) -> list[str]:
    """Return what is pulled straight at a point of a path: each with the way between its ends and its length.

    These are beams, or else ways along several of them from the driven node to a support.
    """
    return list(_find_pulled(path, last)) or list(_in_line(path, last))


def _find_pulled(path: Path, last: int) -> Iterator[str]:
    """Yield the beams that are straight and pulled hard."""
    for name, beam in path.network.beams.items():
        line = path.shape(name, last)
        chord = line[-1] - line[0]
        way, length = float(np.hypot(*chord)), float(np.real(path.fits[name].length))
        if way < _STRAIGHT_LENGTH_SHARE * length:
            continue
        pull = float(path.end_force(name, 1)[last, :2] @ chord) / way
        stiffness = float(np.real(beam.section.rigidities(np.array([0.5]), 0.5)[0][0]))
        if pull * length**2 > _TAUT_RATIO * stiffness:
            yield f"{name}: {_describe_beam(way, length)}"


def _in_line(path: Path, last: int) -> Iterator[str]:
    """Yield the supports that the driven node has moved away from by nearly the whole way along the beams."""
    network, drive = path.network, path.load_case
    if not isinstance(drive, Displacement):
        return
    lengths = {
        name: float(np.real(fit.length)) + math.hypot(*beam.start_offset) + math.hypot(*beam.end_offset)
        for (name, beam), fit in zip(network.beams.items(), path.fits.values(), strict=True)
    }
    for name, length in ways_to_supports(network, drive.node, lengths).items():
        first, now = (_apart(path, drive.node, name, point) for point in (0, last))
        if now > max(_STRAIGHT_LENGTH_SHARE * length, first):  # a column is as straight when it begins to shorten
            yield f"{name} to {drive.node}: {_describe_beam(now, length)}"


def _describe_beam(way: float, length: float) -> str:
    return f"{format_short(way, 'length')} of {format_short(length, 'length')}"


def _apart(path: Path, one: str, other: str, point: int) -> float:
    """Return how far two nodes are apart at a point of a path [m]."""
    places = [
        np.array([node.x, node.y]) + path.motion(name)[point, :2]
        for name, node in ((name, path.network.nodes[name]) for name in (one, other))
    ]
    return math.hypot(*(places[1] - places[0]))


def ways_to_supports(
    network: Network,
    node: str,  # where the ways begin; it is none of those that are held
    lengths: Mapping[str, float],  # from the name of a beam to its length [m]
) -> dict[str, float]:
    """Return the shortest way along beams and links from a node to every node that is held in place [m]."""
    ways = [(beam.start, beam.end, lengths[name]) for name, beam in network.beams.items()]
    ways += [(link.master, link.node, distance(network, link.master, link.node)) for link in network.links]
    reached = {node: 0.0}
    for _ in network.nodes:
        for one, other, length in (*ways, *((b, a, length) for a, b, length in ways)):
            if one in reached and reached[one] + length < reached.get(other, math.inf):
                reached[other] = reached[one] + length
    supports = {name: at.support for name, at in network.nodes.items()}
    return {name: way for name, way in reached.items() if supports[name].along and supports[name].across}


def distance(network: Network, one: str, other: str) -> float:
    """Return how far two nodes are apart before any load [m]."""
    first, second = network.nodes[one], network.nodes[other]
    return math.hypot(second.x - first.x, second.y - first.y)
