"""A thousand cam analyses, beside what a user of the paper would write with scipy.

The peer integrates the paper's dx/dy over y with `solve_ivp`, splines the path, offsets it,
inverts the slider's position by interpolation and evaluates Eq. 1 both ways: no corner, no
findings, no scalar results. Both run in turn in one process and the best time of each
counts, so that the machine's mood cancels in the ratio.

Run: python benchmarks/cam_analysis.py
"""

from __future__ import annotations

import gc
import resource
import time
import tracemalloc
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import cfmkit
from cfmkit.families import family
from cfmkit.families.run_control import Run

if TYPE_CHECKING:
    from collections.abc import Callable

CONFIG = Path(__file__).resolve().parent.parent / "configs" / "cam.yaml"
POINTS, ANALYSES, ROUNDS = 500, 1000, 20
GOAL = 1e-3
"""Seconds for one analysis."""


def peer(friction_cut_for: float, rtol: float = 1e-9) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return displacement and both forces of the published cam, straightforwardly."""
    constant, x0, brace, stiffness, mu, stroke = 9.058e-3, 0.068, 0.2, 1380.0, 0.002, 0.24

    def f(x: np.ndarray) -> np.ndarray:
        return (x - x0) / constant + x / np.sqrt(brace**2 - x**2)

    def rate(_y: float, x: np.ndarray) -> np.ndarray:
        return (1 - friction_cut_for * f(x)) / (friction_cut_for + f(x))

    path = solve_ivp(rate, (0, 0.29), [x0], rtol=rtol, atol=1e-12, dense_output=True)
    y = np.linspace(0, 0.29, 2000)
    x = path.sol(y)[0]
    slider = y + np.sqrt(brace**2 - x**2)
    displacement = np.linspace(0, stroke, POINTS)
    x = CubicSpline(slider - slider[0], x)(displacement)
    slope = 1 / rate(0, x)
    beta, tan_alpha = np.arctan(1 / slope), x / np.sqrt(brace**2 - x**2)
    forces = [4 * stiffness * (x - x0) / ((1 - m * np.tan(beta)) / (np.tan(beta) + m) - tan_alpha) for m in (mu, -mu)]
    return displacement, forces[0], forces[1]


def interleaved(calls: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Return the best time of each call [s], measured in turn."""
    best = dict.fromkeys(calls, float("inf"))
    for _ in range(ROUNDS):
        for name, call in calls.items():
            for _ in range(5):
                start = time.perf_counter()
                call()
                best[name] = min(best[name], time.perf_counter() - start)
    return best


def agreement(spec: cfmkit.Spec, friction: float) -> float:
    """Return the largest relative difference from the peer beyond the corner, where the peer is right too."""
    curve = cfmkit.analyze(spec).curve
    displacement, up, down = peer(friction, rtol=1e-11)
    beyond = displacement > 0.002
    ours = curve.force[:POINTS][beyond], curve.force[POINTS:][::-1][beyond]
    return max(float(np.abs(a / b[beyond] - 1).max()) for a, b in zip(ours, (up, down), strict=True))


def memory_growth(call: Callable[[], object]) -> tuple[int, int]:
    """Return how much memory a thousand analyses leave behind, and the peak of the process [kB]."""
    for _ in range(20):
        call()
    tracemalloc.start()
    before, _ = tracemalloc.get_traced_memory()
    for _ in range(ANALYSES):
        call()
    gc.collect()
    after, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return (after - before) // 1000, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def main() -> None:
    """Print one line per path."""
    base, run = cfmkit.load(CONFIG).replace({"analysis.points": POINTS}), Run()
    analyze = family("cam").analyze
    cases = {"closed form": 0.0, "quadrature": 0.002}
    specs = {name: base.replace({"mechanism.profile.friction": value}) for name, value in cases.items()}
    calls: dict[str, Callable[[], object]] = {}
    for name, spec in specs.items():
        calls[name] = lambda spec=spec: analyze(spec, run)
        calls[f"peer, {name}"] = lambda value=cases[name]: peer(value)
    best = interleaved(calls)
    for name, spec in specs.items():
        ours, theirs = best[name], best[f"peer, {name}"]
        verdict = "goal met" if ours <= GOAL else "goal missed"
        print(
            f"{name:12s} {1e3 * ours:6.3f} ms   peer {1e3 * theirs:6.2f} ms   ratio {theirs / ours:5.1f}   "
            f"force differs by {agreement(spec, cases[name]):.1e}   {verdict} ({1e3 * GOAL:g} ms)"
        )
    start = time.perf_counter()
    for _ in range(ANALYSES):
        calls["quadrature"]()
    whole = time.perf_counter() - start
    left, peak = memory_growth(calls["quadrature"])
    print(f"{ANALYSES} analyses, quadrature: {whole:.2f} s; they leave {left} kB behind; peak of the process {peak} kB")


if __name__ == "__main__":
    main()
