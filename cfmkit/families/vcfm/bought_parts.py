"""What is bought for a mechanism of snap-through leaves: its springs, where they are no structure of leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.families.findings import mm, newton, rate
from cfmkit.stock.parts import Part

if TYPE_CHECKING:
    from cfmkit.families.vcfm.spec import VcfmSpec


def parts_of(spec: VcfmSpec) -> tuple[Part, ...]:
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
    place = "below the shuttle" if springs.kind == "compression" else "above the shuttle"
    return (Part(place, springs.name or "", springs.count, ", ".join(data)),)
