"""The bench in one sentence: what to make, what to measure on it, and what force to expect where, for 95 % of parts.

Forces are those of parts to first order, drawn from `design.tolerances` or from what the process is assumed to hold.
The dimensions are those whose errors move the force most: what is worth measuring before the force is looked at. What
is no dimension and moves it as much, a modulus or the rate of a spring, is named beside them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.metrics import window_of
from cfmkit.specs.spec import DesignKeys
from cfmkit.specs.units import format_short
from cfmkit.studies.design_derivatives import exact_slopes, most_parts, slopes, step_of
from cfmkit.studies.requirement_constraints import sampled_of
from cfmkit.studies.stated_or_assumed_tolerances import assumed, tolerances, tolerances_of

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.stated_or_assumed_tolerances import DesignTolerances

PARTS, SHARE = 4000, 0.95
"""Parts that are drawn, and the share of them whose forces are named."""

DIMENSIONS = 3
"""How many dimensions are named: more are not measured."""

SIZES = ("length", "angle")
"""What a dimension is measured in."""


def bench(result: Result, run: Run) -> str:
    """Return the sentence; empty of a part of whose errors nothing is known, or that cannot be followed.

    Parameters
    ----------
    result : Result
        The analysis of the design.
    run : Run
        Seed of the parts.
    """
    if not result.curves:
        return ""
    try:
        made, whence = _made(result, run)
        if made is None:
            return ""
        places = _places(result)
        moved = _moved(result, made, places, run)
    except CfmError:
        return ""
    if moved is None:
        return ""
    nominal, by_error = moved
    errors = made.drawn(PARTS) - made.nominal
    forces = nominal + errors @ by_error.T
    low, high = np.quantile(forces, ((1.0 - SHARE) / 2.0, (1.0 + SHARE) / 2.0), axis=0)
    weight = (np.abs(by_error) * errors.std(axis=0)).sum(axis=0)
    curve = result.curve
    at = [format_short(place, curve.motion_dimension) for place in places]
    ends = [[format_short(force, curve.kind, 3) for force in one] for one in zip(nominal, low, high, strict=True)]
    expected = [f"{one[0]} ({one[1]} to {one[2]}) at {place}" for one, place in zip(ends, at, strict=True)]
    make = "make the part in geometry/" if family(result.spec.family).outline else "make the part"
    verb = "press" if curve.motion_dimension == "length" else "turn"
    return (
        f"{make}, {_to_measure(made, weight)}, {verb} it to {_listed(at)}, and expect {_listed(expected)}: each range "
        f"holds for {100 * SHARE:.0f} % of parts {whence}, to first order"
    )


def _to_measure(made: DesignTolerances, weight: FloatArray) -> str:
    """Return what to measure, of parameters that move the force by `weight` (d,): the first few dimensions.

    Then what else is among as many of all parameters.
    """
    order = [int(k) for k in np.argsort(-weight) if weight[k] > 0]
    sizes = [k for k in order if made.parameters[k].dimension in SIZES][:DIMENSIONS]
    others = [k for k in order[:DIMENSIONS] if made.parameters[k].dimension not in SIZES]
    reported = [f"measure {_listed([_dimension(made, k) for k in sizes])}"] if sizes else []
    if others:
        reported.append(f"determine {_listed([_named(made, k) + ' in the design)' for k in others])}")
    return ", ".join(reported)


def _dimension(made: DesignTolerances, k: int) -> str:
    """Return a dimension with its drawn value, as ``bistable.thickness (1.01 mm as drawn)``."""
    parent, _, last = made.paths[k].rpartition(".")
    thickness = getattr(made.spec.at(parent), "thickness", None)
    if last != "offset" or thickness is None:
        return f"{_named(made, k)} as drawn)"
    # an error of all thicknesses is nothing that is drawn
    ends = (min(thickness), max(thickness)) if isinstance(thickness, tuple) else (thickness,)
    reported = " to ".join(format_short(end, "length") for end in ends)
    return f"{parent.removeprefix('mechanism.')}.thickness ({reported} as drawn)"


def _named(made: DesignTolerances, k: int) -> str:
    """Return the name and the value of a parameter, the bracket still open."""
    value = format_short(float(made.nominal[k]), made.parameters[k].dimension)
    return f"{made.paths[k].removeprefix('mechanism.')} ({value}"


def _listed(items: list[str]) -> str:
    return ", ".join(items[:-1]) + (" and " if len(items) > 1 else "") + items[-1]


def _made(result: Result, run: Run) -> tuple[DesignTolerances | None, str]:
    """Return the tolerances of a part, those that are given or those that are assumed, and whence they are."""
    block = getattr(result.spec, "design", None)
    if isinstance(block, DesignKeys) and block.tolerances_of(result.spec)[0]:
        return tolerances_of(result.spec, block, run.seed), "within design.tolerances"
    found = assumed(result.spec)
    if found is None or not isinstance(block, DesignKeys):
        return None, ""
    stated = block.model_copy(update={"tolerances": tolerances(result.spec), "correlated": ()})
    return tolerances_of(result.spec, stated, run.seed), f"made by {found.process.name} (assumed tolerances)"


def _places(result: Result) -> FloatArray:
    """Return the two ends of the window, or the middle and the end of the travel."""
    found = window_of(result)
    least, most = float(result.curve.motion.min()), float(result.curve.motion.max())
    low, high = (found.lo, found.hi) if found else (0.5 * (most + least), most if most > 0.0 else least)
    return np.array([low, high])


def _moved(
    result: Result, made: DesignTolerances, places: FloatArray, run: Run
) -> tuple[FloatArray, FloatArray] | None:
    """Return the force of the design at places (p,), on its first branch, and its derivatives by the errors (p, d)."""
    spec, branch = made.spec, result.curve.branches[0]
    exact = exact_slopes(spec, places, made.paths)
    by_exact = [exact[path].effort.get(branch) for path in made.paths if path in exact]
    known = len(by_exact) == len(made.paths) and all(one is not None for one in by_exact)
    if not known and 2 * len(made.paths) > most_parts(spec):
        return None

    def force(part: Spec) -> FloatArray | None:
        found = sampled_of(part, places, run)
        values = None if found is None else found.effort.get(branch)
        return values if values is not None and np.isfinite(values).all() else None

    nominal = force(spec)
    if nominal is None:
        return None
    if known:
        return nominal, np.array(by_exact).T
    steps = {one.path: (one.spread.nominal, step_of(one.spread.standard_deviation)) for one in made.parameters}
    by_error = slopes(force, spec, steps)
    return None if by_error is None else (nominal, np.column_stack(by_error))
