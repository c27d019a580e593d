"""The design variables: free node coordinates and shape coefficients, closure eliminated; lengths, and random ones.

Angle and length of a beam follow from its chord: a shape is turned and scaled to fit between its nodes. So of
eta = c0 + c1 u + ... only c1, c2, ... vary, and none of the closure equations of [Lan, table 1] is a constraint.

Random variables put free nodes anywhere, with beams straight or bent at random, no chord crossing another, none too
short.

[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica import Network, Polynomial
from cfmkit.elastica.model.beam import fit
from cfmkit.elastica.model.contact import NodeOnObstacle
from cfmkit.families.beam.network_from_spec import thickest_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.shaping.task import Task


@dataclass(frozen=True)
class Variables:
    """The vector of design variables of a task, for one order of the shapes.

    Coordinates in units of the task's size, then the coefficients c1..cm of each shaped beam in turn.
    """

    task: Task
    order: int

    @property
    def count(self) -> int:
        """Number of variables."""
        return len(self.task.coordinates) + self.order * len(self.task.shaped)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """As reports call them."""
        places = [coordinate.name for coordinate in self.task.coordinates]
        return (*places, *(f"{beam}.c{k}" for beam in self.task.shaped for k in range(1, self.order + 1)))

    @cached_property
    def bounds(self) -> FloatArray:
        """Lowest and highest values, (k, 2)."""
        size, limit = self.task.size, self.task.coefficient_limit
        places = [(coordinate.low / size, coordinate.high / size) for coordinate in self.task.coordinates]
        rest = self.count - len(places)
        return np.array([*places, *([(-limit, limit)] * rest)]).reshape(-1, 2)

    def build(self, x: Any) -> Network:
        """Return the network of a vector of variables, which may be complex."""
        network, places = self.task.network, len(self.task.coordinates)
        nodes = dict(network.nodes)
        moved: dict[str, dict[str, Any]] = {}
        for value, coordinate in zip(x[:places], self.task.coordinates, strict=True):
            moved.setdefault(coordinate.node, {})["xy"[coordinate.axis]] = value * self.task.size
        nodes |= {name: replace(nodes[name], **at) for name, at in moved.items()}
        beams = dict(network.beams)
        for beam, row in zip(self.task.shaped, x[places:].reshape(len(self.task.shaped), self.order), strict=True):
            beams[beam] = replace(beams[beam], shape=Polynomial((0.0, *row)), closure="rotscale")
        return replace(network, nodes=nodes, beams=beams)

    def read(self) -> FloatArray:
        """Return the variables of the task's own network; terms above the order are dropped."""
        nodes, beams = self.task.network.nodes, self.task.network.beams
        places = [
            (nodes[coordinate.node].x, nodes[coordinate.node].y)[coordinate.axis] / self.task.size
            for coordinate in self.task.coordinates
        ]
        rows = [self._coefficients(beams[beam].shape) for beam in self.task.shaped]
        return np.array([*places, *(value for row in rows for value in row)], dtype=float)

    def _coefficients(self, shape: Any) -> list[float]:
        coefficients = list(shape.coefficients[1:]) if isinstance(shape, Polynomial) else []
        return (coefficients + [0.0] * self.order)[: self.order]

    def change_order(self, x: FloatArray, order: int) -> tuple[Variables, FloatArray]:
        """Return the variables of another order and the same shapes in them, terms above the order dropped."""
        places = len(self.task.coordinates)
        rows = x[places:].reshape(len(self.task.shaped), self.order)[:, :order]
        wider = np.zeros((len(self.task.shaped), order))
        wider[:, : rows.shape[1]] = rows
        return Variables(self.task, order), np.concatenate([x[:places], wider.ravel()])


_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(24)
_GAUSS_NODES, _GAUSS_WEIGHTS = 0.5 * (_GAUSS_NODES + 1), 0.5 * _GAUSS_WEIGHTS
_COMPLEX_STEP = 1e-30  # of a complex step: nothing is subtracted, so that its square may vanish beside one


@dataclass(frozen=True)
class Length:
    """Arc length [m] and chord over arc length [1] of one beam, and their derivatives by the variables (k,)."""

    length: float
    straightness: float
    by_length: FloatArray
    by_straightness: FloatArray


def lengths(variables: Variables, x: FloatArray, network: Network) -> dict[str, Length]:
    """Return the lengths of all beams of the network of some variables, by name."""
    shaped = _of_polynomials(variables, x, network)
    return {name: shaped[name] if name in shaped else _of_any(variables, network, name) for name in network.beams}


def _of_polynomials(variables: Variables, x: FloatArray, network: Network) -> dict[str, Length]:
    """Return the lengths of the beams whose shape varies: chord / |chi| with chi the mean of exp(i eta)."""
    names, order = variables.task.shaped, variables.order
    first = len(variables.task.coordinates)
    powers = _GAUSS_NODES[:, None] ** np.arange(1, order + 1)
    turn = np.exp(1j * (x[first:].reshape(len(names), order) @ powers.T)) * _GAUSS_WEIGHTS
    chi, by_chi = turn.sum(axis=1), 1j * (turn @ powers)
    ratio = abs(chi)
    by_ratio = np.zeros((len(names), variables.count))
    for k, row in enumerate(np.real(np.conj(chi)[:, None] * by_chi) / ratio[:, None]):
        by_ratio[k, first + k * order : first + (k + 1) * order] = row
    reach = np.array([_reach(network, name) for name in names])
    chord = abs(reach)
    by_reach = np.array([_by_reach(variables, name) for name in names]).reshape(len(names), -1)
    by_chord = np.real(np.conj(reach)[:, None] * by_reach) / chord[:, None]
    by_length = by_chord / ratio[:, None] - (chord / ratio**2)[:, None] * by_ratio
    columns = (chord / ratio).tolist(), ratio.tolist(), by_length, by_ratio
    return {name: Length(*row) for name, row in zip(names, zip(*columns, strict=True), strict=True)}


def _of_any(variables: Variables, network: Network, name: str) -> Length:
    """Return the length of any other beam; derivatives by complex steps of the places of its nodes."""
    beam, reach = network.beams[name], _reach(network, name)
    length = float(np.real(fit(beam, (reach.real, reach.imag)).length))
    by_reach = _by_reach(variables, name)
    by_length = np.zeros(variables.count)
    for k in np.flatnonzero(by_reach):
        moved = (reach.real + 1j * _COMPLEX_STEP * by_reach[k].real, reach.imag + 1j * _COMPLEX_STEP * by_reach[k].imag)
        by_length[k] = np.imag(fit(beam, moved).length) / _COMPLEX_STEP
    chord = abs(reach)
    by_chord = np.real(np.conj(reach) * by_reach) / chord
    return Length(length, chord / length, by_length, by_chord / length - chord / length**2 * by_length)


def _reach(network: Network, name: str) -> complex:
    """Return the vector between the ends of a beam [m]."""
    beam = network.beams[name]
    start, end = network.nodes[beam.start], network.nodes[beam.end]
    return complex(end.x - start.x, end.y - start.y) + complex(*beam.end_offset) - complex(*beam.start_offset)


def _by_reach(variables: Variables, name: str) -> FloatArray:
    """Return the derivatives of that vector by the variables, complex (k,)."""
    beam = variables.task.network.beams[name]
    out = np.zeros(variables.count, dtype=complex)
    for k, coordinate in enumerate(variables.task.coordinates):
        sense = (coordinate.node == beam.end) - (coordinate.node == beam.start)
        out[k] = sense * variables.task.size * (1j if coordinate.axis else 1.0)
    return out


_MAX_DRAWS = 2000
_LEAST_CHORD = 0.1  # of the mean distance of joined nodes, if no slenderness is asked


def candidates(variables: Variables, rng: np.random.Generator) -> Iterator[FloatArray]:
    """Yield vectors of variables, coefficients up to half their limit; at most 2000 places are tried."""
    low, high = variables.bounds.T
    places = len(variables.task.coordinates)
    for _ in range(_MAX_DRAWS):
        x = rng.uniform(low, high)
        x[places:] *= 0.5
        if sound(variables, x):
            yield x


def sound(variables: Variables, x: FloatArray) -> bool:
    """Return True if the chords of the beams do not cross and are long enough."""
    network = variables.build(x)
    chords = {name: _chord(network, name) for name in network.beams}
    least = _least_chord(variables, network)
    if any(abs(b - a) < least for a, b in chords.values()):
        return False
    return not any(_cross(*chords[first], *chords[second]) for first, second in combinations(chords, 2))


def _least_chord(variables: Variables, network: Network) -> float:
    slenderness = variables.task.limits.slenderness
    if slenderness is not None:
        return slenderness * max(thickest_of(beam.section) for beam in network.beams.values())
    return _LEAST_CHORD * float(np.mean([abs(b - a) for a, b in (_chord(network, name) for name in network.beams)]))


_MIN_LENGTH_SHARE = 1e-6  # of the mean distance of joined nodes: shorter beams are none, and their slopes have no value


def has_vanished_beam(network: Network) -> bool:
    """Return True if the nodes of a beam coincide but for rounding, as two that are pushed into one corner do."""
    chords = [abs(end - start) for start, end in (_chord(network, name) for name in network.beams)]
    return min(chords) <= _MIN_LENGTH_SHARE * float(np.mean(chords))


def has_pad_inside(network: Network) -> bool:
    """Return True if the pad of a node lies in an obstacle before any load."""
    return any(
        contact.outline.distance((network.nodes[contact.node].x, network.nodes[contact.node].y)).value < contact.radius
        for contact in network.contacts
        if isinstance(contact, NodeOnObstacle)
    )


def _chord(network: Network, name: str) -> tuple[complex, complex]:
    beam = network.beams[name]
    start, end = network.nodes[beam.start], network.nodes[beam.end]
    return complex(start.x, start.y) + complex(*beam.start_offset), complex(end.x, end.y) + complex(*beam.end_offset)


def _cross(a: complex, b: complex, c: complex, d: complex) -> bool:
    """Return True if the segments a-b and c-d cross; sharing an end is no crossing."""
    if {a, b} & {c, d}:
        return False
    return _side(a, b, c) * _side(a, b, d) < 0 and _side(c, d, a) * _side(c, d, b) < 0


def _side(a: complex, b: complex, c: complex) -> float:
    return float(((b - a).conjugate() * (c - a)).imag)
