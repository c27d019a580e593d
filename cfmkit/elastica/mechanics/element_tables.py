"""What elements are at their Gauss points: angle, rigidity, compliances, arc length; dimensionless, (e, q) each.

Most beams have a polynomial angle and one thickness and are one element: their tables are made together. The others'
are made for all elements of a smooth part at once.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.elastica.mechanics.polynomials import basis, integrals_to_points, powers_at_points, slopes_at_points
from cfmkit.elastica.model.beam import Fit, fit
from cfmkit.elastica.model.plain_beams_at_once import Bundle
from cfmkit.elastica.model.section import Taper

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.model.network import Network

SAME_PLACE = 1e-12  # parameters of a shape that differ by less are one


class MechanicsUnits(NamedTuple):
    """Units of length [m], force [N] and the drive (m, rad or 1)."""

    length: float
    force: float
    drive: float

    @property
    def moment(self) -> float:
        """Unit of moment and energy [N m]."""
        return self.force * self.length


class BeamFits(Mapping[str, Fit]):
    """How each beam of a network is fitted between its nodes, by its name, as they are requested."""

    def __init__(self, network: Network) -> None:
        """Fit the plain beams, all at once."""
        ends = np.array(
            [
                (network.nodes[node].x + offset[0], network.nodes[node].y + offset[1])
                for beam in network.beams.values()
                for node, offset in ((beam.start, beam.start_offset), (beam.end, beam.end_offset))
            ]
        )
        self.network, self.bundle = network, Bundle(network, ends, np.arange(len(ends)).reshape(-1, 2))
        self._known = dict[str, Fit]()

    def __getitem__(self, name: str) -> Fit:
        """Return the fit of a beam."""
        if name not in self._known:
            beam = self.network.beams[name]
            start, end = self.network.nodes[beam.start], self.network.nodes[beam.end]
            dx = end.x + beam.end_offset[0] - start.x - beam.start_offset[0]
            dy = end.y + beam.end_offset[1] - start.y - beam.start_offset[1]
            self._known[name] = self.bundle.fit_of(name) or fit(beam, (dx, dy))
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self.network.beams)

    def __len__(self) -> int:
        """Return the number of beams."""
        return len(self.network.beams)


def element_tables(
    fits: BeamFits, scales: MechanicsUnits, degree: int, cuts: Mapping[str, list[float]]
) -> dict[str, Any]:
    """Return the tables of the elements between cuts of the beams, one beam after the other.

    Parameters
    ----------
    fits : BeamFits
        The beams of a network.
    scales : MechanicsUnits
        Units of the tables.
    degree : int
        Of the rotation on an element.
    cuts : mapping
        Parameters of a beam's shape between which its elements lie, ascending, by the beam's name.
    """
    beams, names = fits.network.beams, [fits.bundle.names[k] for k in fits.bundle.plain]
    wide = any(beam.section.wide for beam in beams.values())
    plain = {} if wide else {name: row for row, name in enumerate(names) if len(cuts[name]) == 2}
    together = _plain_tables(fits.bundle, scales, degree) if plain else {}
    if len(plain) == len(cuts):
        return together
    parts: list[dict[str, Any]] = []
    for name, beam in beams.items():
        if name in plain:
            parts.append({column: values[plain[name]][None] for column, values in together.items()})
        else:
            parts += _smooth_tables(beam, fits[name], scales, degree, cuts[name], wide)
    return {column: np.concatenate([part[column] for part in parts]) for column in parts[0]}


def _plain_tables(bundle: Bundle, scales: MechanicsUnits, degree: int) -> dict[str, Any]:
    """Return the tables of plain beams of one element each."""
    rule, length, force = basis(degree), scales.length, scales.force
    speed, ones = bundle.length[:, None] / length, np.ones(len(rule.places))
    axial, shear = (values[:, None] * force * ones for values in (bundle.stretch, bundle.slip))
    return {
        "angle": bundle.coefficients @ powers_at_points(degree, bundle.coefficients.shape[1]),
        "weight": speed * rule.weights,
        "rigidity": bundle.bending[:, None] / (force * length**2) / speed**2 * ones,
        "axial": axial,
        "shear": shear,
        "ahead": speed * (1 - rule.places),
        "length": speed[:, 0],
    }


def _smooth_tables(
    beam: Beam, fitted: Fit, scales: MechanicsUnits, degree: int, cuts: list[float], wide: bool
) -> Iterator[dict[str, Any]]:
    """Yield the tables of the elements in each smooth part of a beam."""
    length, force, rule = scales.length, scales.force, basis(degree)
    tapers = isinstance(beam.section.thickness, Taper)
    for begin, end in itertools.pairwise(smooth_marks(beam, fitted)):
        own = np.array([pair for pair in itertools.pairwise(cuts) if begin <= 0.5 * sum(pair) < end])
        left, width, inside = own[:, :1], own[:, 1:] - own[:, :1], 0.5 * (begin + end)
        t = left + width * rule.places
        along = (fitted.arc(t), float(np.real(fitted.arc(inside)))) if tapers else (t, inside)
        speed = fitted.speed(t, inside) * width / length + 0.0 * t
        rigidity, axial, shear = beam.section.rigidities(*along)
        angle, whole = fitted.angle(t, inside) + 0.0 * t, speed @ rule.weights
        tables = {
            "angle": angle,
            "weight": speed * rule.weights,
            "rigidity": rigidity / (force * length**2) / speed**2,
            "axial": axial * force + 0.0 * t,
            "shear": shear * force + 0.0 * t,
            "ahead": whole[:, None] - speed @ integrals_to_points(degree).T,
            "length": whole,
        }
        if wide:
            curl, hindrance = beam.section.curling(beam.section.thickness_at(*along))
            tables["rest"] = angle @ slopes_at_points(degree).T
            tables["curl"] = curl / (speed * length) ** 2
            tables["hindrance"] = hindrance + 0.0 * speed
        yield tables


def smooth_marks(beam: Beam, fitted: Fit) -> list[float]:
    """Return the parameters between which a beam is smooth."""
    marks = np.real(fitted.course.breaks).tolist()
    if isinstance(beam.section.thickness, Taper):
        stations = [float(np.real(fitted.parameter(float(s)))) for s in np.real(beam.section.stations)]
        marks = sorted({*marks, *stations})
        marks = [mark for k, mark in enumerate(marks) if k == 0 or mark - marks[k - 1] > SAME_PLACE]
    return [0.0, *marks[1:-1], 1.0]
