"""What is bought for a mechanism of snap-through leaves: its springs, where they are no structure of leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.families.findings import mm, newton, rate
from cfmkit.stock.parts_list import BoughtPart
from cfmkit.stock.springs.guides import guide_cure, guide_needed, guide_words

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.families.vcfm.spec import VcfmSpec


def parts_of(spec: VcfmSpec) -> tuple[BoughtPart, ...]:
    """Return the bought parts; none where the spring is a structure of leaves."""
    springs = spec.mechanism.springs
    if springs is None:
        return ()
    data = [f"{springs.kind} spring, {rate(springs.rate)}"]
    if springs.initial_tension:
        data.append(f"initial tension {newton(springs.initial_tension)}")
    if springs.max_elongation:
        data.append(f"up to {mm(springs.max_elongation)}")
    if springs.free_length:
        data.append(f"{mm(springs.free_length)} relaxed")
    if wire := springs.wound:
        data.append(f"wire {mm(wire.wire)}, mean coil {mm(wire.coil)}, {wire.turns:g} turns")
    data += guide_words(springs)
    place = "below the shuttle" if springs.kind == "compression" else "above the shuttle"
    return (BoughtPart(place, springs.name or "", springs.count, ", ".join(data)),)


def spring_faults(solution: Solution) -> Iterator[tuple[str, ...]]:
    """Yield (name, what is wrong, settings that cure it) of bought springs over the travel and all preloads."""
    springs = solution.spec.mechanism.springs
    if springs is None:
        return
    worst = max(solution.pushes, key=lambda push: push.preload)
    most, limit = float(worst.travel[-1]) + worst.preload, springs.max_elongation
    if limit and most > limit * (1 + 1e-9):
        place = f"at {mm(limit - worst.preload)} of travel" if limit > worst.preload else "by the preload alone"
        yield (
            "spring_overstretched",
            f"with a preload of {mm(worst.preload)} the springs are deflected by {mm(most)}, their limit is "
            f"{mm(limit)}, reached {place} ('mechanism.springs.max_elongation')",
        )
    if not springs.is_guided and most > springs.unguided * (1 + 1e-9):
        yield (
            "spring_buckles",
            f"a spring of {mm(springs.free_length or 0.0)} buckles when it is deflected by {mm(springs.unguided)} "
            f"(ends {springs.seats}), and is deflected by {mm(most)} with a preload of {mm(worst.preload)}; "
            f"{guide_needed(springs, springs.coil, 'mechanism.springs')}",
            *guide_cure(springs.coil, "mechanism.springs"),
        )
    least = min(push.preload for push in solution.pushes)
    if least < 0:
        yield (
            "spring_slack",
            f"with a preload of {mm(least)} the springs carry no force up to {mm(-least)} of travel: bought springs do "
            "not pull back",
        )
