"""Beams of a network fitted between their nodes: plain ones all at once, others one by one.

Most beams have a polynomial angle and one thickness: those are computed together, as arrays over the beams, of one
network or of several of one topology. The others are fitted one by one (`cfmkit.elastica.model.beam`).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.model.beam import BEAM_QUADRATURE, Fit, fit
from cfmkit.elastica.model.section import Taper
from cfmkit.elastica.model.shapes import Polynomial, direction
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.model.section import Section


NO_OFFSETS = ((0.0, 0.0), (0.0, 0.0))
SHORTEST_CHORD = 1e-9  # of a shape of length 1 that can be fitted
MAX_BEAM_TURN = 16.0  # turn [rad] up to which GAUSS integrates sine and cosine of the angle to about 1e-12


class Bundle:
    """The beams of d networks of one make-up between their ends."""

    def __init__(self, networks: Sequence[Network]) -> None:
        """Fit the plain beams."""
        rows = [list(network.beams.values()) for network in networks]
        self.names, number = list(networks[0].beams), {name: k for k, name in enumerate(networks[0].nodes)}
        # places of all nodes (d, nodes, 2) [m]
        self.spots = np.array([[(node.x, node.y) for node in network.nodes.values()] for network in networks])
        places = self.spots[:, [(number[beam.start], number[beam.end]) for beam in rows[0]]]
        offsets = [(beam.start_offset, beam.end_offset) for row in rows for beam in row]
        # offsets of both ends of all beams, (d, beams, 2, 2) [m]; None if there are none
        self.offsets = (
            np.reshape(offsets, places.shape) if any(end_offsets != NO_OFFSETS for end_offsets in offsets) else None
        )
        if self.offsets is not None:
            places = places + self.offsets
        # beams with a polynomial angle and one thickness; `others` has the rest
        self.plain = [k for k, same in enumerate(zip(*rows, strict=True)) if all(map(is_plain, same))]
        self.others = [] if len(self.plain) == len(self.names) else sorted({*range(len(self.names))} - {*self.plain})
        if self.plain:
            reach = places[:, :, 1] - places[:, :, 0]
            self._fit_plain(
                [row[k] for row in rows for k in self.plain], reach[:, self.plain] if self.others else reach
            )

    def _fit_plain(self, beams: list[Beam], reach: Any) -> None:
        shape, self.beams = reach.shape[:2], beams
        c = coefficients_of(beams).reshape(*shape, -1) + 0.0
        dx, dy, (cx, cy) = reach[..., 0], reach[..., 1], chords(c)
        far, shape_squared = dx * dx + dy * dy, cx * cx + cy * cy
        check_fits(beams, far, shape_squared)
        self.drawn = dx, dy, cx, cy, far, shape_squared
        rotation, self.length = direction(dx * cx + dy * cy, dy * cx - dx * cy), np.sqrt(far / shape_squared)
        self.raw = [beam.closure == "raw" for beam in beams]
        if any(self.raw):
            raw = np.reshape(self.raw, shape)
            rotation, self.length = np.where(raw, 0.0, rotation), np.where(raw, self.nominal, self.length)
        # of the angle (d, plain, m), the rotation of the fit included in the first; arc `length` as used (d, plain) [m]
        self.coefficients, self.rotation = c if c.dtype == rotation.dtype else c + 0j, rotation
        self.coefficients[..., 0] += rotation
        # (3, d, plain): of bending, and the compliances of stretching and shearing, as `Section.rigidities` has them
        self.rigidities = rigidities_of(beams).reshape(3, *shape)

    def rows(self, chosen: list[int]) -> tuple[Any, Any, Any]:
        """Return coefficients, length and rigidities of some of the networks."""
        if len(chosen) == len(self.length):
            return self.coefficients, self.length, self.rigidities
        return self.coefficients[chosen], self.length[chosen], self.rigidities[:, chosen]

    @cached_property
    def nominal(self) -> Any:
        """Lengths of the shapes as given, (d, plain) [m]: the distance of the ends where they have none."""
        distance = np.sqrt(self.drawn[4])
        lengths: Any = [beam.shape.length for beam in self.beams]  # type: ignore[union-attr]
        shape_lengths = [far if length is None else length for far, length in zip(distance.flat, lengths, strict=True)]
        return np.reshape(shape_lengths, distance.shape)

    def fit_of(self, number: int, name: str) -> Fit | None:
        """Return the fit of a plain beam of one of the networks, None of another."""
        beam = self.names.index(name)
        if beam not in self.plain:
            return None
        at = number, self.plain.index(beam)
        flat, length, first = number * len(self.plain) + at[1], self.length[at], self.nominal[at]
        dx, dy, cx, cy, far, shape_squared = (drawn[at] for drawn in self.drawn)
        scale = 1.0 if self.raw[flat] else np.sqrt(far) / (np.sqrt(shape_squared) * first)
        gap = float(np.hypot(np.real(dx - first * cx), np.real(dy - first * cy)))
        course = self.beams[flat].shape.course(length / scale)
        return Fit(self.rotation[at], scale, gap, length, course)


def check_fits(
    beams: Sequence[Beam],  # plain ones
    # squares, (b,) in all: of the distance of the ends of each [m], and of that in its shape, over its length
    far: Any,
    shape_squared: Any,
) -> None:
    """Refuse beams without length, and shapes that return to their start.

    Raises InputError if one cannot be fitted.
    """
    if np.count_nonzero((far.real > 0) & (shape_squared.real > SHORTEST_CHORD**2)) == far.size:
        return
    for beam, distance, chord in zip(beams, far.real.flat, shape_squared.real.flat, strict=True):
        if not distance > 0:
            raise InputError(f"the ends of the beam {beam.start}-{beam.end} coincide")
        if not chord > SHORTEST_CHORD**2:
            raise InputError(f"the shape of the beam {beam.start}-{beam.end} returns to its start: it cannot be fitted")


def is_plain(beam: Beam) -> bool:
    """Return True if a beam has a polynomial angle, no coil of many turns, one thickness, and is no wide strip."""
    return has_polynomial_angle(beam) and not beam.section.wide


def has_polynomial_angle(beam: Beam) -> bool:
    """Return True if a beam has a polynomial angle, no coil of many turns, and one thickness."""
    return isinstance(beam.shape, Polynomial) and not (isinstance(beam.section.thickness, Taper) or coils(beam))


def coils(beam: Beam) -> bool:
    """Return True if the angle of a beam, a polynomial, may turn by more than `MAX_BEAM_TURN`."""
    return isinstance(beam.shape, Polynomial) and sum(map(abs, beam.shape.coefficients[1:])) > MAX_BEAM_TURN


def coefficients_of(beams: Sequence[Beam]) -> Any:
    """Return the coefficients of the angles of plain beams, (b, m)."""
    coefficients = [beam.shape.coefficients or (0.0,) for beam in beams]  # type: ignore[union-attr]
    most = max(map(len, coefficients))
    return np.array([(*row, *(0.0,) * (most - len(row))) for row in coefficients])


def chords(coefficients: Any) -> tuple[Any, Any]:
    """Return the chords of shapes of length 1 with coefficients (d, b, m), x and y (d, b) each.

    Networks with complex steps are one but for these.
    """
    power, weights = powers(coefficients.shape[-1]), BEAM_QUADRATURE[1]
    if not np.iscomplexobj(coefficients):
        angle = coefficients @ power
        return np.cos(angle) @ weights, np.sin(angle) @ weights
    angle = coefficients[0].real @ power
    cos, sin = weights * np.cos(angle), weights * np.sin(angle)
    steps = 1j * coefficients.imag
    x, y = ((steps * (moment @ power.T)).sum(axis=-1) for moment in (sin, cos))
    return cos.sum(axis=-1) - x, sin.sum(axis=-1) + y


def rigidities_of(beams: Sequence[Beam]) -> Any:
    """Return bending rigidities and the compliances of stretching and shearing of plain beams, (3, b)."""
    sections = [beam.section for beam in beams]
    distinct = {id(section): section for section in sections}
    rigidities = {key: section_rigidities(section) for key, section in distinct.items()}
    return np.array([rigidities[id(section)] for section in sections]).T


def section_rigidities(s: Section) -> tuple[Any, Any, Any]:
    """Return bending rigidity and the compliances of stretching and shearing of a section of one thickness."""
    thickness: Any = s.thickness
    pull = s.youngs_modulus * s.width * thickness
    slip = 2 * (1 + s.poisson_ratio) / (s.shear_factor * pull) if s.shear else 0.0
    return pull * thickness * thickness / 12, s.axial / pull, slip


@lru_cache(maxsize=32)
def powers(count: int) -> Any:
    """Return the powers (count, n) of the Gauss nodes of the whole beam."""
    powers = np.vander(BEAM_QUADRATURE[0], count, increasing=True).T.copy()
    powers.setflags(write=False)
    return powers


def beam_end_at(network: Network, name: str, side: int) -> tuple[Any, Any]:
    """Return where the first (0) or the last (1) end of a beam is before any load [m]."""
    beam = network.beams[name]
    node = network.nodes[(beam.start, beam.end)[side]]
    offset = (beam.start_offset, beam.end_offset)[side]
    return node.x + offset[0], node.y + offset[1]


class BeamFits(Mapping[str, Fit]):
    """Fits of the beams between their nodes by name, made when they are requested."""

    def __init__(self, network: Network, bundle: Bundle | None = None, number: int = 0) -> None:
        """Take the plain beams from a bundle that has the network under a number, if there is one."""
        self.network, self.number = network, number
        if bundle is not None:
            self.bundle = bundle
        self._known: dict[str, Fit] = {}
        self.cache: dict[Any, Any] = {}  # objects made of the unloaded network, by their maker

    @cached_property
    def bundle(self) -> Bundle:
        """All plain beams, fitted at once."""
        return Bundle([self.network])

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
