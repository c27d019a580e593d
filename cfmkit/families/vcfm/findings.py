"""Findings of a mechanism of snap-through leaves and a preloaded spring: predicate and sentence of each.

Predicates take the solution of any number of mechanisms, sentences that of one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.end_stops import STOP_FINDINGS
from cfmkit.families.findings import (
    TOO_SOFT,
    Finder,
    describe_wide_beam,
    format_at_least,
    mm,
    mpa,
    newton,
    percent,
    rate,
    wide_beam_in_short,
)
from cfmkit.families.rows import FindingRule
from cfmkit.families.vcfm.leaf_laws_from_spec import closed_length, leaf_law, leaf_spring, spring_room
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import measured_stiffness_for
from cfmkit.families.vcfm.leaves.s_form import POLE_LOAD
from cfmkit.families.vcfm.leaves.v_beam import FLAT_BUCKLED_ABOVE
from cfmkit.families.vcfm.range_and_flatness_findings import (
    find_flattening,
    is_stocky,
    leaves_out_of_range,
    range_of_leaves,
    range_of_leaves_in_short,
    range_of_spring,
    ripple_inside,
    spring_out_of_range,
    stocky_leaves,
)
from cfmkit.families.vcfm.solution import LIMIT_RTOL, goes_beyond
from cfmkit.families.vcfm.surroundings import buckles, buckling, is_overstretched, overstretching

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.solution import Solution

    Sentence = tuple[Any, ...]


VCFM_FINDINGS = {
    "no_negative_stiffness": "the leaves are too thick for their rise: no negative stiffness anywhere",
    "no_linear_region": "the leaves do not buckle: their negative stiffness is not constant",
    "not_flat": "the positive and the negative stiffness do not cancel: the force is not constant",
    "force_reversal": "the force reaches zero within the window: the mechanism would not return",
    "bistable": "beyond the peak of the leaves the force is not positive: the mechanism stays in a second "
    "stable position",
    "overload": "the travel goes beyond the linear range, where the force rises steeply",
    "preload_out_of_range": "a preload at which no outward force remains, or no equilibrium holds the shuttle",
    "stroke_unreachable": "the rise is too small for the requested stroke",
    "asymmetric_buckling": "a shuttle that can turn lets the leaves buckle at half the load",
    "out_of_plane_buckling": "the leaves are so narrow that they buckle out of the plane first",
    "overstressed": "the stress exceeds the allowable one",
    "imperfection": "waviness of the unloaded leaves spoils the flatness",
    "spring_closed": "preload and travel compress the spring until its rigid blocks, or its turns, touch",
    "theory_range": "an angle or a travel is outside the range in which the closed forms hold",
    "unstable_branch": "the reported force is that of an unstable equilibrium, which a real leaf leaves",
    "truss_law": "the paper's truss law neglects bending: force and flatness are not those of the mechanism",
    "measured_contradiction": "the reported force and stiffness cannot both hold for these leaves",
    "target_curve": "no leaves and spring give the target curve: it ends too early, or is not above zero",
    "too_thin": "the design needs a leaf that is thinner than can be made",
    "envelope": "the design does not fit into the given space",
    "wide_beam": "the anticlastic bending of wide leaves is suppressed: they are stiffer than in beam theory",
    "mesh_coarse": "the force or the largest stress of the solid is not known as closely as requested",
    "sharp_corners": "without fillets the stress in inside corners has no value",
    "spring_overstretched": "bought springs are deflected beyond their limit",
    "spring_buckles": "a compression spring is pressed beyond the deflection at which it buckles, without a guide",
    "spring_slack": "bought springs are slack over a part of the travel",
    "no_spring_fits": "no spring of the catalogue fits",
    **STOP_FINDINGS,
    "stress_unreachable": "no leaf length brings the exact stress below the allowable stress",
}

finding = Finder(VCFM_FINDINGS)  # return a finding of this family; the name must be one that `VCFM_FINDINGS` explains

MAX_WAVINESS_RATIO = 0.02  # waviness over thickness from which on the flatness suffers
TURNING_LOAD_RATIO = POLE_LOAD / (4.0 * np.pi**2)
"""Load at which a leaf buckles whose shuttle can turn, over that with a shuttle that cannot; each in E I/L^2."""
STIFFNESS_RTOL = 0.01  # stiffnesses that differ by less than this share cancel
EXACT_FORM = 2e-4  # share of a stress that counts for nothing: designs are fitted to 1e-4


def _slenderness(solution: Solution) -> FloatArray:
    """Return rise over thickness of the leaves, (m,)."""
    return solution.spread_over_mechanisms(solution.parts.strip.slenderness)


# --- what is reported of a built mechanism, and the spring's room ---------------------------------------------------


def _is_measured_contradictory(solution: Solution) -> Any:
    """Return whether reported force and K_p cannot both hold for these leaves, (m,); False where none are reported."""
    if solution.spec.analysis.measured is None or not solution.leaf_kind.buckles:
        return False  # such leaves push where they are flat
    balance = solution.spread_over_mechanisms(solution.parts.balance)
    stated = [spec.analysis.measured for spec in solution.specs]
    stiffness, force = np.array(
        [(values.positive_stiffness, values.force) for values in stated if values is not None]
    ).T
    apart = np.abs(stiffness * balance / force - 1.0) > solution.spec.analysis.flatness
    return (_slenderness(solution) >= FLAT_BUCKLED_ABOVE) & apart


def _describe_contradiction(solution: Solution) -> Sentence:
    reported = solution.spec.analysis.measured
    assert reported is not None
    balance = float(solution.parts.balance)
    return (
        f"the reported {newton(reported.force)} and K_p = {rate(reported.positive_stiffness)} "
        f"contradict each other: at {mm(balance)} the leaves carry no force, "
        f"for any number, width or modulus, and the force is K_p h = {newton(reported.positive_stiffness * balance)}; "
        f"{newton(reported.force)} needs {rate(measured_stiffness_for(reported.force, balance))}",
    )


def is_closed(solution: Solution) -> NDArray[np.bool_]:
    """Return whether the spring is pressed together within the travel, (m,) of bool."""
    most = solution.column(lambda spec: max(spec.analysis.preloads))
    reach = np.minimum(solution.travel, solution.curves.stops.rigid_ends[1])
    return np.asarray(most + reach > solution.column(spring_room) * (1 + LIMIT_RTOL))


def closed_spring(solution: Solution) -> Sentence:
    """Return up to which travel the worst preload leaves the spring open, with what keeps it open."""
    spec, room = solution.spec, spring_room(solution.spec)
    most = max(spec.analysis.preloads)
    bought, needed = spec.mechanism.springs, most + spec.travel - room
    place = f"at {mm(room - most)} of the travel" if room > most else "before the shuttle moves"
    if bought is not None:
        key, least = "springs.free_length", closed_length(bought) + most + spec.travel
    else:
        spring = leaf_spring(spec.mechanism.flexures, spec.mechanism.material)
        key, least = spring.opening(spec.mechanism.frame.corner, needed)
    key, size = f"mechanism.{key}", format_at_least(least)
    return (
        f"the spring closes: its {'blocks' if bought is None else 'turns'} touch when it is compressed by {mm(room)}, "
        f"with a preload of {mm(most)} {place}, and curves end there; use less preload ('analysis.preloads') or travel "
        f"('analysis.travel'), or '{key}' of {size}",
        f"{key}={size}",
    )


# --- the kind of law, and the kind of leaf --------------------------------------------------------------------------


def _describe_truss(solution: Solution) -> Sentence:
    mechanism = solution.spec.mechanism
    law = leaf_law(mechanism.bistable, mechanism.material)
    places = np.linspace(0.0, 1.0, 401) * float(law.strip.rise)
    bars, leaves = np.asarray(solution.parts.leaf.force(places)), law.force(places)
    high, where = bars.max() / leaves.max() - 1.0, places[bars.argmax()] / places[leaves.argmax()]
    steep = float(solution.parts.leaf.negative_stiffness / law.negative_stiffness) if law.negative_stiffness else np.inf
    return (
        f"the paper's laws include neither buckling nor clamping: compared with the corrected laws the peak of the "
        f"leaves is {percent(high)} higher, at {where:.2g} times the travel, their steepest slope is {steep:.2g} times "
        "as steep, and with a spring the force is never flat",
        "analysis.fidelity=analytic",
    )


def _negative_and_straight(solution: Solution) -> tuple[Any, Any]:
    """Return of which leaves the stiffness is negative anywhere, and constant there, (m,) each."""
    limits = solution.leaf_kind.limits
    if not solution.leaf_kind.buckles or solution.fidelity == "truss":
        return True, True
    if limits is None:  # or they depend on more than the slenderness: as the curve has it
        is_negative = solution.spread_over_mechanisms(solution.character.negative_stiffness) > 0
        return is_negative, np.isfinite(solution.linear_range[0])
    q = _slenderness(solution)
    return q >= limits.negative, q > limits.constant


def _only_rises(solution: Solution) -> Any:
    return np.logical_not(_negative_and_straight(solution)[0])


def _has_rounded_force(solution: Solution) -> Any:
    negative, straight = _negative_and_straight(solution)
    return np.logical_and(negative, np.logical_not(straight))


def _rising_force(solution: Solution) -> Sentence:
    limits = solution.leaf_kind.limits
    limit = "" if limits is None else f", below {limits.negative}"
    return (
        f"rise over thickness is {_slenderness(solution)[0]:.4g}{limit}: the force of the leaves only rises and cannot "
        "cancel that of the spring; use thinner or steeper leaves",
    )


def _rounded_force(solution: Solution) -> Sentence:
    limits = solution.leaf_kind.limits
    limit = "" if limits is None else f", not above {limits.constant_text}"
    return (
        f"rise over thickness is {_slenderness(solution)[0]:.4g}{limit}: the leaves do not buckle and their force "
        "curve is rounded; the constant-force window is only its maximum. Use thinner or steeper leaves",
    )


# --- flatness -------------------------------------------------------------------------------------------------------


def _is_not_flat(solution: Solution) -> Any:
    if solution.spec.target_curve is not None:
        return False
    top, bottom = solution.nominal.extremes_inside(solution.window)
    return (top > 0) & ((top - bottom) / top > solution.spec.analysis.flatness) & ~solution.window_is_flat


def _uneven_force(solution: Solution) -> Sentence:
    push, (low, high), character = solution.first, solution.window_of_one, solution.character
    ripple, allowed = ripple_inside(solution, solution.window), solution.spec.analysis.flatness
    alike = (
        character.positive_stiffness > 0
        and abs(character.negative_stiffness / character.positive_stiffness - 1.0) < STIFFNESS_RTOL
    )
    reported = f"K_p = {rate(character.positive_stiffness)} and K_n = {rate(character.negative_stiffness)}"
    cause = f"{reported} cancel, but not in the whole window" if alike else f"{reported} do not cancel"
    low, high = max(low, float(push.travel[0])), min(high, float(push.travel[-1]))  # what is beyond is not known
    words, cures = find_flattening(solution, ripple)
    return (
        f"{cause}: over {mm(low)} ... {mm(high)} the force varies by {percent(ripple)} of its maximum, "
        f"{percent(allowed)} is allowed{words}",
        *cures,
    )


# --- the way back ---------------------------------------------------------------------------------------------------


def _stays_behind_peak(solution: Solution) -> Any:
    """Return which mechanisms do not come back by themselves, (m,): past its peak their force is not above rounding."""
    least, largest = solution.least[1], np.nanmax(np.abs(solution.nominal.force), axis=1, initial=0.0)
    return np.isfinite(least) & ~(least > LIMIT_RTOL * largest)


def _second_position(solution: Solution) -> Sentence:
    place, force = (float(value[0]) for value in solution.least)
    return (
        f"past the peak of the leaves the force falls to {newton(force)} at {mm(place)} (followed to "
        f"{mm(float(solution.first.travel[-1]))}): the mechanism stays there until it is pulled back; use a stiffer "
        "spring, thicker or fewer leaves, or a preload",
    )


def _rests_beyond(solution: Solution) -> Any:
    """Return whether nothing holds the shuttle before its window begins, (m,)."""
    return ~(solution.nominal.rest <= solution.window[0])


def _has_reversed_force(solution: Solution) -> Any:
    return _rests_beyond(solution) | (solution.nominal.extremes_inside(solution.window)[1] <= 0)


def _reversal(solution: Solution) -> Sentence:
    (low, high), least = solution.window_of_one, float(solution.nominal.extremes_inside(solution.window)[1][0])
    reported = newton(least) if np.isfinite(least) and not _rests_beyond(solution)[0] else "zero and below"
    return (
        f"within {mm(low)} ... {mm(high)} the force falls to {reported}: no outward force remains; a preload "
        f"above {mm(-float(solution.parts.balance))} and K_p >= K_n keep it positive",
    )


def _forces_beyond_linear(solution: Solution) -> tuple[FloatArray, FloatArray]:
    """Return the force where the leaves straighten again, NaN beyond the curve, and at the end, (m,) each [N]."""
    curves = solution.nominal
    at_end = curves.evaluate_within_ends(solution.linear_range[1][:, None])[:, 0]
    return at_end, curves.force[np.arange(len(solution)), curves.count - 1]


def _is_overloaded(solution: Solution) -> Any:
    (at_end, last), end = _forces_beyond_linear(solution), solution.linear_range[1]
    saved = solution.curves.stops.free_end <= end * (1 + LIMIT_RTOL)  # what rises there is the stop
    beyond = goes_beyond(solution.nominal.ends[1], end) & ~saved
    return beyond & ~(last - at_end <= solution.spec.analysis.flatness * np.abs(last))


def _overload(solution: Solution) -> Sentence:
    at_end, last = (float(force[0]) for force in _forces_beyond_linear(solution))
    end = float(solution.linear_range[1][0])
    return (
        f"beyond {mm(end)} the leaves straighten and stiffen: the force goes from {newton(at_end)} to {newton(last)} "
        f"at {mm(float(solution.first.travel[-1]))}; a stop at {mm(end)} limits the travel to the linear range",
    )


def _pulled_out_of_range(solution: Solution) -> FloatArray:
    """Return at which negative preloads no outward force remains somewhere in the window, (m, p) of bool."""
    curves = solution.curves
    pulled = solution.split_by_mechanism(curves.preload[:, 0] < 0)
    if not pulled.any():
        return np.zeros(pulled.shape, dtype=bool)
    low, high = (np.repeat(end, solution.preloads) for end in solution.window)
    lost = ~(curves.rest <= low) | (curves.extremes_inside((low, high))[1] <= 0)
    return np.asarray(pulled & solution.split_by_mechanism(lost))


def _pull(solution: Solution) -> Sentence:
    preload = solution.pushes[int(_pulled_out_of_range(solution)[0].argmax())].preload
    low, high = solution.window_of_one
    return (
        f"with a preload of {mm(preload)} no outward force remains somewhere in {mm(low)} ... {mm(high)}: where the "
        f"leaves are flat the force is K_p (h + dr), which vanishes at {mm(-float(solution.parts.balance))}",
    )


def _least_preload(solution: Solution) -> FloatArray:
    return np.asarray(solution.split_by_mechanism(solution.curves.preload[:, 0]).min(axis=1))


def _slack(solution: Solution) -> Sentence:
    least = float(_least_preload(solution)[0])
    return (
        f"with a preload of {mm(least)} the springs carry no force up to {mm(-least)} of travel: bought springs do "
        "not pull back",
    )


# --- strength, buckling, shape --------------------------------------------------------------------------------------


def _stress_ratios(solution: Solution) -> tuple[FloatArray, FloatArray]:
    """Return the largest stress of leaves (m,), and of the spring at each preload (m, p), over what is allowed."""
    allowed = solution.allowable_stress
    leaves = solution.travel_leaf_stress / (allowed * (1 + np.maximum(solution.overrating, EXACT_FORM)))
    return leaves, solution.travel_spring_stress / (allowed * (1 + EXACT_FORM))[:, None]


def _is_overstressed(solution: Solution) -> Any:
    if np.isnan(solution.allowable_stress).all():
        return False
    leaves, spring = _stress_ratios(solution)
    return (leaves > 1.0) | (spring > 1.0).any(axis=1)


def _overstress(solution: Solution) -> Sentence:
    (leaves, spring), allowed = _stress_ratios(solution), float(solution.allowable_stress[0])
    number = int(spring[0].argmax())
    if leaves[0] > spring[0, number]:  # at any preload: the first at which they are pushed so far
        tops = solution.curves.leaf_stress()
        number = int((tops >= (1.0 - LIMIT_RTOL) * tops.max()).argmax())
        name, top, share = "leaves", float(solution.travel_leaf_stress[0]), float(leaves[0])
    else:
        name, top, share = "spring", float(solution.travel_spring_stress[0, number]), float(spring[0, number])
    push = solution.pushes[number]
    stress = push.leaves.stress if name == "leaves" else push.spring_stress
    over = [*np.flatnonzero(stress > top / share), int(stress.argmax())]  # none of them where it peaks between two
    place = mm(float(push.travel[over[0]]))
    passes = f"passes {mpa(allowed)} at {place}" if over[0] else f"is above {mpa(allowed)} from {place} on"
    return (
        f"in the {name} the stress {passes} with a preload of {mm(push.preload)} and reaches {mpa(top)} at "
        f"{mm(float(push.travel[over[-1]]))}; use longer or thinner leaves, or less preload",
    )


def _overstress_in_short(solution: Solution) -> str:
    (leaves, spring), allowed = _stress_ratios(solution), float(solution.allowable_stress[0])
    if leaves[0] > spring[0].max():
        return f"{mpa(float(solution.travel_leaf_stress[0]))} in the leaves, {mpa(allowed)} allowed"
    return f"{mpa(float(solution.travel_spring_stress[0].max()))} in the spring, {mpa(allowed)} allowed"


def _turning_shuttle(solution: Solution) -> Sentence:
    hint = "" if solution.sampler.is_traced else "; only 'analysis.fidelity: exact' shows it"
    return (
        f"the shuttle can turn, so the leaves buckle at {percent(TURNING_LOAD_RATIO)} of the load and their force "
        f"curve is no longer straight{hint}. Use two Vs at a distance, or a guide",
        "mechanism.bistable.guided=true",
    )


def _buckles_out_of_plane(solution: Solution) -> Any:
    """Return whether leaves buckle out of the plane first, (m,): narrower than twice their thickness."""
    return solution.column(lambda spec: spec.mechanism.bistable.width - 2.0 * spec.mechanism.bistable.thickness) < 0


def _narrow_leaves(solution: Solution) -> Sentence:
    about = solution.spec.mechanism.bistable
    return (
        f"the leaves are {mm(about.width)} wide and {mm(about.thickness)} thick: leaves narrower than twice "
        "their thickness buckle out of the plane; use wider (and longer) leaves",
    )


def _make_width_rule(name: str) -> FindingRule[Solution]:
    """Return the rule on leaves, or a spring, that are too wide for beams."""

    def holds(solution: Solution) -> Any:
        curling = solution.hindered_curling
        return curling[name][0] > TOO_SOFT if name in curling else False

    def sentence(solution: Solution) -> Sentence:
        share, place = (float(value[0]) for value in solution.hindered_curling[name])
        exact, wide = solution.fidelity == "exact", "mechanism.wide_beams=true"
        hint = "" if exact else "; only 'analysis.fidelity: exact' accounts for it"
        cure = wide if exact else (wide, "analysis.fidelity=exact")
        return describe_wide_beam(share, f"in the {name} at {mm(place)}") + hint, cure

    return FindingRule(
        "wide_beam", holds, sentence, lambda solution: wide_beam_in_short(float(solution.hindered_curling[name][0][0]))
    )


def _is_wavy(solution: Solution) -> Any:
    waviness = solution.column(lambda spec: spec.mechanism.bistable.waviness)
    share = waviness / solution.column(lambda spec: spec.mechanism.bistable.thickness)
    return (share > MAX_WAVINESS_RATIO) | ((waviness > 0) & (not solution.sampler.is_traced))


def _imperfection(solution: Solution) -> Sentence:
    about = solution.spec.mechanism.bistable
    share, exact = about.waviness / about.thickness, solution.sampler.is_traced
    reported = "is counted in" if exact else "is neglected: only 'analysis.fidelity: exact' includes it"
    effect = "; it rounds the peak and lowers the negative stiffness" if share > MAX_WAVINESS_RATIO else ""
    return (f"waviness of {mm(about.waviness)}, {percent(share)} of the thickness, {reported}{effect}",)


def _is_unstable(solution: Solution) -> Any:
    if not solution.sampler.is_traced:
        return False  # laws are those of stable branches
    return (~solution.nominal.leaves.stable & solution.nominal.is_distinct).any(axis=1)


def _unstable_branch(solution: Solution) -> Sentence:
    push = solution.first
    lost = push.travel[~push.leaves.stable]
    text = f"from {mm(float(lost[0]))} to {mm(float(lost[-1]))} the leaves are unstable and snap to another shape"
    if solution.spec.analysis.branch == "stable":
        return (f"{text}, which was not found",)
    return f"{text}: analysis.branch: stable follows them", "analysis.branch=stable"


FINDING_RULES: tuple[FindingRule[Solution], ...] = (
    FindingRule("measured_contradiction", _is_measured_contradictory, _describe_contradiction),
    FindingRule("spring_closed", is_closed, closed_spring),
    FindingRule("truss_law", lambda solution: solution.fidelity == "truss", _describe_truss),
    FindingRule("no_negative_stiffness", _only_rises, _rising_force),
    FindingRule("no_linear_region", _has_rounded_force, _rounded_force),
    FindingRule(
        "not_flat",
        _is_not_flat,
        _uneven_force,
        lambda solution: (
            f"force varies by {percent(ripple_inside(solution, solution.window))}, "
            f"{percent(solution.spec.analysis.flatness)} allowed"
        ),
    ),
    FindingRule("bistable", _stays_behind_peak, _second_position),
    FindingRule("force_reversal", _has_reversed_force, _reversal),
    FindingRule("overload", _is_overloaded, _overload),
    FindingRule("preload_out_of_range", lambda solution: _pulled_out_of_range(solution).any(axis=1), _pull),
    FindingRule("spring_overstretched", is_overstretched, overstretching),
    FindingRule("spring_buckles", buckles, buckling),
    FindingRule(
        "spring_slack",
        lambda solution: (_least_preload(solution) < 0) & (solution.spec.mechanism.springs is not None),
        _slack,
    ),
    FindingRule("overstressed", _is_overstressed, _overstress, _overstress_in_short),
    FindingRule(
        "asymmetric_buckling",
        lambda solution: solution.column(lambda spec: not spec.mechanism.bistable.guided) > 0,
        _turning_shuttle,
    ),
    FindingRule("out_of_plane_buckling", _buckles_out_of_plane, _narrow_leaves),
    _make_width_rule("leaves"),
    _make_width_rule("spring"),
    FindingRule("imperfection", _is_wavy, _imperfection),
    FindingRule("unstable_branch", _is_unstable, _unstable_branch),
    FindingRule("theory_range", is_stocky, stocky_leaves),
    FindingRule("theory_range", leaves_out_of_range, range_of_leaves, range_of_leaves_in_short),
    FindingRule("theory_range", spring_out_of_range, range_of_spring),
)
"""Every finding of an analysis, the gravest first."""
