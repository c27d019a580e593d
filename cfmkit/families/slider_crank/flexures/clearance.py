"""Whether a pressed chain has room: it can neither cross itself nor be pressed through its own anchor.

Beams are lines to the equations, which know nothing of contact: a slider that runs on the line of its anchor passes it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank.flexures.pressing import Ending, Pressed, part_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Path

COARSE = 60
"""Straight pieces of the line that are looked at for crossings."""


def kept_clear(pressed: Pressed, thickness: float) -> Pressed:
    """Return the outcome up to where the chain meets its anchor, or itself.

    Parameters
    ----------
    pressed : Pressed
        Any outcome.
    thickness : float
        At the ends of the chain [m]: nearer than this the slider's end touches the anchor.
    """
    places = pressed.path.at_asked.tolist()
    if not places:
        return pressed
    lines = [_line(pressed.path, at) for at in places]
    for number, line in enumerate(lines):
        what = _met(line, lines[0][-1], thickness)
        if what:
            at = pressed.path.drive[places[number]] * 1e3
            text = f"at {at:.4g} mm the chain {what}: no such part exists from there on; end 'analysis.travel' before"
            kept = part_of(pressed.path, np.isin(np.arange(len(pressed.path.drive)), places[:number]))
            return replace(pressed, path=kept, ending=Ending.BLOCKED, message=text)
    return pressed


def _line(path: Path, index: int) -> FloatArray:
    """Return the line of a chain from its anchor to its slider, (n, 2) [m]."""
    shapes = [path.shape(name, index) for name in path.layout.network.beams]
    line: FloatArray = np.concatenate(shapes)
    return line


def _met(line: FloatArray, start: FloatArray, thickness: float) -> str:
    """Return what a chain meets; nothing while it is clear."""
    anchor, end = line[0], line[-1]
    way = end - start
    share = float(np.clip((anchor - start) @ way / max(float(way @ way), 1e-300), 0.0, 1.0))
    if np.hypot(*(start + share * way - anchor)) < thickness:
        return "is pressed through its own anchor"
    rows = np.unique(np.linspace(0, len(line) - 1, COARSE + 1).astype(int))
    return "crosses itself" if _crosses(line[rows]) else ""


def _crosses(line: FloatArray) -> bool:
    """Return whether two pieces of a line cross that are not neighbours."""
    first, last = line[:-1], line[1:]
    step = last - first
    # what is straight but for rounding crosses nothing
    slack = 1e-9 * float(np.ptp(line, axis=0).max()) * np.hypot(*step.T)[:, None]

    def sides(points: FloatArray) -> FloatArray:
        """Return on which side of each piece (rows) points lie (columns): 1, -1, or 0 for on it."""
        away = points[None] - first[:, None]
        left = step[:, None, 0] * away[..., 1] - step[:, None, 1] * away[..., 0]
        return np.where(np.abs(left) > slack, np.sign(left), 0.0)

    parted: NDArray[np.bool_] = sides(first) * sides(last) < 0.0
    apart = np.abs(np.subtract.outer(np.arange(len(first)), np.arange(len(first)))) > 1
    return bool((parted & parted.T & apart).any())
