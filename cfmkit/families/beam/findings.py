"""Warnings of the beam family: of each its name, when it is raised, and its sentence with numbers."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica import PathStatus
from cfmkit.families.beam.constant_force_range_and_extremes import window_of
from cfmkit.families.beam.contacts import change_sentences, contact_sentences
from cfmkit.families.beam.finding_names import finding
from cfmkit.families.beam.largest_in_window import largest
from cfmkit.families.beam.network_from_spec import known_allowable_stresses, thickest_of
from cfmkit.families.beam.path_ending import add_units, drive_text, ending_of
from cfmkit.families.beam.scalar_results import find_in_window
from cfmkit.families.beam.solution import node_at, pairs_in_contact
from cfmkit.families.findings import describe_wide_beam, percent, wide_beam_in_short
from cfmkit.families.rows import FindingRule, findings_of_one
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.elastica.model.beam import Fit
    from cfmkit.families.beam.solution import Solution
    from cfmkit.families.beam.strips_and_gaps import BeamGap
    from cfmkit.results import Finding


LENGTH_RTOL = 1e-9  # share of a length: gaps, movements and errors of a thickness below it are rounding
SLENDERNESS_LIMIT = 10.0
"""Length over thickness at which shear makes a beam between two guided ends 3 % softer, 2.6/(5/6) (t/l)^2."""


Sentence = tuple[Any, ...]  # message, then cures


def _has_curve(solution: Solution) -> bool:
    return len(solution.keep) > 1


def _ends_early(solution: Solution) -> bool:
    return solution.path.status not in (PathStatus.COMPLETE, PathStatus.INACCURATE, PathStatus.BLOCKED)


def _early_ending(solution: Solution) -> Sentence:
    why = ending_of(solution)
    return (why.message, *why.cures)


ROUNDED_CLOSURE = 2e-6
"""Misfit that whole micrometres and thousandths of a degree leave in beams of some centimetres [m]."""

# --- closure --------------------------------------------------------------------------------------------------------


def _find_moved_nodes(solution: Solution) -> dict[str, float]:
    """Return the nodes that the closure "chain" moved, each with how far [m]."""
    if solution.spec.mechanism.closure != "chain":
        return {}
    nodes, least = solution.spec.mechanism.nodes, LENGTH_RTOL * solution.path.mesh.scales.length
    moved = {name: float(np.hypot(*(node_at(solution.path, name) - node.at))) for name, node in nodes.items()}
    return {name: displacement for name, displacement in moved.items() if displacement > least}


def _moved_guides(solution: Solution) -> list[str]:
    nodes = solution.spec.mechanism.nodes
    return [name for name in _find_moved_nodes(solution) if nodes[name].support in ("guided", "roller")]


def _moved_nodes(solution: Solution) -> Sentence:
    moved = _find_moved_nodes(solution).items()
    reported = ", ".join(f"{name} by {format_short(displacement, 'length')}" for name, displacement in moved)
    return (f"nodes were moved to where the beams end: {reported}",)


def _misfits(solution: Solution) -> dict[str, Fit]:
    """Return the fits of the beams that miss their nodes."""
    beams = solution.path.network.beams
    return {
        name: fit
        for name, fit in solution.path.fits.items()
        if name in solution.spec.mechanism.beams
        and getattr(beams[name].shape, "length", None)
        and fit.gap > LENGTH_RTOL * float(np.real(fit.length))
    }


def _has_raw_closure(solution: Solution) -> bool:
    return solution.spec.mechanism.closure == "raw"


def _is_adjusted(solution: Solution) -> bool:
    """Return True if a beam was fitted to nodes that it missed by more than lengths are rounded to."""
    return not _has_raw_closure(solution) and any(fit.gap > ROUNDED_CLOSURE for fit in _misfits(solution).values())


def _forced_beams(solution: Solution) -> Sentence:
    """Return the cost of forcing beams into place, in words."""
    gaps = ", ".join(f"{name} by {format_short(fit.gap, 'length')}" for name, fit in _misfits(solution).items())
    return (
        f"beams miss their nodes ({gaps}) and are forced into place: at rest the drive carries "
        f"{format_short(float(solution.effort[0]), solution.spec.mechanism.drive.effort_dimension)} and the stress is "
        f"{format_short(float(solution.stress[0]), 'stress')}; closure 'rotscale' avoids both",
        "mechanism.closure=rotscale",
    )


def _fitted_beams(solution: Solution) -> Sentence:
    """Return the fit of each beam, in words."""
    reported = ", ".join(
        f"{name} {format_short(float(np.real(fit.rotation)), 'angle')} and x {float(np.real(fit.scale)):.5f} "
        f"(it missed by {format_short(fit.gap, 'length')})"
        for name, fit in _misfits(solution).items()
    )
    return (f"beams were turned and scaled to fit between their nodes: {reported}",)


# --- events and stability -------------------------------------------------------------------------------------------


def _events(name: str, kind: str) -> FindingRule[Solution]:
    """Return the rule on limit points or bifurcations of the drive."""

    def places(solution: Solution) -> list[str]:
        return [drive_text(solution.assembly, event.drive) for event in solution.path.events if event.kind == kind]

    def sentence(solution: Solution) -> Sentence:
        events = places(solution)
        more = f" and {len(events) - 6} more" if len(events) > 6 else ""
        tail = _describe_bifurcation(solution) if kind == "bifurcation" else ""
        return (f"{kind}{'s' if len(events) > 1 else ''} at {', '.join(events[:6])}{more}{tail}",)

    return FindingRule(name, lambda solution: bool(places(solution)), sentence)


def _bifurcations_under(what: str) -> FindingRule[Solution]:
    """Return the rule on bifurcations under what is constant."""

    def shares(solution: Solution) -> list[str]:
        kind = f"bifurcation under {what}"
        return [percent(event.drive) for event in solution.path.events if event.kind == kind]

    def sentence(solution: Solution) -> Sentence:
        stays = solution.path.stable[:1].all()
        tail = _describe_bifurcation(solution) if stays else "; nothing stable was found beyond"
        return (f"bifurcation under {', '.join(shares(solution))} of the {what}{tail}",)

    return FindingRule("bifurcation", lambda solution: bool(shares(solution)), sentence)


def _describe_bifurcation(solution: Solution) -> str:
    """Return the course of the curve at a bifurcation, in words."""
    if (solution.path.branch[solution.keep] == "primary").all():
        return "; the curve stays on the primary path"
    side = "analysis.other_side=" + ("false" if solution.spec.analysis.other_side else "true")
    return f"; from there the curve follows the stable branch (its mirror image: --set {side})"


def _unstable_points(solution: Solution) -> Sentence:
    bad = ~solution.stable_equilibrium
    places = solution.motion[bad]
    low, high = (solution.describe_motion(float(end)) for end in (places.min(), places.max()))
    return (f"{int(bad.sum())} of {len(bad)} points are not stable while the drive is held, from {low} to {high}",)


def _misses_flutter(solution: Solution) -> bool:
    return solution.follows and len(solution.keep) > 0 and solution.frequencies is None


def _flutters(solution: Solution) -> bool:
    frequencies = solution.frequencies if solution.follows and len(solution.keep) else None
    return frequencies is not None and bool(frequencies.flutters.any())


def _growing_oscillations(solution: Solution) -> Sentence:
    assert solution.frequencies is not None
    first = int(solution.keep[int(solution.frequencies.flutters.argmax())])
    return (
        f"two natural frequencies have met at {drive_text(solution.assembly, float(solution.path.drive[first]))}: "
        "under forces that rotate with their node oscillations grow beyond",
    )


def _inaccurate_points(solution: Solution) -> Sentence:
    return (
        f"{int((~solution.accurate).sum())} of {len(solution.accurate)} points miss the tolerance of "
        f"{solution.spec.analysis.tolerance:g} and have no force (estimated error {solution.path.error:.2g})",
    )


def _bent_beams(solution: Solution) -> Sentence:
    reported = add_units(solution.assembly, solution.path.imperfection)
    if reported.startswith("none: "):
        return (f"the beams were not bent: {reported.removeprefix('none: ')}",)
    return (f"the beams were bent by {reported}",)


# --- stress ---------------------------------------------------------------------------------------------------------


def _beams_of_known_strength(solution: Solution) -> list[str]:
    strengths = known_allowable_stresses(solution.spec)
    return [name for name in solution.path.network.beams if name.split(".")[0] in strengths]


def _least_allowable_stress(solution: Solution) -> float:
    return min(known_allowable_stresses(solution.spec).values())


def _largest_stress(solution: Solution) -> float:
    """Return the largest stress in the window of beams whose strength is known, between points, too [Pa]; else 0."""
    names, beams = _beams_of_known_strength(solution), list(solution.path.network.beams)
    if not names or not _has_curve(solution):
        return 0.0
    axial, rows = solution.spec.stress == "total", [beams.index(name) for name in names]
    return largest(solution, lambda path: path.beam_stresses(axial)[0][rows], window_of(solution)) or 0.0


def _is_overstressed(solution: Solution) -> bool:
    largest = _largest_stress(solution)
    return largest > 0.0 and largest > _least_allowable_stress(solution)


def _too_large_stress(solution: Solution) -> Sentence:
    """Return where the stress in the window is too large, in words."""
    names, window, shown = _beams_of_known_strength(solution), window_of(solution), solution.with_ends
    inside = np.flatnonzero(find_in_window(shown, *window))
    values = np.array([shown.stresses[name][0] for name in names])
    if not len(inside):  # the window lies between two points: the nearer one tells the place
        inside = np.array([np.abs(shown.motion - 0.5 * sum(window)).argmin()])
    best, index = np.unravel_index(int(values[:, inside].argmax()), (len(names), len(inside)))
    place = float(shown.stresses[names[best]][1][inside[index]])
    return (
        f"the largest stress in the window is {format_short(_largest_stress(solution), 'stress')}, at {place:.3f} of "
        f"beam {names[best]}; the allowable stress is {format_short(_least_allowable_stress(solution), 'stress')}",
    )


# --- what beam theory leaves out, and what cannot be made -----------------------------------------------------------


def _thick_beam_rule(name: str) -> FindingRule[Solution]:
    def sizes(solution: Solution) -> tuple[float, float]:
        path = solution.path
        return float(np.real(path.fits[name].length)), thickest_of(path.network.beams[name].section)

    def is_short(solution: Solution) -> bool:
        length, thickness = sizes(solution)
        return length < SLENDERNESS_LIMIT * thickness

    def sentence(solution: Solution) -> Sentence:
        length, thickness = (format_short(size, "length") for size in sizes(solution))
        return (
            f"beam {name} is {length} long and {thickness} thick: below {SLENDERNESS_LIMIT:g} times the thickness beam "
            "theory is inaccurate",
        )

    def short(solution: Solution) -> str:
        length, thickness = sizes(solution)
        return f"beam {name} is only {length / thickness:.2g} times as long as thick: beam theory is inaccurate"

    return FindingRule("thick_beam", is_short, sentence, short)


def _hindered_share(solution: Solution) -> tuple[float, str]:
    """Return by what share of their energy beams that are solved as narrow ones are too soft, and where."""
    if not _has_curve(solution) or solution.spec.mechanism.wide_beams:
        return 0.0, ""
    curling = solution.curling
    share, beam = curling.share[solution.keep], curling.beam[solution.keep]
    worst = int(share.argmax())
    place = solution.describe_motion(float(solution.motion[worst]))
    return float(share[worst]), f"at {place}, most of it in beam {beam[worst]}"


def _wide_beams(solution: Solution) -> Sentence:
    wide, narrow = "mechanism.wide_beams=true", solution.spec.analysis.modes  # frequencies are of narrow beams only
    return describe_wide_beam(*_hindered_share(solution)), (wide, "analysis.modes=0") if narrow else wide


def _overlaps(gap: BeamGap | None) -> bool:
    return gap is not None and gap.size <= 0


def _touching_beams(solution: Solution) -> Sentence:
    still, moving = solution.gaps
    assert moving is not None
    when = "before any load" if _overlaps(still) else "during the travel"
    if frozenset((moving.first, moving.second)) in pairs_in_contact(solution.path.network):
        return (f"beams {moving.first} and {moving.second} overlap {when}, beside their contact that is stated",)
    remedy = "" if moving.second.endswith("'") else "; state it in 'mechanism.contacts'"
    return (f"beams {moving.first} and {moving.second} touch {when}: contact is not modelled{remedy}",)


def _least_gap(solution: Solution) -> float:
    """Return the smallest gap that can be cut [m], 0 where nothing is said of how the part is made."""
    mechanism = solution.spec.mechanism
    return 0.0 if mechanism.part is None else max(mechanism.part.min_gap, 2 * mechanism.fillet)


def _has_small_gap(solution: Solution) -> bool:
    gap = solution.gaps[0]
    return solution.spec.mechanism.part is not None and gap is not None and gap.size < _least_gap(solution)


def _small_gap(solution: Solution) -> Sentence:
    gap = solution.gaps[0]
    assert gap is not None
    return (
        f"the gap between beams {gap.first} and {gap.second} is {format_short(gap.size, 'length')}: smaller than can "
        f"be cut ({format_short(_least_gap(solution), 'length')})",
    )


def _thin_beam_rule(name: str) -> FindingRule[Solution]:
    def least(solution: Solution) -> float:
        part = solution.spec.mechanism.part
        if part is None or not _has_curve(solution):
            return 0.0
        return max((part.process and part.process.thinnest) or 0.0, part.min_feature)

    def thickness(solution: Solution) -> float:
        return solution.path.network.beams[name].section.thinnest

    def sentence(solution: Solution) -> Sentence:
        thin, made = (format_short(size, "length") for size in (thickness(solution), least(solution)))
        return (f"beam {name} is {thin} thick: less than can be made ({made})",)

    return FindingRule(
        "feature_small", lambda solution: thickness(solution) < least(solution) * (1 - LENGTH_RTOL), sentence
    )


# --- table ----------------------------------------------------------------------------------------------------------

FINDING_RULES: tuple[FindingRule[Solution], ...] = (
    FindingRule("ends_early", _ends_early, _early_ending),
    FindingRule("closure_adjusted", lambda solution: bool(_find_moved_nodes(solution)), _moved_nodes),
    FindingRule(
        "closure_adjusted",
        lambda solution: bool(_moved_guides(solution)),
        lambda solution: (f"the guides of moved nodes were moved with them: {', '.join(_moved_guides(solution))}",),
    ),
    FindingRule(
        "closure_prestress",
        lambda solution: _has_raw_closure(solution) and len(solution.keep) > 0 and bool(_misfits(solution)),
        _forced_beams,
    ),
    FindingRule("closure_adjusted", _is_adjusted, _fitted_beams),
    _events("limit_point", "limit point"),
    _events("bifurcation", "bifurcation"),
    _bifurcations_under("prestress"),
    _bifurcations_under("constant loads"),
    FindingRule("unstable", lambda solution: (~solution.stable_equilibrium).any(), _unstable_points),
    FindingRule(
        "flutter_not_judged",
        _misses_flutter,
        lambda _: (
            "forces rotate with their node: 'stable' covers divergence only; to check flutter, give every material a "
            "density",
        ),
    ),
    FindingRule("flutter", _flutters, _growing_oscillations),
    FindingRule("inaccurate", lambda solution: (~solution.accurate).any(), _inaccurate_points),
    FindingRule("imperfection", lambda solution: bool(solution.path.imperfection), _bent_beams),
    FindingRule(
        "overstressed",
        _is_overstressed,
        _too_large_stress,
        lambda solution: (
            f"{format_short(_largest_stress(solution), 'stress')} in the window, "
            f"{format_short(_least_allowable_stress(solution), 'stress')} allowed"
        ),
    ),
)
"""Of all mechanisms, in the order in which they are shown."""
LAST_RULES: tuple[FindingRule[Solution], ...] = (
    FindingRule(
        "wide_beam",
        lambda solution: bool(describe_wide_beam(*_hindered_share(solution))),
        _wide_beams,
        lambda solution: wide_beam_in_short(_hindered_share(solution)[0]),
    ),
    FindingRule("beams_touch", lambda solution: _overlaps(solution.gaps[1]), _touching_beams),
    FindingRule("gap_small", _has_small_gap, _small_gap),
)


def rules_of(solution: Solution) -> tuple[FindingRule[Solution], ...]:
    """Return everything that may be wrong with a solved mechanism: of its beams, too."""
    beams = solution.path.network.beams
    return (*FINDING_RULES, *map(_thick_beam_rule, beams), *LAST_RULES, *map(_thin_beam_rule, beams))


def findings_of(solution: Solution) -> Iterator[Finding]:
    """Yield everything that is wrong with a solved mechanism, or that the user must know about it."""
    yield from findings_of_one(rules_of(solution), finding, solution)
    say = partial(drive_text, solution.assembly)
    for name, message in contact_sentences(solution, say):
        yield finding(name, message)
    for name, message in change_sentences(solution.back, say) if solution.back is not None else ():
        yield finding(name, f"on the way back: {message}")
