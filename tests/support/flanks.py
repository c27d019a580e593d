"""Measured points of the published cam with stated errors, made by formulas; lengths in m."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from cam_support import cam

from cfmkit.families.cam import assemble
from cfmkit.families.cam.geometry import DesignFlank
from cfmkit.numerics import turn_points

MOVE = np.radians(0.3), np.array([1.5e-3, -0.8e-3])
"""The rigid motion of the reference note's case; its inverse is -0.3 deg, (-1.49579067, 0.80784298) mm."""


def profile() -> Any:
    return assemble(cam()).profile


def flanks() -> tuple[DesignFlank, DesignFlank]:
    cut = profile()
    return DesignFlank(cut, 1.0), DesignFlank(cut, -1.0)


def parameters(count: int = 300, first: float = 15.5e-3, last: float = 165e-3) -> np.ndarray:
    """Path coordinates of points at even heights on the flank: the lower 150 mm, every half millimetre."""
    cut = profile()
    dense = np.linspace(cut.start, cut.end, 40_001)
    return np.interp(np.linspace(first, last, count), cut.flank(dense)[1], dense)


@dataclass(frozen=True)
class Errors:
    """What is wrong with a cam that was cut: waviness (amplitude, length), offset outward, noise of the measurement."""

    waviness: float = 0.0
    length: float = 20e-3
    offset: float = 0.0
    noise: float = 0.0
    seed: int = 0


def measured(errors: Errors | None = None, move=MOVE) -> list[np.ndarray]:
    """Points on both flanks with those errors along the normal, moved as a whole."""
    errors = errors or Errors()
    rng = np.random.default_rng(errors.seed)
    u, found = parameters(), []
    for number, flank in enumerate(flanks()):
        at = flank.frame(u)
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(at.points, axis=0).T))])
        error = errors.offset + errors.waviness * np.sin(2 * np.pi * along / errors.length + number)
        points = at.points + error[:, None] * at.normals + errors.noise * rng.normal(size=at.points.shape)
        found.append(turn_points(points, *move))
    return found
