"""All plain beams of a network at once: shapes fitted between their ends.

Most beams have a polynomial angle and one thickness: those are computed together, as arrays over the beams, of one
network or of several of one topology. The others are fitted one by one (`cfmkit.elastica.model.beam`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.model.beam import BEAM_QUADRATURE, Fit
from cfmkit.elastica.model.section import Taper
from cfmkit.elastica.model.shapes import Polynomial, direction
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.model.section import Section


MAX_BEAM_TURN = 16.0  # turn [rad] up to which GAUSS integrates sine and cosine of the angle to about 1e-12


class Bundle:
    """The beams of a network between given ends."""

    def __init__(self, network: Network, ends: Any) -> None:
        """Fit the plain beams; `ends` (b, 2, 2) [m] has the places of their ends."""
        self.names, self.beams = list(network.beams), list(network.beams.values())
        plain = [k for k, beam in enumerate(self.beams) if is_plain(beam)]
        self.plain = plain  # beams with a polynomial angle and one thickness; `others` has the rest
        self.others = [] if len(plain) == len(self.beams) else [k for k in range(len(self.beams)) if k not in plain]
        if plain:
            self._fit_plain(ends if not self.others else ends[plain])

    def _fit_plain(self, ends: Any) -> None:
        beams = [self.beams[k] for k in self.plain]
        c = coefficients_of(beams) + 0.0
        reach = ends[:, 1] - ends[:, 0]
        distance = np.sqrt(reach[:, 0] * reach[:, 0] + reach[:, 1] * reach[:, 1])
        cx, cy = chords(c)
        own = np.sqrt(cx * cx + cy * cy)
        check_fits(beams, distance, own)
        nominal = [beam.shape.length for beam in beams]  # type: ignore[union-attr]
        first = distance
        if any(nominal):
            first = np.array([d if one is None else one for d, one in zip(distance, nominal, strict=True)])
        self.reach, self.drawn = reach, (first, cx, cy)
        rotation, self.length = fit_to_ends(cx, cy, reach)  # arc length as used (plain,) [m]
        self.scale = distance / (own * first)
        closures = [beam.closure for beam in beams]
        if "raw" in closures:
            raw = np.array([closure == "raw" for closure in closures])
            rotation, self.scale = np.where(raw, 0.0, rotation), np.where(raw, 1.0, self.scale)
            self.length = np.where(raw, first, self.length)
        self.rotation = rotation
        self.coefficients = c if c.dtype == rotation.dtype else c + 0j  # of the angle, the rotation in the first
        self.coefficients[:, 0] += rotation
        self.rigidities = rigidities_of(beams)  # (3, plain): bending, compliances of stretching and shearing

    @property
    def gap(self) -> Any:
        """Distances between the far ends of the shapes as given and their nodes, (plain,) [m]."""
        first, cx, cy = self.drawn
        return np.hypot(np.real(self.reach[:, 0] - first * cx), np.real(self.reach[:, 1] - first * cy))

    def fit_of(self, name: str) -> Fit | None:
        """Return the fit of a plain beam, None of another."""
        number = self.names.index(name)
        if number not in self.plain:
            return None
        k = self.plain.index(number)
        shape: Any = self.beams[number].shape
        chord = self.length[k] / self.scale[k]
        return Fit(self.rotation[k], self.scale[k], float(self.gap[k]), self.length[k], shape.course(chord))


def check_fits(
    beams: Sequence[Beam],  # plain ones
    # distance, own: (b,) in all: between the ends of each [m], and between those of its shape, over its length [1]
    distance: Any,
    own: Any,
) -> None:
    """Refuse beams without length, and shapes that return to their start.

    Raises InputError if one cannot be fitted.
    """
    if distance.real.min() > 0 and own.real.min() > 1e-9:
        return
    for beam, far, reach in zip(beams, np.real(distance).ravel(), np.real(own).ravel(), strict=True):
        if not far > 0:
            raise InputError(f"the ends of the beam {beam.start}-{beam.end} coincide")
        if not reach > 1e-9:
            raise InputError(f"the shape of the beam {beam.start}-{beam.end} returns to its start: it cannot be fitted")


def is_plain(beam: Beam) -> bool:
    """Return True if a beam has a polynomial angle, no coil of many turns, one thickness, and is no wide strip."""
    return not beam.section.wide and has_polynomial_angle(beam)


def has_polynomial_angle(beam: Beam) -> bool:
    """Return True if a beam has a polynomial angle, no coil of many turns, and one thickness."""
    return isinstance(beam.shape, Polynomial) and not (isinstance(beam.section.thickness, Taper) or coils(beam))


def coils(beam: Beam) -> bool:
    """Return True if the angle of a beam, a polynomial, may turn by more than `MAX_BEAM_TURN`."""
    return isinstance(beam.shape, Polynomial) and sum(map(abs, beam.shape.coefficients[1:])) > MAX_BEAM_TURN


def coefficients_of(beams: Sequence[Beam]) -> Any:
    """Return the coefficients of the angles of plain beams, (b, m)."""
    given = [beam.shape.coefficients or (0.0,) for beam in beams]  # type: ignore[union-attr]
    most = max(map(len, given))
    return np.array([(*own, *(0.0,) * (most - len(own))) for own in given])


def chords(coefficients: Any) -> tuple[Any, Any]:
    """Return the chords of shapes of length 1 with coefficients (..., b, m), x and y (..., b) each.

    Networks with complex steps, (d, b, m), are one but for these.
    """
    power, weights = powers(coefficients.shape[-1]), BEAM_QUADRATURE[1]
    if not np.iscomplexobj(coefficients):
        angle = coefficients @ power
        return np.cos(angle) @ weights, np.sin(angle) @ weights
    angle = (coefficients if coefficients.ndim == 2 else coefficients[0]).real @ power
    cos, sin = weights * np.cos(angle), weights * np.sin(angle)
    steps = 1j * coefficients.imag
    x, y = ((steps * (moment @ power.T)).sum(axis=-1) for moment in (sin, cos))
    return cos.sum(axis=-1) - x, sin.sum(axis=-1) + y


def fit_to_ends(cx: Any, cy: Any, reach: Any) -> tuple[Any, Any]:
    """Return rotations and lengths of shapes with chords that fit their ends, `reach` (..., b, 2) apart."""
    dx, dy = reach[..., 0], reach[..., 1]
    rotation = direction(dx * cx + dy * cy, dy * cx - dx * cy)
    return rotation, np.sqrt((dx * dx + dy * dy) / (cx * cx + cy * cy))


def rigidities_of(beams: Sequence[Beam]) -> Any:
    """Return bending rigidities and the compliances of stretching and shearing of plain beams, (3, b)."""
    sections = [beam.section for beam in beams]
    known = {key: _rigidities(section) for key, section in {id(each): each for each in sections}.items()}
    return np.array([known[id(section)] for section in sections]).T


def _rigidities(s: Section) -> tuple[Any, Any, Any]:
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
