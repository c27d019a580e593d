"""Stages in series: each stands, with its supports, on the moving part of the one before [Lan, Fig. 15].

The stages carry the same force and add their displacements. All of them are in the network, so that a stack in which
one stage snaps ahead of the others is found like any other bifurcation.

Reference
---------
[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from cfmkit.elastica.model.network import FREE, Link, Network, Node

if TYPE_CHECKING:
    from cfmkit.elastica.model.beam import Beam

_ROOM = 1.15  # of the pitch that is chosen, for what joins the stages


def stacked(network: Network, driven: str, count: int, pitch: float | None = None) -> tuple[Network, str]:
    """Return `count` equal stages in series, and the moving part of the last.

    Parameters
    ----------
    network : Network
        One stage, of beams and links; all supports but that of `driven` are clamped.
    driven : str
        Its moving part.
    count : int
        Number of stages; those after the first have names with ``.2``, ``.3``, ...
    pitch : float, optional
        Distance of the stages along the way of the moving part [m].
    """
    nodes, beams, links = dict(network.nodes), dict(network.beams), list(network.links)
    dx, dy = _step(network, driven, pitch)
    for stage in range(2, count + 1):
        below = _named(driven, stage - 1)
        for name, node in network.nodes.items():
            clamped = node.support.along and name != driven
            moved = Node(node.x + (stage - 1) * dx, node.y + (stage - 1) * dy, FREE if clamped else node.support)
            nodes[_named(name, stage)] = moved
            if clamped:
                links.append(Link(below, _named(name, stage)))
        for name, beam in network.beams.items():
            beams[_named(name, stage)] = _moved(beam, stage)
        links += [Link(_named(link.master, stage), _named(link.node, stage)) for link in network.links]
    return Network(nodes, beams, tuple(links)), _named(driven, count)


def _named(name: str, stage: int) -> str:
    return name if stage == 1 else f"{name}.{stage}"


def _moved(beam: Beam, stage: int) -> Beam:
    return replace(beam, start=_named(beam.start, stage), end=_named(beam.end, stage))


def _step(network: Network, driven: str, pitch: float | None) -> tuple[float, float]:
    """Return the vector from one stage to the next: along the way of the moving part, away from the supports."""
    top = network.nodes[driven]
    c, s = math.cos(top.support.direction), math.sin(top.support.direction)
    grounds = [node for name, node in network.nodes.items() if node.support.along and name != driven]
    ahead = [(top.x - node.x) * c + (top.y - node.y) * s for node in grounds]
    mean = sum(ahead) / len(ahead) if ahead else 0.0
    size = math.copysign(_ROOM * max(map(abs, ahead), default=0.0) if pitch is None else pitch, mean)
    return size * c, size * s
