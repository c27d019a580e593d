"""What a process errs in on a cam mechanism."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cfmkit.families.cam.spec import CamSpec

PLACES = "mechanism.brace_length", "mechanism.rest_half_width", "mechanism.roller_radius"
"""Holes of the braces and the slider, and the contour: one that lies farther out by e meets a roller larger by e."""


def errors(_spec: CamSpec) -> dict[str, str]:
    """Return which values a process errs in: where holes and the contour lie; springs are bought."""
    return dict.fromkeys(PLACES, "position")
