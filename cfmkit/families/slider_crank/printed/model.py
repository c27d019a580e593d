"""Analysis of a printed slider-crank: the force of flexures or of a strip over the slider's travel.

[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.2 and 3.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import LazyMapping, LazySequence
from cfmkit.curves import Column, Curve
from cfmkit.elastica.results.between_points import interpolate_path
from cfmkit.errors import InputError
from cfmkit.families.findings import CannotBuild, no_result
from cfmkit.families.rows import findings_of_one, values_of_one, with_values
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.linkage import resolve, unloaded_linkage
from cfmkit.families.slider_crank.printed.beam_chain_from_spec import chain_of, elasticity
from cfmkit.families.slider_crank.printed.equilibrium_path import PressingEnd, cut_at_contact
from cfmkit.families.slider_crank.printed.findings import FINDING_RULES
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import taper_of
from cfmkit.families.slider_crank.printed.scalar_results import SCALAR_QUANTITIES
from cfmkit.families.slider_crank.printed.solution import Solution
from cfmkit.results import Result, Status
from cfmkit.specs.units import window_places

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.elastica.results.between_points import BetweenPoints
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.printed.equilibrium_path import Chain
    from cfmkit.families.slider_crank.spec import Mechanism, SliderCrankSpec


DEFAULT_SHARE = 0.35
"""Travel where none is requested, in lengths of the slider's path from the pivot: that of [B, sec. 2.1]."""
_ENDING_NAMES = {
    PressingEnd.LIMIT_POINT: "limit_point",
    PressingEnd.UNSTABLE: "unstable",
    PressingEnd.NOT_CONVERGED: "not_converged",
    PressingEnd.WRONG_BRANCH: "wrong_branch",
    PressingEnd.CROSSES: "wrong_branch",
    PressingEnd.BLOCKED: "meets_itself",
    PressingEnd.STARTS_LATE: "branch_begins_late",
}


def analyze(spec: SliderCrankSpec, _run: Run) -> Result:
    """Return the force of a printed slider-crank over its slider's travel, with everything that is wrong with it.

    PARTIAL if equilibrium ends within the travel, NO_EQUILIBRIUM if nothing was found that is on the requested branch.
    """
    try:
        spec = as_run(spec)
        chain = chain_of(spec)
    except CannotBuild as problem:
        return no_result(spec, problem.finding)
    except InputError as problem:
        return Result(spec, Status.INVALID, str(problem))
    low, high = spec.analysis.travel or (0.0, 0.0)
    if low < 0:
        pulled = finding("pulled", "a printed chain is pressed, not pulled: 'analysis.travel' must not begin below 0")
        return no_result(spec, pulled)
    side = spec.analysis.side_sign
    stops, grid = spec.mechanism.end_stops, np.linspace(low, high, spec.analysis.points)
    pressed = chain.press(stops.mark_rows([grid])[0] if stops else grid, side)
    pressed = cut_at_contact(pressed, _thickness(chain))
    usable = len(pressed.travel) > 1 and pressed.ending is not PressingEnd.WRONG_BRANCH
    reported = (
        () if pressed.ending is PressingEnd.COMPLETE else (finding(_ENDING_NAMES[pressed.ending], pressed.message),)
    )
    blocked = "" if reported else stops.describe_block(float(pressed.travel[-1]))
    on_stops = tuple(finding(*pair) for pair in stops.sentences(pressed.travel, 0.0)) if usable else ()
    if not usable:
        return Result(spec, Status.NO_EQUILIBRIUM, pressed.message, warnings=reported)
    whole = (float(pressed.travel[0]), min(float(pressed.travel[-1]), stops.free_end))
    window = whole if spec.analysis.window is None else window_places(spec.analysis.window, (low, high))
    solution = Solution(
        chain,
        pressed,
        elasticity(spec.mechanism),
        spec.mechanism.sets,
        window,
        side,
        spec.mechanism.copies == "mirrored",
        spec,
    )
    return Result(
        spec=spec,
        status=Status.PARTIAL if reported or blocked else Status.COMPLETE,
        message=reported[0].message if reported else blocked,
        curves=(_curve(solution),),
        values=values_of_one(SCALAR_QUANTITIES, solution) | stops.values(solution.travel, False, window),
        warnings=LazySequence(lambda: (*reported, *on_stops, *findings_of_one(FINDING_RULES, finding, solution))),
        travel=(low, high),
        target=spec.design.force if spec.design else None,
        reference=spec.analysis.reference_travel,
        allowable_stress=solution.material.allowable_stress,
        effort_error=solution.effort_error,
        closed=solution.course if stops else solution.course or _interpolate_path(solution),
        state=solution,
    )


def _interpolate_path(solution: Solution) -> BetweenPoints | None:
    path, allowed = solution.pressed.path, solution.material.allowable_stress
    return interpolate_path(path, float(solution.legs), allowed=allowed)


def _thickness(chain: Chain) -> float:
    """Return the mean thickness of both ends of a chain [m]."""
    tapers = [taper_of(beam.section) for beam in chain.build(chain.points).beams.values()]
    return 0.5 * float(tapers[0].values[0] + tapers[-1].values[-1])


def slider_reach(mechanism: Mechanism) -> float:
    """Return the slider's distance from the pivot along its way, unloaded [m].

    Raises CannotBuild if the linkage cannot be assembled.
    """
    linkage, unloaded = unloaded_linkage(mechanism)
    return abs(float(linkage.slider_position(np.array(unloaded))))


def as_run(spec: SliderCrankSpec) -> SliderCrankSpec:
    """Return the spec with its coupler and the defaults of the analysis made explicit.

    Raises CannotBuild if the linkage cannot be assembled.
    """
    spec = resolve(spec)
    travel = spec.analysis.travel or (0.0, DEFAULT_SHARE * slider_reach(spec.mechanism))
    return with_values(spec, {"analysis.travel": travel, "analysis.fidelity": spec.fidelity})


def _curve(solution: Solution) -> Curve:
    columns: dict[str, Callable[[], Column]] = {
        "max_stress": lambda: Column(solution.stress, "stress"),
        "stress_place": lambda: Column(solution.place, "length"),
        "side_force": lambda: Column(solution.side_force, "force"),
        "guide_moment": lambda: Column(solution.guide_moment, "torque"),
        "energy": lambda: Column(solution.energy, "energy"),
    }
    on_stops = solution.stops.columns(solution.travel, False)
    columns |= {name: partial(on_stops.__getitem__, name) for name in on_stops}
    extra = LazyMapping(columns, lambda name: columns[name]())
    return Curve(solution.travel, solution.force, stable=solution.stable, extra=extra)
