"""What the user of a printed slider-crank must know, with the numbers that decide."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import hindered_curling
from cfmkit.families.findings import at_most, mm, mpa, newton, too_soft
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import kink
from cfmkit.families.slider_crank.printed.scalar_results import stress_stroke

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.slider_crank.printed.solution import Solution
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.results import Finding


THINNEST_RATIO = 2.0
"""Width over thickness below which out-of-plane bending is less than four times as stiff as that in the plane."""

SIDE_SHARE = 0.5
"""Side force over force above which friction in the guide deserves a word."""

RUN_IN_SHARE = 0.1
"""Travel to 98 % of the force, as a share of all, above which the kink is called large."""


def findings_of(spec: SliderCrankSpec, solution: Solution) -> tuple[Finding, ...]:
    """Return everything worth a warning, the gravest first."""
    return tuple(
        (
            *_strength(solution),
            *_signs(solution),
            *_kink(spec, solution),
            *_making(spec, solution),
            *_width(spec, solution),
            *_guide(solution),
            *friction_left_out(spec),
        )
    )


def friction_left_out(spec: SliderCrankSpec) -> Iterator[Finding]:
    """Yield what to say of friction that is specified: a part of one piece has no pins, and its guide is ideal here."""
    stated = [f"'mechanism.{name}'" for name in ("pins", "guide") if getattr(spec.mechanism, name) is not None]
    if stated:
        yield finding(
            "friction_left_out",
            f"{' and '.join(stated)} {'applies' if len(stated) == 1 else 'apply'} only to the model with springs: the "
            "force of a one-piece part is computed without friction",
        )


def _strength(solution: Solution) -> Iterator[Finding]:
    limit = solution.material.allowable_stress
    place, _ = stress_stroke(solution)
    if limit is None or place is None or place >= solution.travel[-1]:
        return
    worst = int(np.argmax(solution.stress))
    yield finding(
        "overstressed",
        f"beyond {mm(place)} of travel the stress exceeds the allowable {mpa(limit)}; it reaches "
        f"{mpa(float(solution.stress[worst]))} at {mm(float(solution.travel[worst]))}, "
        f"{mm(float(solution.place[worst]))} along the part from its clamped end",
        f"analysis.travel=[{mm(float(solution.travel[0]))}, {at_most(place)}]",
    )


def _signs(solution: Solution) -> Iterator[Finding]:
    moved = solution.travel > 0.01 * solution.travel[-1]
    if (solution.force[moved] < 0).any():
        first = float(solution.travel[moved][solution.force[moved] < 0][0])
        yield finding("force_negative", f"from {mm(first)} on the chain pulls the slider towards the pivot")


def _kink(spec: SliderCrankSpec, solution: Solution) -> Iterator[Finding]:
    off = abs(kink(solution.chain.pins))
    if solution.chain.side == 0:
        yield finding(
            "straight_start",
            f"the chain is exactly straight: it carries {newton(float(solution.force[1]))} before it buckles, and a "
            "deviation of 0.1 um determines the side; state a kink of 0.25 to 0.5 mm with "
            "'mechanism.unloaded_offset'",
        )
        return
    resolved = spec.mechanism.resolved[0]
    if resolved is not None and off < resolved:
        yield finding(
            "kink_too_small",
            f"the kink of {mm(off)} that determines the buckling side is smaller than the process can make "
            f"({mm(resolved)}): the part may bend to the other side, with another force; 0.25 to 0.5 mm is safe",
        )
    run_in = solution.first_at(0.98 * solution.level)
    if run_in is not None and run_in > RUN_IN_SHARE * solution.travel[-1] and off > 1e-3 * solution.chain.length:
        yield finding(
            "long_run_in",
            f"with a kink of {mm(off)} the force needs {mm(run_in)} of travel to reach 98 % of its level; a smaller "
            "kink shortens it",
        )


def _making(spec: SliderCrankSpec, solution: Solution) -> Iterator[Finding]:
    thinnest = spec.mechanism.resolved[1]
    if thinnest is not None and solution.thinnest < thinnest:
        yield finding(
            "too_thin",
            f"the thinnest place is {mm(solution.thinnest)}, the process needs at least {mm(thinnest)}",
        )
    if solution.width_ratio < THINNEST_RATIO:
        yield finding(
            "lateral_buckling",
            f"the width is {solution.width_ratio:.3g} times the largest thickness: out of its plane the part bends "
            "nearly as easily as in it; guide it between plates, or make it wider",
        )


def _width(spec: SliderCrankSpec, solution: Solution) -> Iterator[Finding]:
    """Say by how much strip or flexures are too soft that are solved as narrow ones."""
    if spec.mechanism.wide_beams:
        return
    share = hindered_curling(solution.pressed.path).share[solution.pressed.path.at_requested]
    worst = int(share.argmax())
    if reported := too_soft(float(share[worst]), f"at {mm(float(solution.travel[worst]))}"):
        yield finding("wide_beam", reported, "mechanism.wide_beams=true")


def _guide(solution: Solution) -> Iterator[Finding]:
    share = np.abs(solution.side_force) / np.maximum(np.abs(solution.force), 1e-300)
    worst = int(np.argmax(np.abs(solution.side_force)))
    if share[worst] > SIDE_SHARE and solution.travel[worst] > 0:
        side = float(abs(solution.side_force[worst]))
        yield finding(
            "side_force",
            f"the guide carries up to {newton(side)} across the travel, {100 * share[worst]:.0f} % of the "
            f"force: friction of 0.1 there changes it by {newton(0.1 * side)}; a mirrored pair on one "
            "slider cancels it",
            "mechanism.copies=mirrored",
        )
