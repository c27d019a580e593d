"""What the user must know about a solved beam mechanism, each with the numbers that decide."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import PathStatus
from cfmkit.families.beam.build import thickest_of, thinnest_of
from cfmkit.families.beam.endings import ending_of
from cfmkit.families.beam.findings import finding
from cfmkit.families.beam.values import window_of, within
from cfmkit.families.beam.words import drive_text, in_units, percent
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.beam.model import Solution
    from cfmkit.results import Finding

NEGLIGIBLE = 1e-9
THICK = 10.0


def findings_of(solution: Solution) -> tuple[Finding, ...]:
    """Return everything that is wrong with a solved mechanism, or that the user must know about it."""
    return tuple(
        one
        for source in (
            _ending, _closure, _events, _stability, _accuracy, _imperfection, _stress, _slenderness, _gaps,
        )
        for one in source(solution)
    )  # fmt: skip


def _ending(solution: Solution) -> Iterator[Finding]:
    path = solution.path
    if path.status not in (PathStatus.COMPLETE, PathStatus.INACCURATE):
        why = ending_of(solution)
        yield finding("ends_early", why.message, *why.cures)


def _closure(solution: Solution) -> Iterator[Finding]:
    """Say how each beam was fitted, or what it costs to force it."""
    if moved := _moved(solution):
        yield finding("closure_adjusted", f"nodes were moved to where the beams end: {', '.join(moved)}")
        nodes = solution.spec.mechanism.nodes
        guided = [one.split(" ")[0] for one in moved if nodes[one.split(" ")[0]].support in ("guided", "roller")]
        if guided:
            yield finding(
                "closure_adjusted", f"the guides of nodes that were carried along went with them: {', '.join(guided)}"
            )
    beams = solution.path.layout.network.beams
    fits = {
        name: one
        for name, one in solution.path.fits.items()
        if name in solution.spec.mechanism.beams
        and getattr(beams[name].shape, "length", None)
        and one.gap > NEGLIGIBLE * float(np.real(one.length))
    }
    if not fits:
        return
    if solution.spec.mechanism.closure == "raw":
        if not len(solution.keep):
            return
        gaps = ", ".join(f"{name} by {format_short(one.gap, 'length')}" for name, one in fits.items())
        yield finding(
            "closure_prestress",
            f"beams miss their nodes ({gaps}) and are forced into place: at rest the drive carries "
            f"{format_short(float(solution.effort[0]), _effort(solution))} and the stress is "
            f"{format_short(float(solution.stress[0]), 'stress')}; closure 'rotscale' has none of this",
            "mechanism.closure=rotscale",
        )
        return
    told = ", ".join(
        f"{name} {format_short(float(np.real(one.rotation)), 'angle')} and x {float(np.real(one.scale)):.5f} "
        f"(it missed by {format_short(one.gap, 'length')})"
        for name, one in fits.items()
    )
    yield finding("closure_adjusted", f"beams were turned and scaled to fit between their nodes: {told}")


def _moved(solution: Solution) -> list[str]:
    """Return the nodes that the closure "chain" moved, each with how far."""
    if solution.spec.mechanism.closure != "chain":
        return []
    layout, found = solution.path.layout, []
    for name, node in solution.spec.mechanism.nodes.items():
        way = float(np.hypot(*(np.real(np.array(layout.position(name))) - node.at)))
        if way > NEGLIGIBLE * layout.scales.length:
            found.append(f"{name} by {format_short(way, 'length')}")
    return found


def _effort(solution: Solution) -> str:
    return "torque" if solution.spec.mechanism.drive.kind in ("rotation", "moment") else "force"


def _events(solution: Solution) -> Iterator[Finding]:
    path = solution.path
    for kind, name in (("limit point", "limit_point"), ("bifurcation", "bifurcation")):
        places = [drive_text(solution.assembly, event.drive) for event in path.events if event.kind == kind]
        if places:
            more = f" and {len(places) - 6} more" if len(places) > 6 else ""
            tail = _after(solution) if kind == "bifurcation" else ""
            yield finding(name, f"{kind}{'s' if len(places) > 1 else ''} at {', '.join(places[:6])}{more}{tail}")
    for what in ("prestress", "constant loads"):
        shares = [percent(event.drive) for event in path.events if event.kind == f"bifurcation under {what}"]
        if shares:
            tail = "; nothing stable was found beyond" if not path.stable[:1].all() else _after(solution)
            yield finding("bifurcation", f"bifurcation under {', '.join(shares)} of the {what}{tail}")


def _after(solution: Solution) -> str:
    """Say where the curve goes at a bifurcation."""
    if (solution.path.branch[solution.keep] == "primary").all():
        return "; the curve stays on the path it came on"
    side = "analysis.other_side=" + ("false" if solution.spec.analysis.other_side else "true")
    return f"; from there the curve follows the stable branch (its mirror image: --set {side})"


def _stability(solution: Solution) -> Iterator[Finding]:
    bad = ~solution.path.stable[solution.keep]
    if bad.any():
        x = solution.motion[bad]
        dimension = "angle" if _effort(solution) == "torque" else "length"
        yield finding(
            "unstable",
            f"{int(bad.sum())} of {len(bad)} points are not stable while the drive is held, from "
            f"{format_short(float(x.min()), dimension)} to {format_short(float(x.max()), dimension)}",
        )
    if not solution.follows or not len(solution.keep):
        return
    if solution.frequencies is None:
        yield finding(
            "flutter_not_judged",
            "forces turn with their node: what is called stable does not diverge; flutter depends on masses: give "
            "every material a density",
        )
    elif solution.frequencies.flutters.any():
        first = int(solution.keep[int(solution.frequencies.flutters.argmax())])
        yield finding(
            "flutter",
            f"two natural frequencies have met at {drive_text(solution.assembly, float(solution.path.drive[first]))}: "
            "under forces that turn with their node it swings ever wider",
        )


def _accuracy(solution: Solution) -> Iterator[Finding]:
    bad = int((~solution.accurate).sum())
    if bad:
        yield finding(
            "inaccurate",
            f"{bad} of {len(solution.accurate)} points miss the tolerance of {solution.spec.analysis.tolerance:g} and "
            f"have no force (estimated error {solution.path.error:.2g})",
        )


def _imperfection(solution: Solution) -> Iterator[Finding]:
    told = in_units(solution.assembly, solution.path.imperfection)
    if told.startswith("none: "):
        yield finding("imperfection", f"the beams were not bent: {told.removeprefix('none: ')}")
    elif told:
        yield finding("imperfection", f"the beams were bent by {told}")


def _stress(solution: Solution) -> Iterator[Finding]:
    allowable = solution.assembly.allowable_stress
    if allowable is None or len(solution.keep) < 2:
        return
    inside = within(solution, *window_of(solution))
    if not inside.any() or (worst := float(solution.stress[inside].max())) <= allowable:
        return
    index = int(np.flatnonzero(inside)[solution.stress[inside].argmax()])
    beam, place = solution.stress_at[0][index], solution.stress_at[1][index]
    yield finding(
        "overstressed",
        f"the largest stress in the window is {format_short(worst, 'stress')}, at {place:.3f} of beam "
        f"{beam}; allowable are {format_short(allowable, 'stress')}",
    )


def _slenderness(solution: Solution) -> Iterator[Finding]:
    beams, fits = solution.path.layout.network.beams, solution.path.fits
    for name, beam in beams.items():
        thickest = thickest_of(beam.section)
        length = float(np.real(fits[name].length))
        if length < THICK * thickest:
            yield finding(
                "thick_beam",
                f"beam {name} is {format_short(length, 'length')} long and {format_short(thickest, 'length')} thick: "
                f"below {THICK:g} times the thickness beam theory is rough",
            )


def _gaps(solution: Solution) -> Iterator[Finding]:
    """Say where beams touch, and what cannot be cut."""
    if len(solution.keep) < 2:
        return
    still, moving = solution.gaps
    part = solution.spec.mechanism.part
    if moving is not None and moving.size <= 0:
        when = "before any load" if still is not None and still.size <= 0 else "on the way"
        yield finding("beams_touch", f"beams {moving.one} and {moving.other} touch {when}: contact is not modelled")
    if part is None:
        return
    least = max(part.min_gap, 2 * part.fillet)
    if still is not None and still.size < least:
        yield finding(
            "gap_small",
            f"the gap between beams {still.one} and {still.other} is {format_short(still.size, 'length')}: smaller "
            f"than can be cut ({format_short(least, 'length')})",
        )
    for name, beam in solution.path.layout.network.beams.items():
        thinnest = thinnest_of(beam.section)
        if thinnest < part.min_feature:
            yield finding(
                "feature_small",
                f"beam {name} is {format_short(thinnest, 'length')} thick: less than can be made "
                f"({format_short(part.min_feature, 'length')})",
            )
