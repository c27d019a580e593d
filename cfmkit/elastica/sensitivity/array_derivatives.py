"""How a network's arrays change with design variables: complex steps of the function that builds the network.

A variable moved by an imaginary step of 1e-30 gives derivatives that are exact to rounding, through any function
that accepts complex numbers. Only what depends on the variable is computed again.

A plain beam has a polynomial angle and one thickness (`cfmkit.elastica.model.plain_beams_at_once`). Where variables
move nodes and offsets, and change such shapes and sections, and nothing else, the changes of the fits are written out
and computed as arrays, for all variables at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.equilibrium.mesh import assemble_model, table
from cfmkit.elastica.kernels.network_array_types import TABLE_COLUMNS, DesignSlopes, in_order
from cfmkit.elastica.model.beam import GAUSS
from cfmkit.elastica.model.network_under_drive import Layout
from cfmkit.elastica.model.numbering import NOWHERE
from cfmkit.elastica.model.plain_beams_at_once import powers
from cfmkit.elastica.model.section import Taper
from cfmkit.elastica.model.shapes import Polynomial
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.equilibrium.mesh import Grid
    from cfmkit.elastica.kernels.network_array_types import DiscreteNetwork
    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network


STEP = 1e-30
"""Of a complex step: nothing is subtracted, so that its square may vanish beside one."""

_WHOLE = ("place_dof", "slot", "load_place", "load_follows", "spring_place", "spring_kind", "beam_end")
_MOVING = {
    "origin": "place_origin",
    "arm": "place_arm",
    "frame": "place_frame",
    "base": "base",
    "rate": "rate",
    "spring": "spring_value",
    "load": "load_value",
    "line": "line_load",
}
NO_OFFSET = (0.0, 0.0)  # an end without offset
_SAME = attrgetter("start", "end", "start_joint", "end_joint", "closure", "section.axial", "section.shear")


@dataclass(frozen=True, eq=False)
class PlainSlopes:
    """Derivatives by k variables for b plain beams.

    Attributes
    ----------
    layout : Layout
    origin, arm : (k, places, 2) arrays
        Of the attachments [m].
    coefficients : (k, b, m) array
        Of the angle as given, without the fit's rotation.
    sections : (k, b, 7) array
        Young's modulus, width, thickness, axial, shear, Poisson's ratio, shear factor.
    rotation, length : (k, b) arrays
        Of the fits.
    """

    layout: Layout
    origin: FloatArray
    arm: FloatArray
    coefficients: FloatArray
    sections: FloatArray
    rotation: FloatArray
    length: FloatArray

    def angle(self, beam: int, t: FloatArray) -> FloatArray:
        """Return the derivatives of a beam's angle at places, (n, k)."""
        slopes: FloatArray = np.vander(t, self.coefficients.shape[2], increasing=True) @ self.coefficients[:, beam].T
        return slopes + self.rotation[:, beam]

    def arrays(self, cut: Grid, every: bool) -> DesignSlopes:
        """Return the derivatives of the model's arrays; with `every` each beam is paired with every variable."""
        layout, count = self.layout, len(self.origin)
        beams = self.coefficients.shape[1]
        touched = self.coefficients.any(axis=2) | self.sections.any(axis=2) | (self.rotation != 0) | (self.length != 0)
        powers, shares = cut.rows(self.coefficients.shape[2], 0)
        places, rest = powers.T, self._compliances()
        change = [np.flatnonzero(touched[:, e]) for e in range(beams)]
        own = [np.arange(count)] * beams if every else change
        first = np.cumsum([0, *map(len, own)])
        rows = len(places) * TABLE_COLUMNS
        values = np.zeros(rows * int(first[-1]))
        for e, variables in enumerate(change):
            block = values[rows * first[e] : rows * first[e + 1]].reshape(len(places), TABLE_COLUMNS, -1)
            at = variables if every else slice(None)
            block[:, 0, at] = places @ self.coefficients[variables, e].T + self.rotation[variables, e]
            block[:, 1:, at] = shares[:, :, None] * rest[variables, e].T
        shifts: Any = self.origin.any(axis=2) | self.arm.any(axis=2)
        model, length = layout.plan, layout.scales.length
        dofs, loads, springs = layout.dof_count, len(model.load_place), len(model.spring_kind)
        none = np.zeros((count, dofs))
        return DesignSlopes(
            variable=np.concatenate(own),
            first=first,
            table=values,
            begin=first[:-1] * rows,
            moves=shifts.any(axis=1),
            shifts=shifts,
            touches=(touched | shifts[:, layout.beam_end].any(axis=2)).T,
            origin=self.origin / length,
            arm=self.arm / length,
            frame=np.zeros(self.origin.shape),
            base=none,
            rate=none,
            spring=np.zeros((count, springs, 5)),
            load=np.zeros((count, loads, 2, 3)),
            line=np.zeros((count, beams, 2, 2)),
        )

    def _compliances(self) -> FloatArray:
        """Return the derivatives of the length, of it times the three compliances, and of it again, (k, b, 5)."""
        bundle, scales = self.layout.bundle, self.layout.scales
        young, width, thickness, _, _, poisson, factor = bundle.sections
        by = self.sections
        stiff = by[..., 0] / young + by[..., 1] / width + by[..., 2] / thickness
        longer = self.length / bundle.length
        pull = longer - stiff
        slide = pull + by[..., 5] / (1 + poisson) - by[..., 6] / factor
        g, force = bundle.length / scales.length, scales.force
        out = np.empty((*longer.shape, 5))
        out[..., 0] = out[..., 4] = g * longer
        out[..., 1] = g * scales.rigidity / bundle.bending * (pull - 2 * by[..., 2] / thickness)
        out[..., 2] = g * force * bundle.stretch * pull
        out[..., 3] = g * force * bundle.slip * slide
        return out


def plain_slopes(layout: Layout, built: list[tuple[Network, Drive]], step: float) -> PlainSlopes | None:
    """Return the derivatives for networks with one variable each moved by an imaginary step; None if not that plain."""
    if layout.bundle.others or layout.network.springs or not built:
        return None
    usual = [_make_up(beam) for beam in layout.network.beams.values()]
    fitted = all(beam.closure == "rotscale" for beam in layout.network.beams.values())
    if not fitted or not all(_alike(layout, usual, network, drive) for network, drive in built):
        return None
    networks = [network for network, _ in built]
    where = np.array([[(node.x, node.y) for node in network.nodes.values()] for network in networks]).imag / step
    plan, bundle = layout.plan, layout.bundle
    origin = where[:, plan.place_master]
    arm = where[:, plan.place_node] - origin
    if plan.offsets:
        for place in np.flatnonzero(plan.place_offset != NOWHERE).tolist():
            arm[:, place] += _offsets(networks, *divmod(int(plan.place_offset[place]), 2)) / step
    most = bundle.coefficients.shape[1]
    shapes: list[Any] = [beam.shape for network in networks for beam in network.beams.values()]
    given = [shape.coefficients for shape in shapes]
    if any(len(c) < most for c in given):
        given = [(*c, *(0.0,) * (most - len(c))) for c in given]
    coefficients = np.array(given).reshape(len(networks), -1, most).imag / step
    sections = np.array([_sections(network) for network in networks])
    ends = origin + arm
    reach = ends[:, plan.beam_end[:, 1]] - ends[:, plan.beam_end[:, 0]]
    rotation, length = _fits(layout, coefficients, reach)
    return PlainSlopes(layout, origin, arm, coefficients, sections.imag / step, rotation, length)


def _sections(network: Network) -> list[tuple[Any, ...]]:
    """Return what `PlainSlopes.sections` has, of one network."""
    given = [beam.section for beam in network.beams.values()]
    known = {id(s): (s.youngs_modulus, s.width, s.thickness, 0.0, 0.0, s.poisson_ratio, s.shear_factor) for s in given}
    return [known[id(s)] for s in given]


def _alike(layout: Layout, usual: list[Any], network: Network, drive: Drive) -> bool:
    """Tell whether a network differs in places, coefficients and sections of rotscaled plain beams only.

    usual: `_make_up` of the layout's own beams.
    """
    base = layout.network
    if drive is not layout.drive or network.springs or network.links != base.links or network.loads != base.loads:
        return False
    if list(network.nodes) != list(base.nodes) or list(network.beams) != list(base.beams):
        return False
    supports = zip(network.nodes.values(), base.nodes.values(), strict=True)
    if not all(one.support is other.support or one.support == other.support for one, other in supports):
        return False
    beams = network.beams.values()
    return list(map(_make_up, beams)) == usual


def _make_up(beam: Beam) -> tuple[Any, ...]:
    """Return what no variable may change of a beam."""
    polynomial, taper = isinstance(beam.shape, Polynomial), isinstance(beam.section.thickness, Taper)
    return (*_SAME(beam), polynomial, taper, beam.start_offset != NO_OFFSET, beam.end_offset != NO_OFFSET)


def _offsets(networks: list[Network], beam: int, side: int) -> FloatArray:
    """Return the imaginary parts of one offset in all networks, (k, 2)."""
    found = [(b.start_offset, b.end_offset)[side] for b in (list(n.beams.values())[beam] for n in networks)]
    return np.array(found).imag


def _fits(layout: Layout, coefficients: FloatArray, reach: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of the fits' rotations and lengths, (k, b) each; reach (k, b, 2): those of the chords.

    With the fitted angle the shape of unit length ends at (distance / length) times the direction of the chord.
    """
    bundle = layout.bundle
    ends = layout.places.origin + layout.places.arm
    d = ends[layout.beam_end[:, 1]] - ends[layout.beam_end[:, 0]]
    distance = np.hypot(d[:, 0], d[:, 1])
    along = d / distance[:, None]
    v = powers(coefficients.shape[2])
    angle = bundle.coefficients @ v
    turned = np.array([-np.sin(angle), np.cos(angle)]) * GAUSS[1] @ v.T
    cx, cy = np.einsum("kbm,sbm->skb", coefficients, turned)
    longer = (reach * along).sum(axis=2)
    aside = (reach[..., 1] * along[:, 0] - reach[..., 0] * along[:, 1]) / distance
    own = distance / bundle.length
    stretch, swing = cx * along[:, 0] + cy * along[:, 1], (cy * along[:, 0] - cx * along[:, 1]) / own
    return aside - swing, bundle.length * (longer / distance - stretch / own)


def slope(value: Any) -> Any:
    """Return the derivative that the imaginary part of a complex step holds."""
    return np.imag(value) / STEP


class ComplexSteps:
    """A layout and what it becomes with each design variable."""

    def __init__(self, layout: Layout, build: Callable[[Any], Any], variables: Any) -> None:
        """Build the network with each variable in turn moved by an imaginary step.

        `build` returns a network, or a network and its drive where variables change the drive's loads or direction.
        """
        x = np.asarray(variables, dtype=float)
        self.layout, self.built = layout, []
        for k in range(len(x)):
            moved = x.astype(complex)
            moved[k] += 1j * STEP
            built = build(moved)
            self.built.append(built if isinstance(built, tuple) else (built, layout.drive))
        self.plain = plain_slopes(layout, self.built, STEP)

    def __len__(self) -> int:
        """Return the number of variables."""
        return len(self.built)

    @cached_property
    def stepped(self) -> list[Layout]:
        """The layouts with each variable in turn moved by an imaginary step."""
        found = []
        for network, drive in self.built:
            stepped = Layout(network, drive, self.layout)
            stepped.scales = self.layout.scales  # before its table is requested: that is kept in these units
            found.append(stepped)
        return found

    def arrays(self, model: DiscreteNetwork, cut: Grid, every: bool = False) -> DesignSlopes:
        """Return the derivatives of a model's arrays; with `every` each beam is paired with every variable.

        Raises
        ------
        cfmkit.errors.InputError
            If a variable changes the make-up of the network, not only its values.
        """
        if self.plain is not None:
            return in_order(self.plain.arrays(cut, every))
        stepped = [self._model(k, layout, model, cut) for k, layout in enumerate(self.stepped)]
        tables = np.stack([slope(table(layout, cut, model.table)) for layout in self.stepped], axis=-1)
        variable, first, begin, blocks = [], [0], [], []
        size = 0
        for number in range(len(self.layout.network.beams)):
            changes = tables[cut.beam_of_step == number]
            touched = changes.any(axis=(0, 1, 2)) | [bool(np.any(np.imag(one.line_load[number]))) for one in stepped]
            own = list(range(len(self))) if every else np.flatnonzero(touched).tolist()
            block = changes[..., own]
            variable += own
            first.append(len(variable))
            begin.append(size)
            size += block.size
            blocks.append(block.ravel())
        parts = {short: _stack(stepped, long, model) for short, long in _MOVING.items()}
        moves = np.zeros(len(self), dtype=np.bool_)
        for values in parts.values():
            moves |= values.reshape(len(self), -1).any(axis=1)
        held = (parts["base"] != 0) | (parts["rate"] != 0)
        shifts = held[:, model.place_dof].any(axis=2)
        for name in ("origin", "arm", "frame"):
            shifts |= parts[name].any(axis=2)
        touches = shifts[:, model.beam_end].any(axis=2).T
        for number in range(len(touches)):
            touches[number, variable[first[number] : first[number + 1]]] = True
        design = DesignSlopes(
            variable=np.array(variable, dtype=np.int64),
            first=np.array(first, dtype=np.int64),
            table=np.concatenate(blocks),
            begin=np.array(begin, dtype=np.int64),
            moves=moves,
            shifts=shifts,
            touches=touches,
            **parts,
        )
        return in_order(design)

    def _model(self, k: int, layout: Layout, model: DiscreteNetwork, cut: Grid) -> DiscreteNetwork:
        """Return the arrays for variable k, except the table."""
        stepped = assemble_model(layout, cut, model.table)
        for name in _WHOLE:
            now, was = getattr(stepped, name), getattr(model, name)
            if now.shape != was.shape or np.any(now != was):
                raise InputError(
                    f"design variable {k} changes the make-up of the network: no derivative with respect to it exists"
                )
        return stepped


def _stack(stepped: list[DiscreteNetwork], name: str, model: DiscreteNetwork) -> FloatArray:
    """Return the derivatives of one array by all variables."""
    own = np.asarray(getattr(model, name))
    return np.ascontiguousarray(
        np.array([slope(getattr(one, name)) for one in stepped]).reshape(len(stepped), *own.shape)
    )
