"""Beams of a network fitted between their nodes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from cfmkit.elastica.model.beam import Fit, fit
from cfmkit.elastica.model.plain_beams_at_once import Bundle

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.elastica.model.network import Network


def beam_end_at(network: Network, name: str, side: int) -> tuple[Any, Any]:
    """Return where the first (0) or the last (1) end of a beam is before any load [m]."""
    beam = network.beams[name]
    node = network.nodes[(beam.start, beam.end)[side]]
    offset = (beam.start_offset, beam.end_offset)[side]
    return node.x + offset[0], node.y + offset[1]


class BeamFits(Mapping[str, Fit]):
    """Fits of the beams between their nodes by name, made when they are requested."""

    def __init__(self, network: Network, bundle: Bundle | None = None, number: int = 0) -> None:
        """Fit the plain beams, all at once, unless that is done: the bundle has the network under a number."""
        self.network, self.bundle, self.number = network, bundle or Bundle([network]), number
        self._known: dict[str, Fit] = {}
        self.known: dict[Any, Any] = {}  # what else was found of the unloaded network, by its maker

    def __getitem__(self, name: str) -> Fit:
        """Return the fit of a beam."""
        if name not in self._known:
            (xa, ya), (xb, yb) = (beam_end_at(self.network, name, side) for side in (0, 1))
            fitted = self.bundle.fit_of(self.number, name)
            self._known[name] = fitted or fit(self.network.beams[name], (xb - xa, yb - ya))
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self.network.beams)

    def __len__(self) -> int:
        """Return the number of beams."""
        return len(self.network.beams)


def fit_networks(networks: Sequence[Network]) -> list[BeamFits]:
    """Return the fits of the beams of networks of one make-up, plain beams of all of them at once."""
    bundle = Bundle(networks)
    return [BeamFits(network, bundle, number) for number, network in enumerate(networks)]
