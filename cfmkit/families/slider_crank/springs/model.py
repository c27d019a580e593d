"""Analysis of a slider-crank with springs: torque over the crank angle, or force over the slider's travel.

The torque is the derivative of the energy by the crank angle [LH, eq. 10 and 12], the force that
by the slider's travel: what the slider pushes back with while it is moved towards the pivot.

Efforts and energies are linear in the springs' rates, so their derivatives by the rates are exact. A largest or
smallest value changes with the rate as the value does in its place: that the place itself moves is of second order.

Reference
---------
[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z.
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.arrays import distinct
from cfmkit.curves import Column, Curve
from cfmkit.families.findings import deg, mm
from cfmkit.families.no_mechanism import CannotBuild, no_result
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.linkage_from_spec import resolve
from cfmkit.families.slider_crank.springs.findings import findings_of
from cfmkit.families.slider_crank.springs.link_strength import values_of_links
from cfmkit.families.slider_crank.springs.scalar_results import DEFINITIONS, values_of, values_of_wires
from cfmkit.families.slider_crank.springs.solution import Character, ClosedFormEffort, Solution
from cfmkit.families.slider_crank.springs.sprung_linkage import TURN, assemble, default_motion
from cfmkit.families.slider_crank.unit_springs import JOINTS
from cfmkit.metrics.branches_cut_to_window import between_ends
from cfmkit.numerics.cubic_interpolation import bisect
from cfmkit.results import Result, Status
from cfmkit.specs.units import between, format_short
from cfmkit.stock.parts_list import BoughtPart, listed
from cfmkit.stock.springs.guides import guide_words

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.families.slider_crank.springs.sprung_linkage import Assembly
    from cfmkit.families.slider_crank.unit_springs import UnitCurves
    from cfmkit.results import Finding, Quantity


Ends = tuple[float, float]

RATES = {f"mechanism.springs.{name}": row for row, name in enumerate(JOINTS)}
"""Where a specification has the rates, and the rows of the springs."""


def analyze(spec: SliderCrankSpec, run: Run) -> Result:
    """Return the torque or force curve of a slider-crank, with everything that is wrong with it.

    Parameters
    ----------
    spec : SliderCrankSpec
        The mechanism.
    run : Run
        Which metrics are looked at: scalar results that are not, and then the findings, are left out.

    Returns
    -------
    Result
        One branch, ``load``; with friction ``unload``, too. NO_EQUILIBRIUM if the mechanism cannot be built, PARTIAL if
        the linkage does not reach all of the requested motion.
    """
    try:
        spec = resolve(spec)
        assembly = assemble(spec)
        solution, shortfalls = solve(spec, assembly)
    except CannotBuild as problem:
        return no_result(spec, problem.finding)
    said, stuck = {item.name for item in shortfalls}, _held(solution)
    found = findings_of(spec, solution) if run.wanted is None else ()
    values = dict(_values(spec, solution)) if run.wants(DEFINITIONS) else {}
    status = Status.PARTIAL if shortfalls or stuck else Status.COMPLETE
    return Result(
        spec=_as_run(spec, assembly),
        status=status,
        message=shortfalls[0].message if shortfalls else stuck,
        curves=(_curve(solution),),
        values=values,
        warnings=(*shortfalls, *(item for item in found if item.name not in said)),
        travel=asked_motion(spec, assembly),
        target=target_of(spec),
        reference=solution.reference,
        closed=ClosedFormEffort(solution.character),
        effort_error=solution.effort_error,
        part_efforts=solution.part_efforts,
        tables=listed(parts_of(spec)),
        state=solution,
    )


def _values(spec: SliderCrankSpec, solution: Solution) -> Mapping[str, Quantity]:
    """Return the scalar results by name: of the mechanism, of the springs' wires, and of the links."""
    links = values_of_links(spec, solution.assembly, solution.character.grid)
    return {**values_of(solution), **values_of_wires(spec.mechanism.springs, solution), **links}


def parts_of(spec: SliderCrankSpec) -> tuple[BoughtPart, ...]:
    """Return the bought parts: springs that the specification names, and pins; of all legs together."""
    mechanism, found = spec.mechanism, []
    for one in mechanism.springs.bought:
        value = getattr(mechanism.springs, one.at)
        rate = format_short(value, "stiffness" if one.at == "slider" else "rotational_stiffness")
        kind = f"{one.loaded or ''} spring".strip() if one.at == "slider" else "torsion spring"
        data = ", ".join([kind, f"{rate} of all in one leg", *guide_words(one)])
        found.append(BoughtPart(one.at.replace("_", " "), one.name, one.count * mechanism.sets, data))
    if mechanism.pins:
        found.append(BoughtPart("joints", "", 3 * mechanism.sets, f"pin, diameter {mm(mechanism.pins.diameter)}"))
    return tuple(found)


def target_of(spec: SliderCrankSpec) -> float | None:
    """Return what the effort is to be [N m or N]; None where the design says nothing about this drive."""
    if spec.design is None:
        return None
    return spec.design.torque if spec.analysis.drive == "torque" else spec.design.force


def asked_motion(spec: SliderCrankSpec, assembly: Assembly) -> tuple[float, float]:
    """Return the motion that the analysis asks for [rad or m]."""
    asked: tuple[float, float] | None = getattr(spec.analysis, assembly.motion_name)
    return asked or default_motion(assembly)


def solve(spec: SliderCrankSpec, assembly: Assembly) -> tuple[Solution, tuple[Finding, ...]]:
    """Return the solution over what the linkage reaches of the requested motion, and why that is less.

    Raises
    ------
    CannotBuild
        If it reaches nothing of it.
    """
    asked = asked_motion(spec, assembly)
    start, stop = assembly.within(*asked)
    short = tuple(_shortfalls(assembly, asked, (start, stop)))
    if short and not start < stop:
        raise CannotBuild(short[0])
    motion = np.linspace(start, stop, spec.analysis.points)
    units = assembly.units(motion)
    finite = np.isfinite(units.effort[assembly.rates > 0.0]).all(axis=0)
    if not finite.all():  # where springs are relaxed in a dead point of the crank: 0/0 in that place alone
        motion = motion[finite]
        units = assembly.units(motion)
    character = Character(assembly, start, stop, spec.analysis.tolerance, window_of(spec, assembly))
    anchored = spec.mechanism.springs.anchor is not None
    solution = Solution(
        assembly, motion, units, character, reference_motion(spec, assembly), spec.mechanism.sets, anchored
    )
    return solution, short


def window_of(spec: SliderCrankSpec, assembly: Assembly) -> tuple[float, float] | None:
    """Return the window in which the effort is wanted constant, if the analysis states one [rad or m]."""
    window = spec.analysis.window
    return None if window is None else between(window, asked_motion(spec, assembly))


def efforts_inside(
    assembly: Assembly, motion: FloatArray, units: UnitCurves, window: tuple[float, float] | None
) -> FloatArray:
    """Return the unit efforts in a window, (4, k), its ends included; without a window all of them."""
    if window is None:
        return units.effort
    between = between_ends(motion, *window)
    ends = assembly.forces(np.array(window))
    return np.concatenate([ends[:, :1], units.effort[:, between], ends[:, 1:]], axis=1)


def _shortfalls(assembly: Assembly, asked: Ends, run: Ends) -> Iterator[Finding]:
    """Yield why the motion that is run through is less than what is requested."""
    reach = assembly.reach
    slack = 1e-9 * (asked[1] - asked[0])
    beyond = asked[0] < reach[0] - slack or asked[1] > reach[1] + slack
    ends = zip(assembly.poles, reach, run, asked, strict=True)
    poles = [(pole, end) for unbound, pole, end, wanted in ends if unbound and end != wanted]
    if assembly.drive == "torque":
        if beyond or poles:
            yield _dead_point(assembly, asked, reach)
        return
    if beyond:
        yield finding(
            "out_of_reach",
            f"from the unloaded position the slider can travel {mm(reach[0])} to {mm(reach[1])}, and {mm(asked[0])} to "
            f"{mm(asked[1])} are requested; change 'analysis.travel'",
        )
    if poles:
        yield unbounded(poles)


def _dead_point(assembly: Assembly, asked: Ends, reach: Ends) -> Finding:
    whole = asked[1] - asked[0] >= TURN * (1 - 1e-9)
    return finding(
        "no_full_turn" if whole else "coupler_dead_point",
        f"the crank reaches {deg(reach[0])} to {deg(reach[1])}, and {deg(asked[0])} to {deg(asked[1])} are "
        f"requested: at the ends the coupler is perpendicular to the guide; reduce 'analysis.angle', or make "
        f"'mechanism.coupler_length' more than {mm(assembly.linkage.crank + abs(assembly.linkage.offset))} "
        "for full turns",
    )


def unbounded(poles: Sequence[tuple[float, float]]) -> Finding:
    """Return that the force grows without bound at some travels, and where the curve ends before them [m]."""
    places = " and ".join(mm(pole) for pole, _end in poles)
    ends = " and ".join(mm(end) for _pole, end in poles)
    return finding(
        "force_unbounded",
        f"at {places} of travel crank and coupler are in one line and the springs are not relaxed: no finite force "
        f"moves the slider there; the curve ends before, at {ends}",
    )


def reference_motion(spec: SliderCrankSpec, assembly: Assembly) -> float:
    """Return where the constant band is taken: as asked, else the stretched position, or half way of a force."""
    low, high = asked_motion(spec, assembly)
    if assembly.drive == "force":
        asked = spec.analysis.reference_travel
        return 0.5 * (low + high) if asked is None else asked
    asked = spec.analysis.reference_angle
    if asked is not None:
        return asked
    return assembly.stretched if low <= assembly.stretched <= high else 0.5 * (low + high)


def _as_run(spec: SliderCrankSpec, assembly: Assembly) -> SliderCrankSpec:
    """Return the spec with the defaults of the analysis made explicit."""
    written = {assembly.motion_name: asked_motion(spec, assembly), "fidelity": "prb"}
    return spec.model_copy(update={"analysis": spec.analysis.model_copy(update=written)})


def _curve(solution: Solution) -> Curve:
    drive, units = solution.assembly.drive, solution.units
    rate = "rotational_stiffness" if drive == "torque" else "stiffness"
    shares = {f"{drive}_{name}": Column(row, drive) for name, row in zip(JOINTS, solution.shares, strict=True)}
    place = {"slider_position": Column(units.position, "length")}
    if drive == "force":
        place = {"crank_angle": Column(units.angle, "angle"), **place}
    rows = zip(JOINTS[:3], units.turn, strict=False)
    turns = {f"{name}_rotation": Column(row, "angle") for name, row in rows}
    extra = {
        "stiffness": Column(solution.stiffness, rate),
        "energy": Column(solution.energy, "energy"),
        **shares,
        **place,
        **turns,
        "slider_travel": Column(units.turn[3] - solution.assembly.tight, "length"),
        "coupler_force": Column(solution.reactions[0], "force"),
        "guide_force": Column(solution.reactions[1], "force"),
    }
    if solution.ways is not None:
        return _loop(solution, extra)
    return Curve(solution.motion, solution.effort, extra=extra, kind=drive)


def _loop(solution: Solution, extra: dict[str, Column]) -> Curve:
    """Return the way through the motion and back, with friction."""
    assert solution.ways is not None
    forth, back = solution.ways
    drive, points = solution.assembly.drive, len(solution.motion)

    def both(one: FloatArray, other: FloatArray) -> FloatArray:
        return np.concatenate([one, other[::-1]])

    columns = {name: Column(both(item.values, item.values), item.dimension) for name, item in extra.items()}
    columns["coupler_force"] = Column(both(forth.coupler, back.coupler) / solution.legs, "force")
    columns["guide_force"] = Column(both(forth.guide, back.guide) / solution.legs, "force")
    columns |= {f"lost_to_{kind}": Column(both(forth.lost[kind], back.lost[kind]), drive) for kind in forth.lost}
    effort, branches = both(forth.effort, back.effort), np.repeat(["load", "unload"], points)
    return Curve(both(solution.motion, solution.motion), effort, branches, np.isfinite(effort), columns, drive)


def _held(solution: Solution) -> str:
    """Return what to say of places where friction leaves no equilibrium; empty without any."""
    ways = solution.ways or ()
    failed = sum(int((~np.isfinite(way.effort)[1:]).sum()) for way in ways)
    return (
        f"{failed} of {2 * len(solution.motion)} points have no equilibrium: friction holds the mechanism"
        if failed
        else ""
    )


def gradient(spec: SliderCrankSpec, paths: Sequence[str]) -> dict[str, dict[str, float]]:
    """Return derivatives [SI] of metrics over the window of the analysis by the rates of springs of one leg.

    Parameters
    ----------
    spec : SliderCrankSpec
        The nominal mechanism.
    paths : sequence of str
        Those that are no rate of a spring are left out.
    """
    if spec.fidelity != "prb" or spec.mechanism.pins or spec.mechanism.guide:
        return {}
    try:
        spec = resolve(spec)
        solution, short = solve(spec, assemble(spec))
    except CannotBuild:
        return {}
    if short or not solution.assembly.rates.any():
        return {}
    known = {path: RATES[path] for path in paths if path in RATES}
    legs = spec.mechanism.sets
    slopes = dict(_slopes(spec, solution))
    return {name: {path: legs * float(by[row]) for path, row in known.items()} for name, by in slopes.items()}


def _slopes(spec: SliderCrankSpec, solution: Solution) -> Iterator[tuple[str, FloatArray]]:
    """Yield each metric with its derivatives by the four total rates."""
    drive, assembly = solution.assembly.drive, solution.assembly
    unit = efforts_inside(assembly, solution.motion, solution.units, window_of(spec, assembly))
    effort = assembly.rates @ unit
    sign = -1.0 if effort.mean() < 0 else 1.0
    places = _places_inside(solution, window_of(spec, assembly))
    high, low = (_at_extreme(assembly, places, toward) for toward in (sign, -sign))
    top, bottom = float(assembly.rates @ high), float(assembly.rates @ low)
    yield f"{drive}_mean", unit.mean(axis=1)
    yield f"{drive}_max", high if sign > 0 else low
    yield f"{drive}_min", low if sign > 0 else high
    if top != 0.0:
        yield f"{drive}_ripple", (bottom * high / top - low) / top
    if top + bottom != 0.0:
        yield "half_band", 2.0 * (bottom * high - top * low) / (top + bottom) ** 2
    yield "energy_max", _at_largest_energy(solution)
    reference = reference_motion(spec, assembly)
    if solution.character.low <= reference <= solution.character.high:
        yield f"reference_{drive}", assembly.units(np.array([reference])).effort[:, 0]
    if drive == "torque":
        at = assembly.units(np.array([assembly.stretched]))
        yield "stretched_torque", at.effort[:, 0]
        yield "stretched_stiffness", at.stiffness[:, 0]


def _places_inside(solution: Solution, window: tuple[float, float] | None) -> FloatArray:
    """Return the ends of a window, the points of the curve between them and the grid of the class, increasing."""
    low, high = window or (float(solution.motion[0]), float(solution.motion[-1]))
    places = np.concatenate([solution.motion, solution.character.grid])
    return distinct(np.concatenate([[low, high], places[between_ends(places, low, high)]]))


def _at_extreme(assembly: Assembly, places: FloatArray, sign: float) -> FloatArray:
    """Return the unit efforts (4,) where the effort times a sign is largest, next to the places too.

    An extreme moves with the rates, but the effort does not change with its place there: its derivatives are these.
    """
    largest = int(np.argmax(sign * (assembly.rates @ assembly.forces(places))))
    low, high = places[max(largest - 1, 0)], places[min(largest + 1, len(places) - 1)]

    def falls(place: float) -> bool:
        return sign * float(assembly.rates @ assembly.units(np.array([place])).stiffness[:, 0]) <= 0.0

    at = places[largest]
    if not falls(low) and falls(high):
        at = bisect(falls, float(low), float(high))
    return np.asarray(assembly.units(np.array([at])).effort[:, 0])


def _at_largest_energy(solution: Solution) -> FloatArray:
    """Return the energies of unit springs (4,) where the energy is largest: at an end, or where no effort is left."""
    assembly, character = solution.assembly, solution.character
    inner = [one.motion for one in character.equilibria if character.low < one.motion < character.high]
    energy = 0.5 * assembly.units(np.array([character.low, *inner, character.high])).turn ** 2
    return np.asarray(energy[:, int(np.argmax(assembly.rates @ energy))])
