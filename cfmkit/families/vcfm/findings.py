"""What a mechanism of snap-through leaves and a preloaded spring can suffer from, by name, and the checks for it."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.findings import at_least, at_most, finder, mm, mpa, newton, percent, rate, too_soft
from cfmkit.families.vcfm.bought_parts import spring_faults
from cfmkit.families.vcfm.leaf_laws_from_spec import closed_length, spring_room
from cfmkit.families.vcfm.leaves.hybrid import HybridLeaf
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Diamond, measured_stiffness_for
from cfmkit.families.vcfm.leaves.s_form import POLE
from cfmkit.families.vcfm.leaves.v_beam import (
    FLAT_BUCKLED_ABOVE,
    LINEAR_ABOVE,
    NEGATIVE_ABOVE,
    RELIABLE,
    STEEP,
    STOCKY,
    THICK,
    VBeam,
)
from cfmkit.families.vcfm.solution import ROUNDING, goes_beyond, leaves_plane

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.solution import Push, Solution
    from cfmkit.results import Finding


TRACED = ("exact", "solid")
"""Models that follow leaves along their branches."""

FINDINGS = {
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
    "imperfection": "waviness of the leaves as made spoils the flatness",
    "spring_closed": "preload and travel compress the spring until its rigid blocks, or its turns, touch",
    "theory_range": "an angle or a travel is outside the range in which the closed forms hold",
    "unstable_branch": "the reported force is that of an unstable equilibrium, which a real leaf leaves",
    "truss_law": "the paper's truss law neglects bending: force and flatness are not those of the mechanism",
    "measured_contradiction": "the reported force and stiffness cannot both hold for these leaves",
    "target_curve": "no leaves and spring give the target curve: it ends too early, or is not above zero",
    "too_thin": "the design needs a leaf that is thinner than can be made",
    "envelope": "the design does not fit into the given space",
    "wide_beam": "leaves are so wide that they cannot curl across their width: they are stiffer than in beam theory",
    "mesh_coarse": "the force or the largest stress of the solid is not known as closely as requested",
    "sharp_corners": "without fillets the stress in inside corners has no value",
    "spring_overstretched": "bought springs are deflected beyond their limit",
    "spring_buckles": "a compression spring is pressed beyond the deflection at which it buckles, without a guide",
    "spring_slack": "bought springs are slack over a part of the travel",
    "no_spring_fits": "no spring of the catalogue fits",
    "stress_unreachable": "no leaf length brings the exact stress below the allowable stress",
}

finding = finder(FINDINGS)
"""Return a finding of this family; the name must be one that `FINDINGS` explains."""

WAVY = 0.02
"""Waviness over thickness from which on the flatness suffers."""

TURNING = POLE / (4.0 * np.pi**2)
"""Load at which a leaf buckles whose shuttle can turn, over that with a shuttle that cannot; each in E I/L^2."""

PRESSED, STRETCHED = 0.3, 0.12
"""Deflection of a diamond's leaf over its length beyond which its stiffness is off by more than 3 and 4 percent."""

ALIKE = 0.01
"""Stiffnesses that differ by less than this share cancel."""

TRIED = (0.998, 0.99, 0.97, 0.94, 0.9)
"""Shares of the flatness that are looked for where a window is proposed: by the samples of a curve, with a corner cut
off, the whole must be kept."""

WIDEST = 50.0
"""Factor on a width up to which one is looked for that makes the force flat."""

EXACT_FORM = 2e-4
"""Share of a stress that counts for nothing: designs are fitted to 1e-4."""


def findings_of(solution: Solution) -> tuple[Finding, ...]:
    """Return every finding about a solved mechanism, the gravest first."""
    nature = (_measured, spring_closed, _truss, _leaf_shape, _flatness, _returns)
    limits = (_preloads, _bought_springs, _strength, _buckling, _width, _imperfect, _range)
    return tuple(found for check in (*nature, *limits) for found in check(solution))


def _leaf_shape(solution: Solution) -> Iterator[Finding]:
    kind, one = solution.spec.mechanism.bistable.structure, solution.character
    if kind == "hybrid" or solution.spec.analysis.fidelity == "truss":
        return
    q = float(solution.parts.strip.slenderness)
    negative, straight = q >= NEGATIVE_ABOVE, q > LINEAR_ABOVE
    reported = f"rise over thickness is {q:.4g}"
    if kind == "cosine":  # whose limits depend on the angle: as the curve has it
        negative, straight = one.negative_stiffness > 0, bool(np.isfinite(one.linear[0]))
    limits = {"v-beam": (f", below {NEGATIVE_ABOVE}", ", not above pi"), "cosine": ("", "")}[kind]
    if not negative:
        yield finding(
            "no_negative_stiffness",
            f"{reported}{limits[0]}: the force of the leaves only rises and cannot cancel that of the spring; "
            "use thinner or steeper leaves",
        )
    elif not straight:
        yield finding(
            "no_linear_region",
            f"{reported}{limits[1]}: the leaves do not buckle and their force curve is rounded; the constant-force "
            "window is only its maximum. Use thinner or steeper leaves",
        )


def _flatness(solution: Solution) -> Iterator[Finding]:
    push, (low, high) = solution.nominal, solution.window
    force = solution.inside(push, (low, high))
    if not len(force) or force.max() <= 0:
        return
    ripple, allowed = _ripple(force), solution.spec.analysis.flatness
    if ripple <= allowed or solution.window_is_flat or solution.spec.target_curve is not None:
        return
    one = solution.character
    alike = one.positive_stiffness > 0 and abs(one.negative_stiffness / one.positive_stiffness - 1.0) < ALIKE
    reported = f"K_p = {rate(one.positive_stiffness)} and K_n = {rate(one.negative_stiffness)}"
    cause = f"{reported} cancel, but not in the whole window" if alike else f"{reported} do not cancel"
    low, high = max(low, float(push.travel[0])), min(high, float(push.travel[-1]))  # what is beyond is not known
    words, cures = _flattening(solution, ripple)
    yield finding(
        "not_flat",
        f"{cause}: over {mm(low)} ... {mm(high)} the force varies by {percent(ripple)} of its maximum, "
        f"{percent(allowed)} is allowed{words}",
        *cures,
    )


def _flattening(solution: Solution, ripple: float) -> tuple[str, tuple[str, ...]]:
    """Return what makes the force flat, in words and as changes of the specification: only what has been tried.

    Forces are linear in the widths, so that other widths need no other solution. Where none is flat over the window,
    the window is wrong: then the flat part is named.
    """
    factor, left = _better_width(solution)
    allowed = solution.spec.analysis.flatness
    if left <= allowed and left < ripple:
        other = "as wide" if solution.spec.mechanism.springs is None else "as stiff"
        text = f"; leaves {factor:.3g} times as wide, or a spring {1.0 / factor:.3g} times {other}, make them equal"
        return text, ()
    (first, last), (low, high) = solution.character.linear, solution.window
    why = ""
    if np.isfinite(first) and (low < first or high > last):
        why = f"; the leaves are buckled from {mm(first)} to {mm(last)} only"
    for share in TRIED:
        flat = solution.flat_part(solution.nominal, share * allowed)
        if flat is not None and _ripple(solution.inside(solution.nominal, flat)) <= (1.0 - ROUNDING) * allowed:
            start, end = at_least(flat[0]), at_most(flat[1])
            cure = f"analysis.window=[{start}, {end}]"
            return f"{why}; the force is flat from {start} to {end}: use that as the window", (cure,)
    return f"{why}; no width of leaves or spring makes it flat", ()


def _ripple(force: FloatArray) -> float:
    """Return (max - min)/max of some forces."""
    return float((force.max() - force.min()) / force.max()) if len(force) and force.max() > 0 else np.inf


def _better_width(solution: Solution) -> tuple[float, float]:
    """Return the factor on the leaves' width that makes the force flattest in the window, and the ripple left."""
    low, high = solution.window
    travel = solution.nominal.travel
    places = np.unique(np.concatenate([np.linspace(low, high, 201), travel[(travel > low) & (travel < high)]]))
    leaves = solution.sampler.leaf_force(places)
    spring = solution.sampler.spring(places + solution.nominal.preload)[0]
    if not np.isfinite(leaves + spring).all():
        return 1.0, np.inf
    one = solution.character
    factors = np.geomspace(1.0 / WIDEST, WIDEST, 801)
    if one.negative_stiffness > 0:  # the nearest at hand where the slopes are constant
        factors = np.append(factors, one.positive_stiffness / one.negative_stiffness)
    top, bottom = (extreme_sums(factors, leaves, spring, way) for way in (1.0, -1.0))
    with np.errstate(all="ignore"):
        left = np.where(bottom > 0, (top - bottom) / top, np.inf)
    # stiffnesses that cancel are what a reader expects: another factor only where that one does not do
    best = len(factors) - 1 if left[-1] <= solution.spec.analysis.flatness else int(left.argmin())
    return float(factors[best]), float(left[best])


def extreme_sums(factors: FloatArray, slopes: FloatArray, offsets: FloatArray, way: float) -> FloatArray:
    """Return the largest (`way` 1) or smallest (-1) of factor * slope + offset over many lines, for each factor.

    Only lines of the convex hull of (slope, offset) are ever extreme: some dozen of hundreds.

    Examples
    --------
    >>> extreme_sums(np.array([0.0, 2.0]), np.array([1.0, -1.0, 0.5]), np.array([0.0, 3.0, 1.0]), 1.0).tolist()
    [3.0, 2.0]
    """
    hull: list[int] = []
    # Where leaves are buckled the lines meet in one point: without a margin, rounding keeps all of them.
    margin = 1e-14 * float(np.ptp(slopes)) * float(np.abs(offsets).max(initial=0.0))
    x, y = (way * slopes).tolist(), (way * offsets).tolist()
    for k in np.lexsort((-way * offsets, way * slopes)).tolist():
        if hull and x[k] == x[hull[-1]]:
            continue
        while len(hull) > 1:
            i, j = hull[-2:]
            if (x[j] - x[i]) * (y[k] - y[i]) < (y[j] - y[i]) * (x[k] - x[i]) - margin:
                break
            hull.pop()
        hull.append(k)
    sums = factors[:, None] * slopes[hull] + offsets[hull]
    return np.asarray(way * (way * sums).max(axis=1))


def _returns(solution: Solution) -> Iterator[Finding]:
    push, (low, high) = solution.nominal, solution.window
    if solution.least and not returns(solution.least[1], float(np.abs(push.force).max())):
        place, force = solution.least
        yield finding(
            "bistable",
            f"past the peak of the leaves the force falls to {newton(force)} at {mm(place)} (followed to "
            f"{mm(float(push.travel[-1]))}): the mechanism stays there until it is pulled back; use a stiffer spring, "
            "thicker or fewer leaves, or a preload",
        )
    inside = solution.inside(push, (low, high))
    beyond = push.rest is None or push.rest > low
    if beyond or (len(inside) and inside.min() <= 0):
        reported = newton(float(inside.min())) if len(inside) and not beyond else "zero and below"
        yield finding(
            "force_reversal",
            f"within {mm(low)} ... {mm(high)} the force falls to {reported}: no outward force remains; a preload "
            f"above {mm(-solution.parts.balance)} and K_p >= K_n keep it positive",
        )
    yield from _overload(solution, push)


def returns(least: FloatArray | float, largest: FloatArray | float) -> Any:
    """Return whether a mechanism comes back by itself: its least force past the peak of the leaves is above rounding.

    Parameters
    ----------
    least, largest : float or array
        That force, and the largest of the curve [N].
    """
    return np.asarray(least > ROUNDING * largest)


def _overload(solution: Solution, push: Push) -> Iterator[Finding]:
    end = solution.character.linear[1]
    if np.isfinite(end) and goes_beyond(push.travel[-1], end):
        at_end, last = float(solution.force_at(push, np.array([end]))[0]), float(push.force[-1])
        if last - at_end <= solution.spec.analysis.flatness * abs(last):
            return
        yield finding(
            "overload",
            f"beyond {mm(end)} the leaves straighten and stiffen: the force goes from {newton(at_end)} to "
            f"{newton(last)} at {mm(float(push.travel[-1]))}; a stop at {mm(end)} limits the travel to the linear "
            "range",
        )


def _preloads(solution: Solution) -> Iterator[Finding]:
    for push in solution.pushes:
        if push.preload >= 0:
            continue
        inside = solution.inside(push, solution.window)
        if push.rest is None or push.rest > solution.window[0] or inside.min(initial=np.inf) <= 0:
            low, high = solution.window
            yield finding(
                "preload_out_of_range",
                f"with a preload of {mm(push.preload)} no outward force remains somewhere in {mm(low)} ... "
                f"{mm(high)}: where the leaves are flat the force is K_p (h + dr), which vanishes at "
                f"{mm(-solution.parts.balance)}",
            )
            return


def _bought_springs(solution: Solution) -> Iterator[Finding]:
    for name, reported, *cures in spring_faults(solution):
        yield finding(name, reported, *cures)


def _strength(solution: Solution) -> Iterator[Finding]:
    allowed = solution.spec.mechanism.allowable_stress
    if allowed is None:
        return
    parts = [
        (push, name, samples, top, allowed * (1 + slack))
        for push, tops in zip(solution.pushes, solution.largest_stresses(solution.pushes, (np.inf,))[:, 0], strict=True)
        for name, samples, top, slack in (
            ("spring", push.spring_stress, float(tops[1]), EXACT_FORM),
            ("leaves", push.leaves.stress, float(tops[0]), max(solution.overrating, EXACT_FORM)),
        )
    ]
    push, name, stress, top, bound = max(parts, key=lambda part: part[3] / part[4])
    if top > bound:
        over = [*np.flatnonzero(stress > bound), int(stress.argmax())]  # none of them where it peaks between two
        place = mm(float(push.travel[over[0]]))
        passes = f"passes {mpa(allowed)} at {place}" if over[0] else f"is above {mpa(allowed)} from {place} on"
        yield finding(
            "overstressed",
            f"in the {name} the stress {passes} with a preload of {mm(push.preload)} and reaches {mpa(top)} at "
            f"{mm(float(push.travel[over[-1]]))}; use longer or thinner leaves, or less preload",
        )


def _buckling(solution: Solution) -> Iterator[Finding]:
    about = solution.spec.mechanism.bistable
    if not about.guided:
        hint = "" if solution.spec.analysis.fidelity in TRACED else "; only 'analysis.fidelity: exact' shows it"
        yield finding(
            "asymmetric_buckling",
            f"the shuttle can turn, so the leaves buckle at {percent(TURNING)} of the load and their force "
            f"curve is no longer straight{hint}. Use two Vs at a distance, or a guide",
            "mechanism.bistable.guided=true",
        )
    if leaves_plane(about.width, about.thickness):
        yield finding(
            "out_of_plane_buckling",
            f"the leaves are {mm(about.width)} wide and {mm(about.thickness)} thick: leaves narrower than twice "
            "their thickness buckle out of the plane; use wider (and longer) leaves",
        )


def _width(solution: Solution) -> Iterator[Finding]:
    exact = solution.spec.analysis.fidelity == "exact"
    wide, hint = "mechanism.wide_beams=true", "; only 'analysis.fidelity: exact' accounts for it"
    cure = wide if exact else (wide, "analysis.fidelity=exact")
    for name, share, place in solution.hindered_curling:
        if reported := too_soft(share, f"in the {name} at {mm(place)}"):
            yield finding("wide_beam", reported + ("" if exact else hint), cure)


def _imperfect(solution: Solution) -> Iterator[Finding]:
    about, exact = solution.spec.mechanism.bistable, solution.spec.analysis.fidelity in TRACED
    share = about.waviness / about.thickness
    if share > WAVY or (about.waviness and not exact):
        reported = "is counted in" if exact else "is neglected: only 'analysis.fidelity: exact' includes it"
        effect = "; it rounds the peak and lowers the negative stiffness" if share > WAVY else ""
        yield finding(
            "imperfection", f"waviness of {mm(about.waviness)}, {percent(share)} of the thickness, {reported}{effect}"
        )
    push = solution.nominal
    if not push.leaves.stable.all():
        lost = push.travel[~push.leaves.stable]
        text = f"from {mm(float(lost[0]))} to {mm(float(lost[-1]))} the leaves are unstable and snap to another shape"
        if solution.spec.analysis.branch == "stable":
            yield finding("unstable_branch", f"{text}, which was not found")
        else:
            follow = "analysis.branch: stable follows them"
            yield finding("unstable_branch", f"{text}: {follow}", "analysis.branch=stable")


def _range(solution: Solution) -> Iterator[Finding]:
    strip = solution.parts.strip
    share = float(strip.thickness / strip.length)
    if share > STOCKY and solution.spec.analysis.fidelity != "truss":
        yield finding(
            "theory_range",
            f"leaves whose thickness is {percent(share)} of their length are not beams: no model here predicts "
            "their force or stress; use longer or thinner leaves",
        )
        return
    if solution.spec.analysis.fidelity != "analytic":
        return
    angle, reach = float(strip.angle), RELIABLE * solution.parts.balance
    if isinstance(solution.parts.leaf, HybridLeaf):
        much = (
            f"with a rise of {float(strip.slenderness):.3g} flexure thicknesses and an axial force of up to "
            f"{percent(solution.parts.leaf.crushing)} of the flexures' own buckling load these bend and buckle, which "
            "pseudo-rigid bodies cannot: the force is overestimated, by up to several times"
            if solution.parts.leaf.flexures_buckle
            else "the pseudo-rigid-body model gives the force of hybrid leaves to about 10 %, up to the peak only"
        )
        yield finding(
            "theory_range",
            f"{much}; their stress is underestimated, by up to a half. Verify with 'analysis.fidelity: exact'",
            "analysis.fidelity=exact",
        )
    elif share > THICK:
        yield finding(
            "theory_range",
            f"the thickness of the leaves is {percent(share)} of their length: the closed forms are for thin leaves, "
            "and are off by 5 to 10 % or more here; verify with 'analysis.fidelity: exact'",
            "analysis.fidelity=exact",
        )
    elif angle > STEEP:
        yield finding(
            "theory_range",
            f"leaves at {degrees(angle):.3g} deg: the closed forms hold for small angles, up to 15 deg; "
            "verify with 'analysis.fidelity: exact'",
            "analysis.fidelity=exact",
        )
    elif goes_beyond(solution.nominal.travel[-1], reach):
        yield finding(
            "theory_range",
            f"the travel goes to {mm(float(solution.nominal.travel[-1]))}, beyond {RELIABLE} times the rise "
            f"({mm(reach)}): the force there is off by several per cent; verify with 'analysis.fidelity: exact'",
            "analysis.fidelity=exact",
        )
    yield from _spring_range(solution)


def _spring_range(solution: Solution) -> Iterator[Finding]:
    spring = solution.parts.spring
    if not isinstance(spring, Diamond):
        return
    angle, length = float(spring.strip.angle), float(spring.strip.length)
    ends = [push.preload + float(place) for push in solution.pushes for place in (push.travel[0], push.travel[-1])]
    worst = max(ends, key=lambda end: end / PRESSED if end > 0 else -end / STRETCHED)
    share = abs(worst) / (2.0 * length)
    if angle > STEEP:
        text = f"the leaves of the spring are at {degrees(angle):.3g} deg: its stiffness changes with its compression"
    elif share > (PRESSED if worst > 0 else STRETCHED):
        what = "compressed" if worst > 0 else "stretched"
        text = f"the spring is {what} by {mm(abs(worst))}, each leaf by {percent(share)} of its length"
    else:
        return
    yield finding(
        "theory_range",
        f"{text}; the closed form's constant stiffness is off by several per cent: verify with "
        "'analysis.fidelity: exact'",
        "analysis.fidelity=exact",
    )


def spring_closed(solution: Solution) -> Iterator[Finding]:
    """Yield that the spring is pressed together, with the travel up to which the worst preload leaves it open."""
    spec, room = solution.spec, spring_room(solution.spec)
    most = max(spec.analysis.preloads)
    if most + spec.travel <= room * (1 + ROUNDING):
        return
    positive, bought, needed = spec.mechanism.positive, spec.mechanism.springs, most + spec.travel - room
    place = f"at {mm(room - most)} of the travel" if room > most else "before the shuttle moves"
    meeting = "blocks" if bought is None else "turns"
    if bought is not None:
        key, size = "mechanism.springs.free_length", at_least(closed_length(bought) + most + spec.travel)
    elif positive is None:
        return
    elif positive.structure == "diamond":
        key, size = "mechanism.frame.corner", at_least(spec.mechanism.frame.corner + needed)
    else:
        key, size = "mechanism.positive.radius", at_least(float(positive.radius or 0.0) + 0.5 * needed)
    yield finding(
        "spring_closed",
        f"the spring closes: its {meeting} touch when it is compressed by {mm(room)}, with a preload of {mm(most)} "
        f"{place}, and curves end there; use less preload ('analysis.preloads') or travel ('analysis.travel'), or "
        f"'{key}' of {size}",
        f"{key}={size}",
    )


def _truss(solution: Solution) -> Iterator[Finding]:
    if solution.spec.analysis.fidelity != "truss":
        return
    law, places = VBeam(solution.parts.strip), np.linspace(0.0, 1.0, 401) * float(solution.parts.strip.rise)
    bars, leaves = np.asarray(solution.parts.leaf.force(places)), law.force(places)
    high, where = bars.max() / leaves.max() - 1.0, places[bars.argmax()] / places[leaves.argmax()]
    steep = float(solution.parts.leaf.negative_stiffness / law.negative_stiffness) if law.negative_stiffness else np.inf
    yield finding(
        "truss_law",
        f"the paper's laws include neither buckling nor clamping: compared with the corrected laws the peak of the "
        f"leaves is {percent(high)} higher, at {where:.2g} times the travel, their steepest slope is {steep:.2g} times "
        "as steep, and with a spring the force is never flat",
        "analysis.fidelity=analytic",
    )


def _measured(solution: Solution) -> Iterator[Finding]:
    reported = solution.spec.analysis.measured
    if reported is None or float(solution.parts.strip.slenderness) < FLAT_BUCKLED_ABOVE:
        return
    if solution.spec.mechanism.bistable.structure == "hybrid":  # whose flexures push where it is flat
        return
    balance = float(solution.parts.balance)
    there, needed = reported.positive_stiffness * balance, measured_stiffness_for(reported.force, balance)
    if abs(there / reported.force - 1.0) > solution.spec.analysis.flatness:
        yield finding(
            "measured_contradiction",
            f"the reported {newton(reported.force)} and K_p = {rate(reported.positive_stiffness)} "
            f"contradict each other: at {mm(balance)} the leaves carry no force, "
            f"for any number, width or modulus, and the force is K_p h = {newton(there)}; "
            f"{newton(reported.force)} needs {rate(needed)}",
        )
