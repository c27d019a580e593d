"""The closure "chain": beams keep their shapes and lengths, and the nodes go where the beams end.

From the nodes that are held in place, each beam in the given order whose one end is placed carries its other end with
it; a beam between two nodes that are placed already is turned and scaled. A guided node is carried like a free one: its
guide goes with it, as in the reference values of Table 3.
"""

from __future__ import annotations

import cmath
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica.model.beam import fit
from cfmkit.elastica.model.network import Network

if TYPE_CHECKING:
    from cfmkit.elastica.model.beam import Beam


def chained(network: Network) -> Network:
    """Return the network with its free nodes moved to where the beams end."""
    placed = {
        name: complex(node.x, node.y)
        for name, node in network.nodes.items()
        if node.support.along and node.support.across
    }
    waiting = dict(network.beams)
    while ready := [name for name, beam in waiting.items() if beam.start in placed or beam.end in placed]:
        beam = waiting.pop(ready[0])
        chord = _own_chord(network, beam)
        if beam.end not in placed:
            placed[beam.end] = placed[beam.start] + complex(*beam.start_offset) + chord - complex(*beam.end_offset)
        elif beam.start not in placed:
            placed[beam.start] = placed[beam.end] + complex(*beam.end_offset) - chord - complex(*beam.start_offset)
    nodes = {
        name: replace(node, x=placed[name].real, y=placed[name].imag) if name in placed else node
        for name, node in network.nodes.items()
    }
    return Network(nodes, network.beams, network.links, network.springs, network.loads)


def _own_chord(network: Network, beam: Beam) -> complex:
    """Return the vector between the ends of a beam as its shape is given [m]; as fitted where it has no own length."""
    start, end = network.nodes[beam.start], network.nodes[beam.end]
    reach = complex(end.x - start.x, end.y - start.y) + complex(*beam.end_offset) - complex(*beam.start_offset)
    if getattr(beam.shape, "length", None) is None:
        return reach
    found = fit(beam, (reach.real, reach.imag))
    return reach * cmath.exp(-1j * float(np.real(found.rotation))) / float(np.real(found.scale))
