"""Solution of m slider-cranks with springs at once: curves, equilibria, stability, bistability class, constant band.

Specifications and assembled linkages go in. Each mechanism is a row of every array, (m, 1) or (m, n); what all have in
common (the motion, or efforts of unit springs along it) is one row, (1, n), and is broadcast. An analysis has m = 1.

Equilibria, turning points and bands are searched on a fine grid, cut into monotonic pieces, and refined on the closed
form, so that they do not depend on the points of the curve.

Places of the motion: `start` is the unloaded position; `rest`, where all springs are relaxed, is the same or none;
`stretched_motion` is the nearest with crank and coupler in line; around `reference` the band is measured, of effort
`level`.

[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 3, 4.2 and 6.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.arrays import Named, Several, ShortRepr
from cfmkit.families.largest_next_to_samples import finite_samples
from cfmkit.families.rows import PlacesKept, rows_of, stack
from cfmkit.families.slider_crank.springs.bistability_class import (
    CLASS_NAMES,
    StabilityClasses,
    classify,
    find_effort_signs,
    scale_factors,
)
from cfmkit.families.slider_crank.springs.friction import FrictionBranch, branch
from cfmkit.families.slider_crank.springs.largest_turns_and_forces import MotionExtremes
from cfmkit.families.slider_crank.springs.sprung_linkage import reactions, reference_motion, window_of
from cfmkit.metrics.continuous_means_and_extremes import extremes
from cfmkit.metrics.curve_rows import CurveRows, RowSamples
from cfmkit.numerics.roots import last_places
from cfmkit.numerics.sampled_extremes import Monotone, monotone
from cfmkit.results import ROUND_OFF

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Kind
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.families.slider_crank.unit_springs import UnitCurves

    Ends = tuple[FloatArray, ...]


N_GRID_PLACES = 1025
"""Places of the grid. Efforts between them are cubics; a class changes within 1e-9 of the exact value of a rate."""
MOTION_RTOL = 1e-9  # an equilibrium so near to the unloaded position, as a share of the motion, is that position
NEXT_TO_START = 1e-9
"""Share of the motion after its start at which forces with friction are computed: they are 0/0 at a stretched start."""
BAND_EDGE_FACTOR = 1.0 + 1e-9  # an effort on the edge of a band is inside it, whatever the last bits say
NO_LEVEL = 1e-9
"""Share of the largest effort up to which the effort at the reference is rounding, and there is no band around it."""


def target_of(spec: SliderCrankSpec) -> float | None:
    """Return the effort that the design requests [N m or N]; None if it requests none for this drive."""
    if spec.design is None:
        return None
    return spec.design.torque if spec.analysis.drive == "torque" else spec.design.force


def grid_over(assembly: Assembly, low: Any, high: Any) -> FloatArray:
    """Return the places of the grid over a motion, (n,) [rad or m]; over several motions, (m, 1), (m, n)."""
    return np.asarray(low + (high - low) * assembly.spread(np.linspace(0.0, 1.0, N_GRID_PLACES)))


@dataclass(frozen=True)
class Equilibrium:
    """Place at which the mechanism stays without being held."""

    motion: float  # crank angle [rad] or slider travel [m]
    stable: bool  # whether the energy has a minimum there
    energy: float  # [J]


@dataclass(frozen=True, eq=False, repr=False)
class Solution(ShortRepr):
    """Solved mechanisms, one in each row of every array; their specifications differ in numbers only."""

    specs: tuple[SliderCrankSpec, ...]
    assemblies: tuple[Assembly, ...]
    motion: FloatArray  # (m, n), or (1, n) for all: crank angle [rad] or slider travel [m], increasing
    low: FloatArray  # (m, 1) or (1, 1), ends of the motion [rad or m]
    high: FloatArray

    def __len__(self) -> int:
        """Return the number of mechanisms."""
        return len(self.specs)

    def column(self, read: Callable[[Assembly], float | None]) -> FloatArray:
        """Return a number of each assembly, (m, 1); NaN for None."""
        return np.array([[read(assembly)] for assembly in self.assemblies], dtype=float)

    def settings(self, read: Callable[[SliderCrankSpec], Any]) -> FloatArray:
        """Return a number of each specification, (m, 1); NaN for None."""
        return np.array([[read(spec)] for spec in self.specs], dtype=float)

    def broadcast(self, values: Any) -> Any:
        """Return values of one row, or of each, (1, ...) or (m, ...), as (m, ...)."""
        return np.broadcast_to(values, (len(self), *np.shape(values)[1:]))

    # --- values of the first mechanism --------------------------------------------------------------------------------

    @property
    def spec(self) -> SliderCrankSpec:
        """Its specification; words and numbers of points are the same in all rows."""
        return self.specs[0]

    @property
    def drive(self) -> Kind:
        """Kind of the motion: the crank's angle (``torque``) or the slider's travel (``force``)."""
        return self.assemblies[0].drive

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of its motion [rad or m]."""
        return float(self.low[0, 0]), float(self.high[0, 0])

    @property
    def equilibria(self) -> tuple[Equilibrium, ...]:
        """All its equilibria in the motion, in order; those at its ends and the unloaded position included."""
        rows, places, stable, energy = self.all_equilibria
        columns = [column[rows == 0].tolist() for column in (places, stable, energy)]
        return tuple(Equilibrium(*values) for values in zip(*columns, strict=True))

    @property
    def class_name(self) -> str:
        """Its bistability class in words."""
        return CLASS_NAMES[int(self.stability_classes.kind[0])]

    def nearest_of_one(self, stable: bool) -> Equilibrium | None:
        """Return its equilibrium next to the unloaded position, of one kind; None if there is none."""
        place, energy = (float(column[0]) for column in self.nearest(stable))
        return None if np.isnan(place) else Equilibrium(place, stable, energy)

    # --- numbers of each mechanism, (m, 1) ----------------------------------------------------------------------------

    @cached_property
    def assembly(self) -> Assembly:
        """The mechanisms as rows."""
        return stack(self.assemblies)

    @cached_property
    def legs(self) -> FloatArray:
        """Number of legs that share the efforts."""
        return self.settings(lambda spec: spec.mechanism.sets)

    @cached_property
    def rest(self) -> FloatArray:
        """Place at which all springs are relaxed; NaN if the motion has none."""
        return self.column(lambda assembly: assembly.rest)

    @cached_property
    def start(self) -> FloatArray:
        """The motion in the unloaded position."""
        return self.column(lambda assembly: assembly.start)

    @cached_property
    def stretched_motion(self) -> FloatArray:
        """The motion in the stretched position nearest to the unloaded one."""
        return self.column(lambda assembly: assembly.stretched_motion)

    @cached_property
    def reference(self) -> FloatArray:
        """Place at which the constant band is taken."""
        pairs = zip(self.specs, self.assemblies, strict=True)
        return np.array([[reference_motion(spec, assembly)] for spec, assembly in pairs])

    @cached_property
    def tolerance(self) -> FloatArray:
        """Half width of a band that counts as constant, as a fraction."""
        return self.settings(lambda spec: spec.analysis.tolerance)

    @cached_property
    def target(self) -> FloatArray:
        """Requested effort [N m or N]; NaN if nothing is stated."""
        return self.settings(target_of)

    @cached_property
    def window(self) -> Ends | None:
        """Window in which the effort is to be constant; None if the analysis does not state it."""
        if self.spec.analysis.window is None:
            return None
        windows = np.array([window_of(*pair) for pair in zip(self.specs, self.assemblies, strict=True)], dtype=float)
        return Several((windows[:, :1], windows[:, 1:]))

    @property
    def window_or_motion(self) -> Ends:
        """The window, else all of the motion."""
        return self.window or Several((self.low, self.high))

    # --- curves, (m, n) -----------------------------------------------------------------------------------------------

    @cached_property
    def unit_spring_curves(self) -> UnitCurves:
        """Turns, efforts and stiffnesses of springs of rate 1, and positions of the links, along the motion."""
        return self._units_at(self.motion)

    @cached_property
    def unit_efforts(self) -> FloatArray:
        """Efforts of `unit_spring_curves` alone, (4, m, n)."""
        return self.assembly.forces(self.motion)

    @cached_property
    def spring_efforts(self) -> FloatArray:
        """Effort of each spring, (4, m, n) [N m or N]."""
        return self.assembly.weigh(self.unit_efforts)

    @cached_property
    def effort(self) -> FloatArray:
        """Torque [N m] or force [N], without friction."""
        return np.asarray(self.broadcast(self.assembly.total(self.unit_efforts)))

    @cached_property
    def stiffness(self) -> FloatArray:
        """Derivative of the effort by the motion [N m/rad or N/m]."""
        return self.assembly.total(self.unit_spring_curves.stiffness)

    @cached_property
    def energy(self) -> FloatArray:
        """Energy in all springs [J]."""
        return 0.5 * self.assembly.total(self.unit_spring_curves.turn**2)

    @cached_property
    def effort_error(self) -> FloatArray:
        """Rounding of the sum of the springs' efforts, (m,) [N m or N]."""
        sizes = np.abs(self.spring_efforts).sum(axis=0)
        return np.asarray(self.broadcast(ROUND_OFF * sizes.max(axis=1, initial=0.0, where=np.isfinite(sizes))))

    @cached_property
    def friction_branches(self) -> tuple[FrictionBranch, FrictionBranch] | None:
        """The curves with friction, forth and back; None if nothing rubs."""
        if not self.assemblies[0].rubbing.is_present:
            return None
        units = self.unit_spring_curves
        return branch(self.assembly, units, 1.0), branch(self.assembly, units, -1.0)

    @cached_property
    def _units_at(self) -> PlacesKept[UnitCurves]:
        return PlacesKept(self.assembly.units)

    @cached_property
    def reactions(self) -> Ends:
        """Tension in the coupler of one leg, and force of its slider on the guide [N]."""
        driven = self.effort if self.drive == "force" else np.zeros_like(self.effort)
        coupler, guide = reactions(self.assembly, self.unit_spring_curves, driven)
        return Several((coupler / self.legs, (0.0 if self._is_mirrored else 1.0) * guide / self.legs))

    @property
    def _is_mirrored(self) -> bool:
        return self.assemblies[0].rubbing.mirrored

    # --- efforts at any place -----------------------------------------------------------------------------------------

    def effort_at(self, places: FloatArray, rows: Any = None, name: str = "load") -> FloatArray:
        """Return the effort of a branch at places of each mechanism, or of some, (k, n) [N m or N]."""
        if places is self.curve.place and name == "load" and self.friction_branches is None:
            return self.curve.value
        assembly = self.assembly if rows is None else rows_of(self.assembly, rows)
        if self.friction_branches is not None:
            units = self._units_at(places) if rows is None else assembly.units(places)
            return branch(assembly, units, -1.0 if name == "unload" else 1.0).effort
        return assembly.efforts(places)

    def frictionless(self, place: FloatArray) -> FloatArray:
        """Return the effort without friction at one place of each mechanism, (m, 1), (m,) [N m or N]."""
        return np.asarray(self.broadcast(self.assembly.efforts(place))[:, 0])

    def part_efforts(self, places: FloatArray) -> FloatArray:
        """Return the largest effort of one spring of one leg at places of each mechanism, (m, n) [N m or N]."""
        return np.asarray(np.abs(self.assembly.weigh(self.assembly.forces(places))).max(axis=0) / self.legs)

    @cached_property
    def curve(self) -> Monotone:
        """The effort on the grid and at its turning points: (m, k), without friction."""
        grid = grid_over(self.assembly, self.low, self.high)
        units = self.assembly.units(grid)
        effort = self.broadcast(self.assembly.total(units.effort))
        slope = self.broadcast(self.assembly.total(units.stiffness))
        if not np.isfinite(effort).all():
            slope = finite_samples(slope, effort, N_GRID_PLACES - 1)[0]
            grid, effort, end = finite_samples(grid, effort, N_GRID_PLACES - 1)
            grid, effort, slope = (column[:, : int(end.max()) + 1] for column in (grid, effort, slope))
        return monotone(grid, effort, slope, self.assembly.efforts)

    @cached_property
    def stability_classes(self) -> StabilityClasses:
        """Classes, drops and numbers of equilibria."""
        return classify(self.curve, self.start, self.rest, self.tolerance, self.window)

    @cached_property
    def all_equilibria(self) -> tuple[NDArray[Any], ...]:
        """Row, place, stability and energy of every equilibrium, (k,) each, in order."""
        place, sign, rest = self.curve.place, find_effort_signs(self.curve, self.rest), self.rest[:, 0]
        roots = [(row, *root) for row in range(len(self)) for root in _roots(place[row], sign[row], rest[row])]
        if not roots:
            return Several((np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0, dtype=bool), np.zeros(0)))
        rows, low, high, stable = (np.array(column) for column in zip(*roots, strict=True))
        sense, assembly = np.where(stable, 1.0, -1.0)[:, None], rows_of(self.assembly, rows)
        size = np.abs(self.curve.value).max(axis=1)[rows, None]

        def excess(at: FloatArray, few: NDArray[np.intp]) -> FloatArray:
            return np.asarray(sense[few] * rows_of(assembly, few).efforts(at) / size[few])

        root = last_places(excess, low[:, None], high[:, None])[:, 0]
        width = np.broadcast_to((self.high - self.low)[:, 0], len(self))[rows]
        root = np.where((low != high) & (np.abs(root - rest[rows]) <= MOTION_RTOL * width), rest[rows], root)
        is_known = np.isfinite(root)
        energy = 0.5 * assembly.total(assembly.units(root[:, None]).turn ** 2)[:, 0]
        return Several((rows[is_known], root[is_known], stable[is_known], np.broadcast_to(energy, len(root))[is_known]))

    def nearest(self, stable: bool) -> Ends:
        """Return place and energy of the equilibrium next to the unloaded position, of one kind, (m,); NaN: none."""
        rows, places, kinds, energies = self.all_equilibria
        place, energy = np.full((2, len(self)), np.nan)
        away = np.abs(places - self.start[rows, 0])
        for k in np.argsort(away, kind="stable")[::-1]:  # the nearest one last
            if kinds[k] == stable and away[k] > 0.0:
                place[rows[k]], energy[rows[k]] = places[k], energies[k]
        return place, energy

    @cached_property
    def level(self) -> FloatArray:
        """Effort at the reference, (m,) [N m or N]; NaN where the motion does not reach it."""
        inside = (self.low <= self.reference) & (self.reference <= self.high)
        return np.where(inside[:, 0], self.frictionless(self.reference), np.nan)

    @cached_property
    def has_level(self) -> NDArray[np.bool_]:
        """Whether the effort at the reference is more than rounding, (m,): else there is no band around it."""
        return np.asarray(np.abs(self.level) > NO_LEVEL * np.abs(self.curve.value).max(axis=1))

    @cached_property
    def band(self) -> Ends:
        """From where to where the effort is within the tolerance of that at the reference, (m,) each.

        NaN where that effort is zero, or the reference outside the motion.
        """
        place, value, has_level = self.curve.place, self.curve.value, self.has_level
        level, limit = np.where(has_level, self.level, 1.0)[:, None], self.tolerance * BAND_EDGE_FACTOR
        outside, inner, beyond = np.abs(value / level - 1.0) > limit, [], []
        for sign in (-1.0, 1.0):  # towards the low end, and towards the high one
            ahead, start = sign * place, sign * self.reference
            first = np.where(outside & (ahead > start), ahead, np.inf).min(axis=1, keepdims=True)
            before = np.maximum(np.where(ahead < first, ahead, -np.inf).max(axis=1, keepdims=True), start)
            inner.append(sign * before)
            beyond.append(sign * np.where(np.isfinite(first), first, before))

        def excess(at: FloatArray, ends: NDArray[np.intp]) -> FloatArray:
            rows = ends // 2
            return np.asarray(np.abs(rows_of(self.assembly, rows).efforts(at) / level[rows] - 1.0) - limit[rows])

        low, high = last_places(excess, np.hstack(inner), np.hstack(beyond)).T
        return Several((np.where(has_level, low, np.nan), np.where(has_level, high, np.nan)))

    # --- extremes over the motion -------------------------------------------------------------------------------------

    @cached_property
    def extremes(self) -> MotionExtremes:
        """Largest turns and energies, and the forces inside without friction."""
        return MotionExtremes(self.assembly, self.low, self.high)

    @cached_property
    def scale_factors(self) -> Ends:
        """By what factors on the torsion springs the mechanisms are no longer bistable, and positive, (m,) each."""
        return scale_factors(self.assembly, self.low, self.high)

    @cached_property
    def reaction_extremes(self) -> tuple[Ends, Ends]:
        """Largest and smallest tension in the coupler of one leg, and of its slider's force on the guide, (m,) [N].

        NaN where none is known. With friction they are those of both branches.
        """
        legs = self.legs[:, 0]
        read = partial(getattr, self.extremes) if self.friction_branches is None else self._rubbed_extremes
        coupler, guide = read("coupler"), read("guide")
        size = (0.0 if self._is_mirrored else 1.0) / legs
        return Several((coupler[0] / legs, coupler[1] / legs)), Several((size * guide[0], size * guide[1]))

    def _rubbed_extremes(self, part: Literal["coupler", "guide"]) -> Ends:
        """Return largest and smallest force [N] with friction, of all legs together; NaN if it sticks somewhere."""
        places, last = self.extremes.places.copy(), self.extremes.last
        places[:, 0] += NEXT_TO_START * (places[:, -1] - places[:, 0])
        of_ways = []
        for direction in (1.0, -1.0):

            def force(at: FloatArray, direction: float = direction) -> FloatArray:
                return np.asarray(getattr(branch(self.assembly, self._units_at(at), direction), part))

            values = force(places)
            high, low = extremes(force, places, values, uneven=True, last=np.broadcast_to(last, len(values)))
            held = ~np.isfinite(values).all(axis=1)
            of_ways.append((np.where(held, np.nan, high), np.where(held, np.nan, low)))
        return np.max([top for top, _ in of_ways], axis=0), np.min([bottom for _, bottom in of_ways], axis=0)

    # --- rows for metrics ---------------------------------------------------------------------------------------------

    @property
    def branch_efforts(self) -> Named[FloatArray]:
        """Efforts by branch, (m, n) each; with friction there are two [N m or N]."""
        if self.friction_branches is None:
            return Named({"load": self.effort})
        forth, back = (self.broadcast(curves.effort) for curves in self.friction_branches)
        return Named({"load": forth, "unload": back})

    @property
    def branches(self) -> dict[str, CurveRows]:
        """The curves by branch."""
        motion = self.broadcast(self.motion)
        full = np.full(len(self), motion.shape[1])
        return {
            name: CurveRows(
                RowSamples(motion, effort, full),
                lambda: self.curve.place,
                partial(self.effort_at, name=name),
                self.effort_error,
                self.target[:, 0],
                self.settings(lambda spec: spec.analysis.band)[:, 0],
                (motion[:, 0], motion[:, -1]),
                self.part_efforts,
                kind=self.drive,
                pose=self.reference[:, 0],
                followed=self.spec.target_curve,
            )
            for name, effort in self.branch_efforts.items()
        }


def _roots(place: FloatArray, sign: NDArray[np.int8], rest: float) -> Iterator[tuple[float, float, bool]]:
    """Yield between which places each equilibrium of a curve lies, the same ones if it is known, and if it is stable.

    At an end of the motion the unloaded position itself is meant where it is no farther than the grid.
    """
    nonzero = np.flatnonzero(sign)
    if not len(nonzero):
        return

    def choose_end(end: float, inner: float) -> float:
        return rest if abs(end - rest) <= abs(end - inner) else end

    first, last = int(nonzero[0]), int(nonzero[-1])
    if first > 0:
        at = choose_end(float(place[0]), float(place[first]))
        yield at, at, bool(sign[first] > 0)
    for k in np.flatnonzero(sign[nonzero[:-1]] != sign[nonzero[1:]]).tolist():
        before, after = int(nonzero[k]), int(nonzero[k + 1])
        low, high = float(place[before]), float(place[after])
        is_rest = low <= rest <= high and after - before > 1
        yield (rest if is_rest else low), (rest if is_rest else high), bool(sign[after] > 0)
    if last < len(place) - 1:
        at = choose_end(float(place[-1]), float(place[last]))
        yield at, at, bool(sign[last] < 0)


@dataclass(frozen=True, eq=False, repr=False)
class ClosedFormEffort(ShortRepr):
    """The effort of one mechanism at every place of its motion (a `cfmkit.results.ClosedForm`)."""

    solution: Solution

    @cached_property
    def places(self) -> FloatArray:
        """Places of a fine grid, and those of the turning points [rad or m]."""
        return np.asarray(self.solution.curve.place[0])

    @property
    def peaks(self) -> FloatArray:
        """Places that metrics add to the points of a curve: all, since few points may miss a turn of the curve."""
        return self.places

    def effort(self, name: str, places: FloatArray, /) -> FloatArray:
        """Return torque [N m] or force [N] of a branch at places of any shape."""
        whole = places.size == self.places.size and np.may_share_memory(places, self.places)  # as each metric begins
        own_places = self.solution.curve.place if whole else np.reshape(places, (1, -1))
        return self.solution.effort_at(own_places, None, name).reshape(np.shape(places))

    def stress(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return zeros: springs have no stress here."""
        return np.zeros(np.shape(places))

    def part_efforts(self, _branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest effort of one spring of one leg at places of any shape [N m or N]."""
        return self.solution.part_efforts(np.reshape(places, (1, -1))).reshape(np.shape(places))
