"""Bought parts of a cam mechanism, in words: its springs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.families.findings import mm, newton, rate

if TYPE_CHECKING:
    from cfmkit.families.cam.spec import Mechanism


def springs_in_words(mechanism: Mechanism) -> str:
    """Return what the springs between the rollers must be."""
    springs = mechanism.springs
    rates = springs.each if isinstance(springs.each, tuple) else (springs.each,)
    limit = f", up to {mm(springs.max_elongation)}" if springs.max_elongation else ""
    opens = f", initial tension {newton(springs.initial_tension)}" if springs.initial_tension else ""
    tight = f", stretched by {mm(mechanism.preload)} at the start" if mechanism.preload else ""
    reported = " to ".join(dict.fromkeys((rate(min(rates)), rate(max(rates)))))
    return f"extension spring, {reported}{opens}{limit}{tight}"
