"""Numbers of unknowns and attachments, which networks of one topology share, and which unknowns are free.

Every node that no link moves is a body with three unknowns; so are the ends of elements inside a beam. Motions of ends
come first, then the bubbles of the elements, then their forces.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import read_only

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.elastica.model.network import Link


class Topology(NamedTuple):
    """Names and counts that the numbers depend on."""

    degree: int
    nodes: tuple[str, ...]
    links: tuple[Link, ...]
    swinging: tuple[str, ...]  # linked nodes at which arms turn with their masters
    beams: tuple[tuple[str, str, bool, bool, int], ...]  # ends, whether each is pinned, number of elements
    acting: tuple[tuple[str, ...], ...]  # nodes of each spring, then of each load
    touching: tuple[str, ...]  # nodes of contacts


@dataclass(frozen=True, eq=False)
class Numbering:
    """Unknowns and attachments of networks of one topology: k attachments, b beams, e elements."""

    topology: Topology
    bodies: Mapping[str, tuple[int, int, int]]  # unknowns of nodes that no link moves
    places: Any  # (k, 4) unknowns of the attachments
    node: Any  # (k,) number of the node that each is at; inside beams that of a master
    master: Any  # (k,) and of the node that moves that one
    beam_ends: Any  # (b, 2) attachments of the ends of the beams
    ends: Any  # (e, 2) and of the elements
    row: Any  # (e,) number of each element's beam
    inside: Any  # (i,) attachments inside beams
    acting: tuple[tuple[int, ...], ...]  # attachments of each spring, then of each load
    nodes: Mapping[str, int]  # attachment of every node
    touching: tuple[int, ...]  # attachments of contacts
    unknowns: Any  # (e, degree + 9)
    last_element: Any  # (size,) that holds an unknown, -1 if none does
    n_ends: int  # unknowns that move ends of elements
    n_motions: int  # and all motions
    size: int  # and all unknowns, but for those of contacts


@lru_cache(maxsize=128)
def number(topology: Topology) -> Numbering:
    """Return the numbers of unknowns and attachments of a topology."""
    fresh = itertools.count()
    links = {link.node: link for link in topology.links}
    bodies = {name: (next(fresh), next(fresh), next(fresh)) for name in topology.nodes if name not in links}
    turns = {name: body[2] for name, body in bodies.items()}
    node_places = dict[str, tuple[tuple[int, int, int, int], str]]()
    for name in topology.nodes:
        carrier = master = name
        while carrier in links and links[carrier].turns:
            carrier = links[carrier].master
        while master in links:
            master = links[master].master
        if carrier not in turns:
            turns[carrier] = next(fresh)
        # an arm swings with its master's body, or with the pin between the two if that carries arms of its own
        swing = turns[carrier] if carrier != master and carrier not in topology.swinging else bodies[master][2]
        node_places[name] = (*bodies[master][:2], swing, turns[carrier]), master
    places = list[tuple[tuple[int, int, int, int], str, str]]()

    def attach(name: str, pin: bool = False) -> int:
        unknowns, master = node_places[name]
        places.append(((*unknowns[:3], next(fresh)) if pin else unknowns, name, master))
        return len(places) - 1

    beam_ends, ends, inside = list[tuple[int, int]](), list[tuple[int, int]](), list[int]()
    for start, end, start_pin, end_pin, count in topology.beams:
        pair = attach(start, start_pin), attach(end, end_pin)
        inner = range(len(places), len(places) + count - 1)
        for _ in inner:
            x, y, turn = next(fresh), next(fresh), next(fresh)
            places.append(((x, y, turn, turn), node_places[start][1], node_places[start][1]))
        beam_ends.append(pair)
        ends += itertools.pairwise((pair[0], *inner, pair[1]))
        inside += inner
    acting = tuple(tuple(attach(name) for name in names) for names in topology.acting)
    nodes = {name: attach(name) for name in topology.nodes}
    touching = tuple(attach(name) for name in topology.touching)
    n_ends, count, n_bubbles = next(fresh), len(ends), topology.degree - 1
    n_motions = n_ends + count * n_bubbles
    unknowns_of_places, at, masters = zip(*places, strict=True)
    taken, pairs = np.array(unknowns_of_places), np.array(ends)
    bubbles = n_ends + np.arange(count * n_bubbles).reshape(count, -1)
    forces = n_motions + np.arange(2 * count).reshape(count, 2)
    unknowns = np.concatenate([taken[pairs[:, 0]], taken[pairs[:, 1]], bubbles, forces], axis=1)
    last = np.full(n_motions + 2 * count, -1)
    last[unknowns.ravel()] = np.repeat(np.arange(count), unknowns.shape[1])  # of several values the last stays
    whole, rank = partial(read_only, dtype=np.int64), {name: k for k, name in enumerate(topology.nodes)}
    row = np.repeat(np.arange(len(beam_ends)), [beam[-1] for beam in topology.beams])
    return Numbering(
        topology, bodies, whole(taken), whole([rank[name] for name in at]), whole([rank[name] for name in masters]),
        whole(beam_ends), whole(pairs), whole(row), whole(inside), acting, nodes, touching, whole(unknowns),
        whole(last), n_ends, n_motions, len(last),
    )  # fmt: skip


@lru_cache(maxsize=128)
def find_free(
    numbering: Numbering,  # of the network
    held: tuple[int, ...],  # unknowns that supports or the drive hold
    arms: bytes,  # of (k,) bool: attachments with an arm
    # attachments of springs, loads and contacts, whether they act on the place, and on the rotation
    acting: tuple[tuple[tuple[int, ...], bool, bool], ...],
) -> Any:
    """Return the unknowns that are not held and that anything acts on: a rotation that nothing resists is none."""
    used, unknowns, places = np.zeros(numbering.size, bool), numbering.unknowns, numbering.places
    has_arm = np.frombuffer(arms, bool)
    used[unknowns[:, [0, 1, 3, 4, 5, *range(7, unknowns.shape[1])]]] = True
    used[unknowns[:, [2, 6]][has_arm[numbering.ends]]] = True
    for at, on_place, on_rotation in acting:
        for k in at:
            used[places[k, :2]] |= on_place
            used[places[k, 2]] |= on_place and has_arm[k]
            used[places[k, 3]] |= on_rotation
    used[list(held)] = False
    return read_only(np.flatnonzero(used), np.int64)


def number_free(free: Any, size: int) -> Any:
    """Return the number of every unknown among the free ones, (size,); -1 where it is held."""
    slots = np.full(size, -1, np.int64)
    slots[free] = np.arange(len(free))
    return slots
