"""Task of a shape design (network, what may vary, window, limits), its variables and random draws, and beams' lengths.

Variables are free node coordinates and shape coefficients. Angle and length of a beam follow from its chord: a shape is
turned and scaled to fit between its nodes. So of eta = c0 + c1 u + ... only c1, c2, ... vary, and none of the closure
equations of [Lan, table 1] is a constraint. Random variables put free nodes anywhere, with beams straight or bent at
random, no chord crossing another, none too short.

[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.elastica import Network, Polynomial
from cfmkit.elastica.model.beam import fit
from cfmkit.elastica.model.beam_fits import beam_end_at
from cfmkit.elastica.model.contact import NodeOnObstacle
from cfmkit.families.beam.contacts import named_force, numbers_of, sense_of
from cfmkit.families.beam.network_from_spec import thickest_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path
    from cfmkit.elastica.sensitivity import Gradient
    from cfmkit.specs.evaluable_target_curve import TargetCurve


Objective = Literal["ripple", "range", "paper"]

BENDING_ONLY = "inextensible"  # the model of beams that bend only, as ``analysis.fidelity`` names it
STRESS_MARGIN = 2e-3
"""The search asks for so much less stress and slimmer beams: the stress peaks between its poses and places, too."""
MAX_START_ORDER = 3
"""Orders above that are for what was widened: a start in them takes longer and ends in the same families of shapes."""


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of a node that may vary, 0 for x and 1 for y, between two places [m]."""

    node: str
    axis: int
    low: float
    high: float

    @property
    def key(self) -> str:
        """Its key in a node of a network: x or y."""
        return "xy"[self.axis]


@dataclass(frozen=True)
class TaskLimits:
    """Limits that must hold; None: not asked."""

    stress: float | None = None  # largest stress at every pose [Pa]: by `STRESS_MARGIN` below the allowable one
    envelope: tuple[float, float, float, float] | None = None  # where the centre lines must lie before loading [m]
    deformed_envelope: tuple[float, float, float, float] | None = None  # the same at every pose
    length_ratio: float | None = 1.5  # largest length over distance of the ends [1]
    slenderness: float | None = 10.0  # least length over thickness [1]
    clearance: float | None = None  # least gap between the surfaces of beams, before and under load [m]
    # near a joint the gap between centre lines grows at least so fast with the way around the joint [1]
    opening: float = 0.35
    radius: float | None = None  # least radius of curvature of a centre line before loading [m]
    # force_min, force_target, force_tolerance: least mean force over the window, and a mean force to meet within a
    # share [N, N, 1]
    force_min: float | None = None
    force_target: float | None = None
    force_tolerance: float = 0.01


@dataclass(frozen=True)
class Task:
    """A network to be shaped."""

    network: Network  # as it stands: fixed nodes, sections, supports; the start where its shapes are wanted
    # driven, direction: the node that is moved, and where to [rad]
    driven: str
    direction: float
    copies: float  # forces of the mechanism are so many times those of the network
    window: tuple[float, float]  # displacements between which the force is to be constant [m]
    coordinates: tuple[Coordinate, ...]  # what may vary of the nodes
    shaped: tuple[str, ...]  # the beams whose shape may vary
    orders: tuple[int, ...] = (0, 1, 2)  # orders of the shape polynomials, from coarse to fine
    coefficient_limit: float = 0.5 * np.pi  # largest coefficient [rad]
    limits: TaskLimits = field(default_factory=TaskLimits)  # what must hold
    # "ripple": flattest over the window; "range": the widest window with `half_band`; "paper": F(a)/F(b) - 1
    objective: Objective = "range"
    half_band: float = 0.025  # (max - min)/(max + min) that is to hold over the widest window [1]
    compared: tuple[float, float] | None = None  # a and b of the objective of the paper [m]
    points: int = 17  # poses in the window
    fidelity: str = BENDING_ONLY  # the model of the network, as ``analysis.fidelity`` names it
    total_stress: bool = False  # whether the axial part counts as stress, too: as in the analysis of the design
    safety_factor: float = 1.0  # yield strength over allowable stress [1]
    # how many of the network stand in series in the mechanism: its displacements are so many times as large
    layers: int = 1
    contact: str | None = None  # stop or obstacle whose force on one copy is to be constant; None: the drive's
    # force over the mechanism's displacements that is wanted, as a share of its mean in the window; None: constant
    shape: TargetCurve | None = None
    # the network with beams that bend only, which a start begins with; None if those of the network do no more
    bending_only: Network | None = None

    @property
    def first(self) -> Task:
        """The same with beams that bend only: the model in which a start begins."""
        if self.bending_only is None:
            return self
        return replace(self, network=self.bending_only, fidelity=BENDING_ONLY, total_stress=False, bending_only=None)

    @property
    def started(self) -> Task:
        """The same in the orders that starts are searched in: where windows are widened, the fine ones come after."""
        coarse = tuple(order for order in self.orders if order <= MAX_START_ORDER)
        return replace(self, orders=coarse) if coarse and self.objective == "range" else self

    @property
    def allowable_stress(self) -> float | None:
        """The stress that the analysis allows [Pa]; None if it is not limited."""
        return None if self.limits.stress is None else self.limits.stress / (1 - STRESS_MARGIN)

    def force(self, path: Path) -> FloatArray:
        """Return the force that is to be constant, of the drive or of a contact, at all points of a path, (n,) [N]."""
        return path.effort * self.copies if self.contact is None else named_force(path, self.contact)

    def force_slopes(self, slopes: Gradient) -> FloatArray:
        """Return the derivatives of that force, (p, k)."""
        if self.contact is None:
            return slopes.effort * self.copies
        numbers = numbers_of(self.network.contacts, self.contact)
        return np.asarray(sum(sense_of(self.network.contacts[k]) * slopes.contact_force(k) for k in numbers))

    @cached_property
    def size(self) -> float:
        """The unit of length: the largest distance along an axis of coordinates that do not vary, and of ranges [m].

        It does not depend on where the free nodes are: a design that is designed again comes out the same.
        """
        free = {(place.node, place.key): (place.low, place.high) for place in self.coordinates}
        spans = []
        for key in "xy":
            places = [free.get((name, key), (getattr(node, key),)) for name, node in self.network.nodes.items()]
            spans.append(np.ptp([value for some in places for value in some]))
        return float(max(spans))


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
        places = [f"{place.node}.{place.key}" for place in self.task.coordinates]
        return (*places, *(f"{beam}.c{k}" for beam in self.task.shaped for k in range(1, self.order + 1)))

    @cached_property
    def bounds(self) -> FloatArray:
        """Lowest and highest values, (k, 2)."""
        size, limit = self.task.size, self.task.coefficient_limit
        places = [(place.low / size, place.high / size) for place in self.task.coordinates]
        rest = self.count - len(places)
        return np.array([*places, *([(-limit, limit)] * rest)]).reshape(-1, 2)

    def split(self, x: Any) -> tuple[Any, Any]:
        """Return the coordinates of a vector of variables, and its coefficients (shaped beams, order)."""
        places = len(self.task.coordinates)
        return x[:places], x[places:].reshape(len(self.task.shaped), self.order)

    def build(self, x: Any) -> Network:
        """Return the network of a vector of variables, which may be complex."""
        places, rows = self.split(x)
        nodes, beams = dict(self.task.network.nodes), dict(self.task.network.beams)
        for value, place in zip(places, self.task.coordinates, strict=True):
            nodes[place.node] = replace(nodes[place.node], **{place.key: value * self.task.size})
        for beam, row in zip(self.task.shaped, rows, strict=True):
            beams[beam] = replace(beams[beam], shape=Polynomial((0.0, *row)), closure="rotscale")
        return replace(self.task.network, nodes=nodes, beams=beams)

    def read(self) -> FloatArray:
        """Return the variables of the task's own network; terms above the order are dropped."""
        nodes, beams = self.task.network.nodes, self.task.network.beams
        places = [getattr(nodes[place.node], place.key) / self.task.size for place in self.task.coordinates]
        shapes = [beams[beam].shape for beam in self.task.shaped]
        coefficients = [shape.coefficients[1:] if isinstance(shape, Polynomial) else () for shape in shapes]
        rows = [((*row, *[0.0] * self.order)[: self.order]) for row in coefficients]
        return np.array([*places, *(value for row in rows for value in row)], dtype=float)

    def change_order(self, x: FloatArray, order: int) -> tuple[Variables, FloatArray]:
        """Return the variables of another order and the same shapes in them, terms above the order dropped."""
        places, rows = self.split(x)
        wider = np.zeros((len(rows), order))
        wider[:, : self.order] = rows[:, :order]
        return Variables(self.task, order), np.concatenate([places, wider.ravel()])


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
    shaped = _measure_polynomials(variables, x, network)
    return {name: shaped[name] if name in shaped else _measure_beam(variables, network, name) for name in network.beams}


def _measure_polynomials(variables: Variables, x: FloatArray, network: Network) -> dict[str, Length]:
    """Return the lengths of the beams whose shape varies: chord / |chi| with chi the mean of exp(i eta)."""
    names, order = variables.task.shaped, variables.order
    first = len(variables.task.coordinates)
    powers = _GAUSS_NODES[:, None] ** np.arange(1, order + 1)
    turn = np.exp(1j * (variables.split(x)[1] @ powers.T)) * _GAUSS_WEIGHTS
    chi, by_chi = turn.sum(axis=1), 1j * (turn @ powers)
    ratio = abs(chi)
    by_ratio = np.zeros((len(names), variables.count))
    for k, row in enumerate(np.real(np.conj(chi)[:, None] * by_chi) / ratio[:, None]):
        by_ratio[k, first + k * order : first + (k + 1) * order] = row
    reach = np.array([_reach(network, name) for name in names])
    chord = abs(reach)
    by_reach = np.array([_differentiate_reach(variables, name) for name in names]).reshape(len(names), -1)
    by_chord = np.real(np.conj(reach)[:, None] * by_reach) / chord[:, None]
    by_length = by_chord / ratio[:, None] - (chord / ratio**2)[:, None] * by_ratio
    columns = (chord / ratio).tolist(), ratio.tolist(), by_length, by_ratio
    return {name: Length(*row) for name, row in zip(names, zip(*columns, strict=True), strict=True)}


def _measure_beam(variables: Variables, network: Network, name: str) -> Length:
    """Return the length of any other beam; derivatives by complex steps of the places of its nodes."""
    beam, reach = network.beams[name], _reach(network, name)
    length = float(np.real(fit(beam, (reach.real, reach.imag)).length))
    by_reach = _differentiate_reach(variables, name)
    by_length = np.zeros(variables.count)
    for k in np.flatnonzero(by_reach):
        moved = (reach.real + 1j * _COMPLEX_STEP * by_reach[k].real, reach.imag + 1j * _COMPLEX_STEP * by_reach[k].imag)
        by_length[k] = np.imag(fit(beam, moved).length) / _COMPLEX_STEP
    chord = abs(reach)
    by_chord = np.real(np.conj(reach) * by_reach) / chord
    return Length(length, chord / length, by_length, by_chord / length - chord / length**2 * by_length)


def _ends(network: Network) -> FloatArray:
    """Return where the beams of a network begin and end, complex (beams, 2) [m]."""
    return np.array([[complex(*beam_end_at(network, name, side)) for side in (0, 1)] for name in network.beams])


def _reach(network: Network, name: str) -> complex:
    """Return the vector between the ends of a beam [m]."""
    start, end = (complex(*beam_end_at(network, name, side)) for side in (0, 1))
    return end - start


def _differentiate_reach(variables: Variables, name: str) -> FloatArray:
    """Return the derivatives of that vector by the variables, complex (k,)."""
    beam = variables.task.network.beams[name]
    out = np.zeros(variables.count, dtype=complex)
    for k, place in enumerate(variables.task.coordinates):
        out[k] = ((place.node == beam.end) - (place.node == beam.start)) * variables.task.size * 1j**place.axis
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
    network, slenderness = variables.build(x), variables.task.limits.slenderness
    ends = _ends(network)
    reach = np.abs(ends[:, 1] - ends[:, 0])
    least = _LEAST_CHORD * reach.mean()
    if slenderness is not None:
        least = slenderness * max(thickest_of(beam.section) for beam in network.beams.values())
    first, second = np.triu_indices(len(ends), 1)
    return bool((reach >= least).all() and not segments_cross(*ends[first].T, *ends[second].T).any())


_MIN_LENGTH_SHARE = 1e-6  # of the mean distance of joined nodes: shorter beams are none, and their slopes have no value


def has_vanished_beam(network: Network) -> bool:
    """Return True if the nodes of a beam coincide but for rounding, as two that are pushed into one corner do."""
    reach = np.abs(np.diff(_ends(network)))
    return bool(reach.min() <= _MIN_LENGTH_SHARE * reach.mean())


def has_pad_inside(network: Network) -> bool:
    """Return True if the pad of a node lies in an obstacle before any load."""
    return any(
        contact.outline.distance((network.nodes[contact.node].x, network.nodes[contact.node].y)).value < contact.radius
        for contact in network.contacts
        if isinstance(contact, NodeOnObstacle)
    )


def segments_cross(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> Any:
    """Return which segments a-b and c-d cross, complex places of any shapes; sharing an end is no crossing."""

    def side(start: FloatArray, end: FloatArray, place: FloatArray) -> Any:
        along, to = end - start, place - start
        return along.real * to.imag - along.imag * to.real

    return (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
