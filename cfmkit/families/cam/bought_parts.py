"""Bought parts of a cam mechanism: springs, bearings and pins that the specification names or dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.families.findings import mm, newton, rate
from cfmkit.stock.parts_list import BoughtPart

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.cam.spec import CamSpec


def parts_of(spec: CamSpec) -> tuple[BoughtPart, ...]:
    """Return the bought parts; none where the specification names no spring, bearing or pin."""
    return tuple(_parts(spec))


def _parts(spec: CamSpec) -> Iterator[BoughtPart]:
    mechanism, springs = spec.mechanism, spec.mechanism.springs
    if not (springs.name or mechanism.bearings or mechanism.pins):
        return
    rates = springs.each if isinstance(springs.each, tuple) else (springs.each,)
    count = len(rates) if len(rates) > 1 else springs.count or 1
    limit = f", up to {mm(springs.max_elongation)}" if springs.max_elongation else ""
    opens = f", initial tension {newton(springs.initial_tension)}" if springs.initial_tension else ""
    tight = f", stretched by {mm(mechanism.preload)} at the start" if mechanism.preload else ""
    reported = " to ".join(dict.fromkeys((rate(min(rates)), rate(max(rates)))))
    yield BoughtPart(
        "between the rollers", springs.name or "", count, f"extension spring, {reported}{opens}{limit}{tight}"
    )
    if bearings := mechanism.bearings:
        rated = f", C {newton(bearings.dynamic_rating)}" if bearings.dynamic_rating else ""
        rated += f", C0 {newton(bearings.static_rating)}" if bearings.static_rating else ""
        data = f"{bearings.kind} bearing, bore {mm(bearings.bore)}{rated}"
        yield BoughtPart("in the rollers", bearings.name or "", 2 * bearings.per_roller, data)
    if pins := mechanism.pins:
        yield BoughtPart("slider pin and spring hooks", "", 3, f"pin, diameter {mm(pins.diameter)}")
