"""How the beams of a network are fitted between their nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.model.beam import fit
from cfmkit.elastica.model.plain_beams_at_once import Bundle

if TYPE_CHECKING:
    from cfmkit.elastica.model.beam import Fit
    from cfmkit.elastica.model.network import Network


def beam_end_at(network: Network, name: str, side: int) -> tuple[Any, Any]:
    """Return where the first (0) or the last (1) end of a beam is before any load [m]."""
    beam = network.beams[name]
    node = network.nodes[(beam.start, beam.end)[side]]
    offset = (beam.start_offset, beam.end_offset)[side]
    return node.x + offset[0], node.y + offset[1]


def bundle_of(network: Network) -> Bundle:
    """Return the beams of a network; plain ones are fitted together."""
    ends = np.array([beam_end_at(network, name, side) for name in network.beams for side in (0, 1)])
    return Bundle(network, ends, np.arange(len(ends)).reshape(-1, 2))


def fits_of(network: Network, bundle: Bundle | None = None) -> dict[str, Fit]:
    """Return how each beam is fitted between its nodes, by its name; `bundle`: its plain ones, if they are known."""
    bundle = bundle_of(network) if bundle is None else bundle
    found = {}
    for name, beam in network.beams.items():
        own = bundle.fit_of(name)
        if own is None:
            (xa, ya), (xb, yb) = (beam_end_at(network, name, side) for side in (0, 1))
            own = fit(beam, (xb - xa, yb - ya))
        found[name] = own
    return found
