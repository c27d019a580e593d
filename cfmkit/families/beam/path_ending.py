"""Why a path of equilibria ends, and what the engine says of it, in the units of a user: the engine knows SI only.

Beams that are pulled taut: which ones, and how long the way is from a node to where the network is held.

Assumes: inextensible beams. One that is bent is pulled ever harder as it straightens. Straight ones that turn on pins
bear nothing until they lie in one line with a support, and then cannot follow at all.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import Displacement, PathStatus
from cfmkit.elastica.mechanics.discretise import discretise, make_inextensible
from cfmkit.elastica.mechanics.march import equations
from cfmkit.families.beam.solution import node_at
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.elastica import Network
    from cfmkit.elastica.results.path import Path
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.solution import Solution
    from cfmkit.families.beam.spec import BeamSpec


_STRAIGHT_LENGTH_SHARE = 0.995  # of the length of a taut beam or chain lies between its ends
_TAUT_RATIO = 50.0  # N L^2 / EI: it is pulled so hard that only its ends are bent


def taut_beams(path: Path, last: int) -> list[str]:
    """Return what is pulled straight at a point of a path: each with the way between its ends and its length.

    These are beams, or else ways along several of them from the driven node to a support.
    """
    return list(_describe_pulled_beams(path, last)) or list(_describe_taut_supports(path, last))


def _describe_pulled_beams(path: Path, last: int) -> Iterator[str]:
    """Yield a text for each beam that is straight and pulled hard: distance of its ends, and length."""
    for name, beam in path.network.beams.items():
        line = path.shape(name, last)
        chord = line[-1] - line[0]
        distance_of_ends, length = float(np.hypot(*chord)), float(np.real(path.fits[name].length))
        if distance_of_ends < _STRAIGHT_LENGTH_SHARE * length:
            continue
        pull = float(path.end_force(name, 1)[last, :2] @ chord) / distance_of_ends
        stiffness = float(np.real(beam.section.rigidities(np.array([0.5]), 0.5)[0][0]))
        if pull * length**2 > _TAUT_RATIO * stiffness:
            yield f"{name}: {_describe_lengths(distance_of_ends, length)}"


def _describe_taut_supports(path: Path, last: int) -> Iterator[str]:
    """Yield a text for each support to which the beams from the driven node are straight: distance, and length."""
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
            yield f"{name} to {drive.node}: {_describe_lengths(now, length)}"


def _describe_lengths(distance_of_ends: float, length: float) -> str:
    return f"{format_short(distance_of_ends, 'length')} of {format_short(length, 'length')}"


def _apart(path: Path, first: str, second: str, point: int) -> float:
    """Return how far two nodes are apart at a point of a path [m]."""
    return math.hypot(*(node_at(path, second, point) - node_at(path, first, point)))


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
        for near_node, far_node, length in (*ways, *((b, a, length) for a, b, length in ways)):
            if near_node in reached and reached[near_node] + length < reached.get(far_node, math.inf):
                reached[far_node] = reached[near_node] + length
    supports = {name: at.support for name, at in network.nodes.items()}
    return {name: length for name, length in reached.items() if supports[name].along and supports[name].across}


def distance(network: Network, first_node: str, second_node: str) -> float:
    """Return how far two nodes are apart before any load [m]."""
    first, second = network.nodes[first_node], network.nodes[second_node]
    return math.hypot(second.x - first.x, second.y - first.y)


_NUMBER_PATTERN = r"(-?\d[\d.]*(?:e[+-]?\d+)?)"
_PLACE_PATTERN = re.compile(
    rf"\b(at|near) {_NUMBER_PATTERN}(?![\d.e]| of )"
)  # not a share: "lost at 0.4 of the constant loads"
_LENGTH_PATTERN = re.compile(rf"{_NUMBER_PATTERN} m\b")


def drive_text(assembly: Assembly, value: float) -> str:
    """Return a value of the drive [SI, of one copy] as the user reads it, of all copies together."""
    return assembly.spec.mechanism.drive.text(value, assembly.parallel)


def add_units(assembly: Assembly, text: str) -> str:
    """Return a sentence of the engine with units."""
    text = _LENGTH_PATTERN.sub(lambda match: format_short(float(match[1]), "length"), text)
    return _PLACE_PATTERN.sub(lambda match: f"{match[1]} {drive_text(assembly, float(match[2]))}", text)


EXTENSIBLE_OPTION = "analysis.fidelity=extensible"
_PARALLEL_RTOL = 1e-9  # of its length a beam may leave the line of the drive: angles are read in degrees and rounded


@dataclass(frozen=True)
class PathEnding:
    """One sentence, and what would change it, as ``--set`` takes it."""

    message: str
    cures: tuple[str, ...] = ()


def ending_of(solution: Solution) -> PathEnding:
    """Return why a path ended; a path that is complete has nothing to say."""
    path = solution.path
    said = add_units(solution.assembly, path.message or path.status.value)
    spreads = bool(path.contact_events) and path.contact_events[-1].kind == "spreads" and bool(path.changes_contact[-1])
    rigid = solution.spec.fidelity == "inextensible" and not spreads  # then the contact is why
    taut: list[str] = []
    kept = len(solution.keep) > 1
    if rigid and path.status in (PathStatus.LIMIT_POINT, PathStatus.LOST) and len(path):
        taut = taut_beams(path, int(solution.keep[-1])) if kept else []
        # points of the curve may be so far apart that they are pulled straight after the last of them, or the first
        if not taut:
            taut, kept = taut_beams(path, len(path) - 1), False
    if not taut and len(solution.keep) < 2:
        return PathEnding(f"{said}: {_list_blocking_keys(solution)}", (EXTENSIBLE_OPTION,) if rigid else ())
    if not taut:
        return PathEnding(said)
    end = float(path.drive[-1])
    where = solution.describe_motion(float(solution.motion[-1])) if kept else drive_text(solution.assembly, end)
    reason = f"the beams are taut at {where} ({', '.join(taut)}), and inextensible beams cannot follow"
    return PathEnding(f"{reason}: allow stretching ('mechanism.axial: true')", (EXTENSIBLE_OPTION,))


def _list_blocking_keys(solution: Solution) -> str:
    """Return the keys that may keep a mechanism from having a first pose."""
    spec = solution.spec
    mechanism = spec.mechanism
    moved = [f"mechanism.nodes.{name}.moved" for name, node in mechanism.nodes.items() if node.moved is not None]
    acting = [f"mechanism.{what}" for what in ("loads", "springs") if getattr(mechanism, what)]
    keys = [*moved, *acting] or ["mechanism.drive", *(f"mechanism.nodes.{name}.support" for name in mechanism.nodes)]
    said = f"check {', '.join(keys)}"
    if spec.fidelity != "inextensible":
        return said
    along, tied = list(_find_along_drive(spec)), _find_over_determined(solution)
    if tied and not set(tied) <= set(along):
        reported = f"inextensible beams between places that do not move ({', '.join(tied)}) hold the network rigid"
        return f"{said}; {reported}: leave one out, or set 'mechanism.axial: true'"
    if along:
        held = f"inextensible beams lie straight along the drive ({', '.join(along)})"
        return f"{said}; {held}: let them stretch by 'mechanism.axial: true'"
    return f"{said}; beams are inextensible: 'mechanism.axial: true' lets them stretch"


def _find_over_determined(solution: Solution) -> list[str]:
    """Return the beams whose forces equilibrium leaves open before any load: the network is held by more than it needs.

    They are what the null vectors of the tangent have, where these move nothing.
    """
    arrays = discretise(solution.path.network, solution.path.load_case)
    arrays = make_inextensible(arrays, np.flatnonzero(arrays.floored))
    tangent = equations(arrays).linearise(np.zeros(len(arrays.free)), 0.0).tangent
    _, sizes, rows = np.linalg.svd(tangent)
    null = np.zeros((len(rows), arrays.size))
    null[:, arrays.free] = rows
    null = null[sizes <= _SINGULAR_RTOL * sizes[0]]
    if not len(null) or np.abs(null[:, : arrays.n_motions]).max(initial=0.0) > _MOTION_TOL:
        return []
    forces = np.abs(null[:, arrays.elements.unknowns[:, -2:]]).max(axis=(0, 2))
    names = [name for name, force in zip(arrays.elements.beam, forces.tolist(), strict=True) if force > _MOTION_TOL]
    return list(dict.fromkeys(names))


_SINGULAR_RTOL, _MOTION_TOL = 1e-10, 1e-6  # of the largest singular value; motion or force of a null vector of length 1


def _find_along_drive(spec: BeamSpec) -> Iterator[str]:
    """Yield the straight beams whose ends lie one behind the other as seen along a force or a displacement."""
    mechanism = spec.mechanism
    direction = getattr(mechanism.drive, "direction", None)
    if direction is None:
        return
    for name, beam in mechanism.beams.items():
        chord = np.subtract(mechanism.nodes[beam.end].at, mechanism.nodes[beam.start].at)
        across = abs(chord @ (-np.sin(direction), np.cos(direction)))
        if beam.shape.is_straight and across <= _PARALLEL_RTOL * np.hypot(*chord):
            yield name
