"""Synthetic test-rig recordings with a stated generator; nothing here was measured. Lengths in mm, forces in N."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit import Recording

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

SPEED, RATE, SAMPLES = 500 / 60, 35.0, 1008
"""mm/s, Hz and points per branch of the reference case."""


def reference_case() -> Recording:
    """F = 50 + .4 sin(2 pi s/30) +- (.3 + .003 s) + .25 sin(2 pi 9 t), 0 to 240 mm and back at 500 mm/min, 35 Hz."""
    k = np.arange(1, SAMPLES + 1)
    time = np.concatenate([k / RATE, SAMPLES / RATE + k / RATE])
    motion = np.concatenate([SPEED * k / RATE, 240.0 - SPEED * k / RATE])
    way = np.repeat([1.0, -1.0], SAMPLES)
    force = (
        50.0
        + 0.4 * np.sin(2 * np.pi * motion / 30)
        + way * (0.3 + 0.003 * motion)
        + 0.25 * np.sin(2 * np.pi * 9 * time)
    )
    return Recording("reference", motion * 1e-3, force, time)


def triangle(cycles: int = 1, points: int = 200, stroke: float = 100.0) -> np.ndarray:
    """Displacement 0 -> stroke -> 0, `cycles` times, `points` steps a way [mm]."""
    up = np.linspace(0.0, stroke, points + 1)
    one = np.concatenate([up, up[-2::-1]])
    return np.concatenate([one, *[one[1:]] * (cycles - 1)])


def rows(
    columns: Sequence[np.ndarray], separator: str = ";", decimal: str = ".", digits: int = 4, end: str = "\n"
) -> str:
    """Lines of numbers as a machine writes them."""
    lines = [
        separator.join(f"{value:.{digits}f}".replace(".", decimal) for value in row)
        for row in zip(*columns, strict=True)
    ]
    return end.join(lines) + end


def loop_columns(points: int = 60) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s], displacement [mm] and force [N] of a plain loop with half a newton of friction."""
    motion = triangle(1, points)
    time = 0.1 * np.arange(len(motion))
    way = np.where(np.arange(len(motion)) <= points, 1.0, -1.0)
    return time, motion, 50.0 + 0.5 * way + 0.01 * motion


def csv_text(header: str = "t [s];s [mm];F [N]", change: Callable[[int, list[str]], list[str]] | None = None) -> str:
    """A well-formed file, or one whose lines are changed: ``change(index, cells) -> cells``."""
    lines = [line.split(";") for line in rows(loop_columns()).splitlines()]
    changed = [change(index, line) for index, line in enumerate(lines)] if change else lines
    return header + "\n" + "\n".join(";".join(line) for line in changed) + "\n"


def lossy_loop(
    motion: np.ndarray, gap: float = 1.0, elastic: float = 0.0, decay: bool = False, noise: float = 0.0, seed: int = 0
) -> Recording:
    """A force of 50 N with a ripple of 0.3 N over 30 mm, and friction that turns its sign over `elastic` mm.

    Without `elastic` the sample at a reversal already has the sign of the way back. With `decay` the
    sign turns exponentially, to 2 % after `elastic`; else linearly.
    """
    step = np.diff(motion, append=motion[-2])
    sign = np.sign(step)
    if elastic:
        sign[0] = -1.0
        for k in range(1, len(motion)):
            way = np.sign(motion[k] - motion[k - 1])
            moved = abs(motion[k] - motion[k - 1]) / elastic
            sign[k] = way + (sign[k - 1] - way) * np.exp(-4.0 * moved) if decay else sign[k - 1] + way * 2.0 * moved
            sign[k] = np.clip(sign[k], -1.0, 1.0)
    force = 50.0 + 0.3 * np.sin(2 * np.pi * motion / 30.0) + 0.5 * gap * sign
    force = force + (np.random.default_rng(seed).normal(0.0, noise, len(force)) if noise else 0.0)
    return Recording("made.csv", motion * 1e-3, force, 0.05 * np.arange(len(motion)))
