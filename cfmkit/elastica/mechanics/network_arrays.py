"""Numbers of networks of one topology as arrays with a leading axis: tables of elements, attachments, held unknowns.

Networks differ in places of nodes, offsets, shapes, sections, supports, springs and loads. Beams that are plain
(`cfmkit.elastica.model.beam_fits`: a polynomial angle, one thickness) are set up together.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.elements import element_tables
from cfmkit.elastica.model.drive import FRAME_OF_DRIVE
from cfmkit.elastica.model.network import LineLoad

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.elements import MechanicsUnits
    from cfmkit.elastica.mechanics.numbering import Numbering
    from cfmkit.elastica.model.beam_fits import BeamFits
    from cfmkit.elastica.model.drive import Drive, DrivenNode
    from cfmkit.elastica.model.network import Network

    Loaded = tuple[Network, Drive]


class NetworkArrays(NamedTuple):
    """Arrays of d networks: `tables` are those of `BeamElements`, `places` origin, arm and frame of `Attachments`."""

    tables: dict[str, Any]  # (d, e, ...)
    places: dict[str, Any]  # (d, k, 2)
    held: list[dict[int, Any]]  # (d): values of unknowns by their numbers


def fill_arrays(
    numbering: Numbering,
    scales: MechanicsUnits,
    cuts: FloatArray,  # (e, 2)
    pairs: Sequence[Loaded],
    fits: Sequence[BeamFits],  # of their beams
    driven: DrivenNode | None,  # of all of them
) -> NetworkArrays:
    """Return the arrays of d networks of one topology in which they differ."""
    n, length, bundle, numbers = numbering, scales.length, fits[0].bundle, [fit.number for fit in fits]
    tables = element_tables(fits, scales, n.topology.degree, n.row, cuts)
    spots = bundle.spots[numbers]
    masters = spots[:, n.master]
    places = {"origin": masters / length, "arm": (spots[:, n.node] - masters) / length}
    if bundle.offsets is not None:
        offsets = bundle.offsets[numbers] / length
        places["arm"] = places["arm"].astype(np.result_type(places["arm"], offsets))
        places["arm"][:, n.beam_ends] += offsets
    if n.inside.size:
        _place_inside(n, tables, places)
    frames, held = _hold_bodies(n, pairs, driven, length)
    places["frame"] = np.array(frames)
    tables["line"], tables["gap"] = _line_loads(n, scales, pairs), np.zeros((len(pairs), len(n.row), 2))
    raw = [beam.closure == "raw" for beam in pairs[0][0].beams.values()]
    if any(raw):
        tables["gap"] = _prestress_gaps(n, tables, places, np.array(raw)[n.row] & (cuts[:, 1] == 1.0))
    return NetworkArrays(tables, places, held)


def _chords(tables: dict[str, Any]) -> Any:
    """Return the vectors between the ends of elements at rest, (d, e, 2)."""
    return np.stack([(tables["weight"] * turn(tables["angle"])).sum(axis=-1) for turn in (np.cos, np.sin)], axis=-1)


def _place_inside(n: Numbering, tables: dict[str, Any], places: dict[str, Any]) -> None:
    """Let attachments inside beams, which are bodies of their own, lie where the elements before them end."""
    ahead, arm, origin = _chords(tables), places["arm"], places["origin"]
    places["origin"] = origin = origin.astype(np.result_type(origin, arm, ahead))
    for beam, first in enumerate(n.beam_ends[:, 0]):
        inner = np.flatnonzero(n.row == beam)[:-1]
        start = (origin[:, first] + arm[:, first])[:, None]
        origin[:, n.ends[inner, 1]] = start + np.cumsum(ahead[:, inner], axis=1)


@lru_cache(maxsize=128)
def frame_of(n: Numbering, *angles: Any) -> Any:
    """Return cosine and sine of the angles of bodies at rest, (k, 2), by the directions of the nodes' supports."""
    angle = np.array(angles)[n.master] + 0.0
    angle[n.inside] = 0.0
    both = np.empty((*angle.shape, 2), angle.dtype)
    both[:, 0], both[:, 1] = np.cos(angle), np.sin(angle)
    return both


def _line_loads(n: Numbering, scales: MechanicsUnits, pairs: Sequence[Loaded]) -> Any:
    """Return the line loads of every element, constant and growing with the drive, (d, e, 2, 2)."""
    if not any(isinstance(load, LineLoad) for on in pairs[0] for load in on.loads):
        return np.zeros((len(pairs), len(n.row), 2, 2))
    lines = [(d, grows, load) for d, pair in enumerate(pairs) for grows, on in enumerate(pair) for load in on.loads]
    loads = [(d, grows, load) for d, grows, load in lines if isinstance(load, LineLoad)]
    kinds = {type(value) for _, _, load in loads for value in (load.wx, load.wy)}
    total = np.zeros((len(pairs), len(n.row), 2, 2), np.result_type(float, *kinds))
    for d, grows, load in loads:
        loaded = n.row == list(pairs[d][0].beams).index(load.beam)
        values = np.array([load.wx, load.wy]) * (scales.length / scales.force)
        total[d, loaded, grows] += values * scales.drive if grows else values
    return total


def _prestress_gaps(n: Numbering, tables: dict[str, Any], places: dict[str, Any], last: Any) -> Any:
    """Return by how much the last elements of beams that are forced into place miss their nodes, (d, e, 2)."""
    place = places["origin"] + places["arm"]
    span = place[:, n.ends[:, 1]] - place[:, n.ends[:, 0]]
    return np.where(last[:, None], span - _chords(tables), 0.0)


def _hold_bodies(
    n: Numbering, pairs: Sequence[Loaded], driven: DrivenNode | None, length: float
) -> tuple[list[Any], list[dict[int, Any]]]:
    """Return the frames of the attachments, and the unknowns that supports and the drive hold, and where, of each.

    What networks have in common is found once.
    """
    turned = driven.node if driven is not None and driven.motion == FRAME_OF_DRIVE else None
    frames, values, before = list[Any](), list[dict[int, Any]](), None
    for network, drive in pairs:
        nodes = network.nodes
        directions = [nodes[name].support for name in nodes], drive.direction if turned else 0.0  # type: ignore[union-attr]
        if directions != before:
            frame = frame_of(n, *(directions[1] if name == turned else nodes[name].support.direction for name in nodes))
            held, before = dict[int, Any](), directions
            for name, (along, across, rotation) in n.bodies.items():
                support = nodes[name].support
                if support.along:
                    held[along] = support.displacement[0] / length
                if support.across:
                    held[across] = support.displacement[1] / length
                if support.rotation:
                    held[rotation] = support.displacement[2]
            if driven is not None:
                held[n.bodies[driven.node][driven.motion % FRAME_OF_DRIVE]] = 0.0
        frames.append(frame)
        values.append(held)
    return frames, values


def join_held(held: list[dict[int, Any]], size: int) -> Any:
    """Return the values of held unknowns of d networks, (d, size); zero where nothing is held."""
    values = np.array([list(values_held.values()) for values_held in held]).reshape(len(held), -1)
    base = np.zeros((len(held), size), np.result_type(float, values.dtype))
    base[:, list(held[0])] = values
    return base
