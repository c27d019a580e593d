"""Scalar results and tables of a mechanism, beside the constant-force metrics of every family."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.fem_results import DEFINITIONS as OF_SOLIDS
from cfmkit.families.fem_results import unknown_to_beams
from cfmkit.families.findings import newton
from cfmkit.families.vcfm.leaf_laws_from_spec import share_of, strip_of
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import measured_stiffness_for
from cfmkit.families.vcfm.leaves.truss import TrussDiamond, TrussLeaf
from cfmkit.results import Quantity
from cfmkit.stock.springs.stress_and_life import WIRE_DEFINITIONS, SpringInUse, wire_quantities
from cfmkit.tables import Table, TableColumn, border_column

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.families.vcfm.solution import Push, Solution


DEFINITIONS = {
    **OF_SOLIDS,
    "positive_stiffness": ("stiffness", "K_p of the spring as made"),
    "negative_stiffness": ("stiffness", "size of the leaves' negative stiffness: constant where they are buckled"),
    "first_stiffness": ("stiffness", "stiffness K_b1 of the leaves as made"),
    "rise": ("length", "h of the leaves: travel to the flat pose"),
    "slenderness": (
        "factor",
        "rise over thickness of the leaves, Q: above pi they buckle, above 3.195 they are bistable",
    ),
    "linear_start": ("length", "travel at which the leaves buckle"),
    "linear_end": ("length", "travel at which they straighten again"),
    "linear_stroke": ("length", "length of the linear negative stiffness"),
    "constant_force": (
        "force",
        "force of the spring where the leaves carry no force, K_p (h + dr) for straight leaves; none unless at least "
        "half of the window is flat at that force",
    ),
    "window_start": ("length", "start of the longest window within analysis.flatness"),
    "window_end": ("length", "end of the longest window within analysis.flatness"),
    "window_length": ("length", "length of the longest window within analysis.flatness; 0 if there is none"),
    "window_force": ("force", "mean force in the longest window within analysis.flatness"),
    "rest_position": ("length", "rest position of the shuttle at the nominal preload, from the as-made position"),
    "rest_shift_max": ("length", "largest distance of a rest position from the as-made position, over all preloads"),
    "force_change_max": ("force", "largest change of the mean force due to a preload, relative to the nominal one"),
    "adjusted_force_min": ("force", "smallest mean force over the window, of all preloads"),
    "adjusted_force_max": ("force", "largest mean force over the window, of all preloads"),
    "adjusted_ripple_max": ("ratio", "largest (max - min)/max of the force over the window, of all preloads"),
    "force_per_preload": (
        "stiffness",
        "largest change of the mean force due to a preload, over the change of the preload",
    ),
    "least_force": ("force", "smallest force beyond the peak of the leaves; positive: the shuttle returns by itself"),
    "stiffness_mismatch": (
        "ratio",
        "|K_p - K_n| times the length of the window over the force of the spring where the leaves carry none",
    ),
    "allowable_stress": ("stress", "yield strength over `mechanism.safety_factor`"),
    "spring_stress_max": ("stress", "largest stress of the spring up to the end of the window, over all preloads"),
    "bistable_stress_max": ("stress", "largest stress of the leaves up to the end of the window, over all preloads"),
    "travel_stress_max": (
        "stress",
        "largest stress of leaves and spring over the whole travel and all preloads; decisive unless a stop ends "
        "the travel at the end of the window",
    ),
    "travel_safety_factor": ("factor", "allowable stress over `travel_stress_max`"),
    "spring_deflection_max": ("length", "largest deflection of bought springs over the travel and all preloads"),
    **WIRE_DEFINITIONS,
}


def values_of(solution: Solution, run: Run) -> Mapping[str, Quantity]:
    """Return the scalar results by name, those that nobody looks at left out; None where a value does not exist."""
    numbers: dict[str, float | None] = {}
    for names, values in _GROUPS.items():
        if run.wants(names):
            numbers |= values(solution)
    error = getattr(solution.sampler, "mesh_error", None)  # known of solids only
    found = {name: _quantity(name, value) for name, value in numbers.items()} | unknown_to_beams() | _bought(solution)
    if "constant_force" in numbers and numbers["constant_force"] is None:
        found["constant_force"] = replace(found["constant_force"], reason=_why_not_constant(solution))
    return found if error is None else found | {name: _quantity(name, value) for name, value in error.values().items()}


def _of_parts(solution: Solution) -> dict[str, float | None]:
    one, strip = solution.character, solution.parts.strip
    low, high = one.linear
    return {
        "positive_stiffness": one.positive_stiffness,
        "negative_stiffness": one.negative_stiffness,
        "first_stiffness": one.first_stiffness,
        "rise": float(strip.rise),
        "slenderness": float(strip.slenderness),
        "linear_start": low,
        "linear_end": high,
        "linear_stroke": high - low if np.isfinite(high - low) else 0.0,
    }


def _of_windows(solution: Solution) -> dict[str, float | None]:
    window = solution.windows[0]
    return {
        "constant_force": solution.constant_force,
        "window_start": window[0] if window else None,
        "window_end": window[1] if window else None,
        "window_length": window[1] - window[0] if window else 0.0,
        "window_force": solution.window_force,
    }


def _of_rest(solution: Solution) -> dict[str, float | None]:
    return {
        "rest_position": solution.nominal.rest,
        "rest_shift_max": max((abs(push.rest) for push in solution.pushes if push.rest is not None), default=None),
    }


def _least_force(solution: Solution) -> dict[str, float | None]:
    return {"least_force": solution.least[1] if solution.least else None}


def _mismatch(solution: Solution) -> dict[str, float | None]:
    one, alone, span = solution.character, solution.spring_alone, solution.window[1] - solution.window[0]
    difference = abs(one.positive_stiffness - one.negative_stiffness)
    return {
        "stiffness_mismatch": difference * span / alone if alone and abs(alone) > solution.effort_error else None,
        "allowable_stress": solution.spec.mechanism.allowable_stress,
    }


def _stresses(solution: Solution) -> dict[str, float | None]:
    stresses = solution.largest_stresses(solution.pushes, (solution.window[1], np.inf))
    (leaves, spring), over_travel = stresses[:, 0].max(axis=0).tolist(), float(stresses[:, 1].max())
    allowed = solution.spec.mechanism.allowable_stress
    return {
        "spring_stress_max": spring if solution.spec.mechanism.springs is None else None,
        "bistable_stress_max": leaves,
        "travel_stress_max": over_travel,
        "travel_safety_factor": allowed / over_travel if allowed and over_travel else None,
    }


def _why_not_constant(solution: Solution) -> str:
    """Return why no single force stands for the curve."""
    if solution.spring_alone is None:
        return "the leaves carry a force where they are flat, or the spring has no constant stiffness"
    flat = solution.window_force
    found = "" if flat is None else f"; its flat part is at {newton(flat)}"
    return (
        f"where the leaves carry nothing the force is {newton(solution.spring_alone)}, but the curve is not flat "
        f"there{found}"
    )


def _bought(solution: Solution) -> dict[str, Quantity]:
    """Return what bought springs are put through between rest and the end of the travel, at the worst preload."""
    springs = solution.spec.mechanism.springs
    if springs is None:
        return {}
    fatigue = None if springs.wound is None or springs.wound.fatigue is None else springs.wound.fatigue.law
    used = []
    for push in solution.pushes:
        least, most = (springs.load(float(place) + push.preload) for place in (push.travel[0], push.travel[-1]))
        used.append(SpringInUse(springs.coil, least, most, fatigue, springs.life))
    farthest = max(float(push.travel[-1]) + push.preload for push in solution.pushes)
    return {"spring_deflection_max": _quantity("spring_deflection_max", max(farthest, 0.0))} | wire_quantities(used)


def _quantity(name: str, value: float | None) -> Quantity:
    known = value is not None and np.isfinite(value)
    return Quantity(value if known else None, *DEFINITIONS[name], reason="" if known else "there is none")


def mean_force(solution: Solution, push: Push) -> float | None:
    """Return the mean force of a curve at even places of the solution's window [N]; None if it does not cover it."""
    force = forces(solution, push)
    return float(force.mean()) if np.isfinite(force).all() else None


def _adjustment(solution: Solution) -> dict[str, float | None]:
    nominal = mean_force(solution, solution.nominal)
    changes = []
    for push in solution.pushes[1:]:
        mean = mean_force(solution, push)
        if mean is not None and nominal is not None:
            changes.append((mean - nominal, push.preload - solution.nominal.preload))
    if not changes:
        return {"force_change_max": None, "force_per_preload": None}
    change, preload = max(changes, key=lambda pair: abs(pair[0]))
    return {"force_change_max": change, "force_per_preload": change / preload}


def _at_ends(solution: Solution) -> dict[str, float | None]:
    """Return the means and the ripple of all preloads together; None where one of them has no force in the window."""
    names = "adjusted_force_min", "adjusted_force_max", "adjusted_ripple_max"
    curves = [forces(solution, push) for push in solution.pushes]
    if not all(np.isfinite(force).all() and force.max() > 0.0 for force in curves):
        return dict.fromkeys(names)
    means = [float(force.mean()) for force in curves]
    worst = max(1.0 - float(force.min() / force.max()) for force in curves)
    return dict(zip(names, (min(means), max(means), worst), strict=True))


_GROUPS: Mapping[tuple[str, ...], Callable[[Solution], dict[str, float | None]]] = {
    (
        "positive_stiffness",
        "negative_stiffness",
        "first_stiffness",
        "rise",
        "slenderness",
        "linear_start",
        "linear_end",
        "linear_stroke",
    ): _of_parts,
    ("constant_force", "window_start", "window_end", "window_length", "window_force"): _of_windows,
    ("rest_position", "rest_shift_max"): _of_rest,
    ("least_force",): _least_force,
    ("stiffness_mismatch", "allowable_stress"): _mismatch,
    ("spring_stress_max", "bistable_stress_max", "travel_stress_max", "travel_safety_factor"): _stresses,
    ("force_change_max", "force_per_preload"): _adjustment,
    ("adjusted_force_min", "adjusted_force_max", "adjusted_ripple_max"): _at_ends,
}
"""Values that are computed together, in the order of the page."""


PLACES = 201
"""Even places of the window at which forces are averaged."""


def adjustability(solution: Solution) -> Table:
    """Return what each preload gives: force in the window, its change, rest position, start of the constant force."""
    rows = [_at_preload(solution, number) for number in range(len(solution.pushes))]
    return _table(rows, _PRELOAD_COLUMNS)


_PRELOAD_COLUMNS = {
    "preload": "length",
    "force_mean": "force",
    "force_change": "force",
    "force_min": "force",
    "force_max": "force",
    "force_ripple": "ratio",
    "rest_position": "length",
    "window_start": "length",
    "window_end": "length",
    "window_start_from_rest": "length",
    "window_length": "length",
    "spring_stress_max": "stress",
    "bistable_stress_max": "stress",
}


def _at_preload(solution: Solution, number: int) -> dict[str, Any]:
    push, window = solution.pushes[number], solution.windows[number]
    force, nominal = forces(solution, push), forces(solution, solution.nominal)
    leaves, spring = solution.largest_stress(push, solution.window[1])
    row: dict[str, Any] = {"preload": push.preload, "rest_position": push.rest} | spread(force)
    row |= {"force_change": float(force.mean() - nominal.mean())}
    row |= {"spring_stress_max": spring, "bistable_stress_max": leaves}
    if window is not None:
        start, end = window
        row |= {"window_start": start, "window_end": end, "window_length": end - start}
        row |= {"window_start_from_rest": start - push.rest if push.rest is not None else None}
    return row


def forces(solution: Solution, push: Push) -> FloatArray:
    """Return the force of a curve at even places of the solution's window [N]; NaN beyond the curve."""
    return solution.force_at(push, np.linspace(*solution.window, PLACES))


def spread(force: FloatArray) -> dict[str, float]:
    """Return mean, extremes and (max - min)/max of a force [N]."""
    high, low = float(force.max()), float(force.min())
    ripple = (high - low) / high if high > 0 else np.nan
    return {"force_mean": float(force.mean()), "force_min": low, "force_max": high, "force_ripple": ripple}


@dataclass(frozen=True)
class TableReading:
    """One way to read a table of sizes: how many leaves there are, and how stiff the spring is [N/m]."""

    text: str
    half_beams: int
    positive_stiffness: float
    truss: bool = False


def readings(solution: Solution) -> Table:
    """Return what the mechanism would give without preload with other numbers of leaves and parts of the spring.

    Where a measured force and stiffness are stated, also with those.
    """
    rows = []
    for one in _readings(solution):
        found = spread(_force(solution, one))
        about = {"reading": one.text, "half_beams": one.half_beams, "positive_stiffness": one.positive_stiffness}
        rows.append(about | found)
    return _table(rows, _READING_COLUMNS)


_READING_COLUMNS = {
    "reading": "text",
    "half_beams": "count",
    "positive_stiffness": "stiffness",
    "force_mean": "force",
    "force_min": "force",
    "force_max": "force",
    "force_ripple": "ratio",
}


def _readings(solution: Solution) -> Iterator[TableReading]:
    mechanism, reported = solution.spec.mechanism, solution.spec.analysis.measured
    if mechanism.positive is None:
        for leaves in sorted({2, 4, mechanism.bistable.half_beams}):
            mark = ", as specified" if leaves == mechanism.bistable.half_beams else ""
            yield TableReading(f"{leaves} half-beams{mark}", leaves, solution.character.positive_stiffness)
        return
    whole = solution.character.positive_stiffness / share_of(mechanism.flexures)
    for leaves in sorted({2, 4, mechanism.bistable.half_beams}):
        for name, share in (("half", 0.5), ("whole", 1.0)):
            same = leaves == mechanism.bistable.half_beams and name == mechanism.flexures.loaded
            mark = ", as specified" if same else ""
            yield TableReading(f"{leaves} half-beams, {name} spring{mark}", leaves, share * whole)
    if mechanism.kinds == ("diamond", "v-beam"):
        one_chain = TrussDiamond(strip_of(mechanism.flexures, mechanism.material), 0.5).stiffness
        yield TableReading("the paper's eq. 19 as printed: truss law", 2, float(one_chain), truss=True)
    if reported is not None:
        yield TableReading("measured stiffness, 2 half-beams", 2, reported.positive_stiffness)
        yield TableReading("twice the measured stiffness, 4 half-beams", 4, 2.0 * reported.positive_stiffness)
        needed = measured_stiffness_for(reported.force, solution.parts.balance)
        yield TableReading("the stiffness that the measured force needs, 4 half-beams", 4, needed)


def _force(solution: Solution, one: TableReading) -> FloatArray:
    """Return the force of a reading without preload at even places of the window [N]."""
    places = np.linspace(*solution.window, PLACES)
    if one.truss:
        law = TrussLeaf(solution.parts.strip)
        return np.asarray(one.half_beams * law.force(places) + one.positive_stiffness * places)
    leaves = solution.sampler.leaves(places).force / solution.parts.half_beams
    spring = solution.sampler.spring(places)[0] / solution.character.positive_stiffness
    return np.asarray(one.half_beams * leaves + one.positive_stiffness * spring)


def _table(rows: list[dict[str, Any]], columns: dict[str, str]) -> Table:
    found = []
    for name, dimension in columns.items():
        values = [row.get(name) for row in rows]
        if dimension in ("text", "count"):
            found.append(TableColumn(name, tuple(values)))
        else:
            known = np.array([np.nan if value is None else value for value in values])
            found.append(border_column(name, known, dimension))
    return Table(tuple(found))
