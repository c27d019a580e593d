"""What a slider-crank costs: torques, classes, designs; beside what a user of the papers would write with scipy.

The peer of the torques is [LH, eq. 10] in numpy, as printed; that of the design is the papers' way: scipy's SLSQP on
the five variables of [B, eq. 8] from random starts. Both run in one process, and the best time of each counts.

Run: python benchmarks/slider_crank.py

Reference
---------
[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z.
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from timing import best

import cfmkit
from cfmkit.families.slider_crank.linkage import Linkage
from cfmkit.families.slider_crank.springs.fit_nonnegative_rates import RateGoal, minimax
from cfmkit.families.slider_crank.unit_springs import crank_efforts, curves_along_crank

CONFIGS = Path(__file__).resolve().parent.parent / "configs"
MILLION, SIDE = 1_000_000, 32


def eq_10(angle: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Return the torque of [LH, eq. 10], as printed."""
    r1, r2, e, start = 10.0, 50.0, 3.0, np.radians(-5.0)
    a = np.sqrt(r2**2 - (r1 * np.sin(angle) - e) ** 2)
    a0 = np.sqrt(r2**2 - (r1 * np.sin(start) - e) ** 2)
    b = r1**2 * np.sin(angle) * np.cos(angle) - e * r1 * np.cos(angle)
    c, c0 = np.arcsin((r1 * np.sin(angle) - e) / r2), np.arcsin((r1 * np.sin(start) - e) / r2)
    return (
        rates[0] * (angle - start)
        + rates[1] * (-angle - c + start + c0) * (-1 - r1 * np.cos(angle) / a)
        + rates[2] * (c - c0) * r1 * np.cos(angle) / a
        + rates[3] * (r1 * np.cos(angle) + a - r1 * np.cos(start) - a0) * (-r1 * np.sin(angle) - b / a)
    )


def slsqp(seed: int) -> float:
    """Return the error of [B, eq. 8] that scipy's SLSQP ends with, from one random start."""
    travel = 0.35 * np.arange(1, 101)
    from cfmkit.families.slider_crank.unit_springs import curves_along_slider

    def error(values: np.ndarray) -> float:
        r1, lead, *rates = values
        link = Linkage(r1, float(np.hypot(100, 60)) - r1, 60.0)
        units = curves_along_slider(link, link.stretched_angle + lead, 1, travel)
        force = np.array([*rates, 0.0]) @ units.effort
        return float(np.sqrt(np.nanmean((force - 1.5) ** 2))) if np.isfinite(force).all() else 10.0

    low, high = np.array([35.0, 0.0, 0.0, 0.0, 0.0]), np.array([54.0, 1.0, 1000.0, 1000.0, 1000.0])
    start = np.random.default_rng(seed).uniform(low, np.array([54.0, 0.1, 100.0, 100.0, 100.0]))
    return float(minimize(error, start, method="SLSQP", bounds=list(zip(low, high, strict=True))).fun)


def main() -> None:
    """Print one line per task."""
    angle = np.linspace(-0.1, 0.3, MILLION)
    link, rates = Linkage(10.0, 50.0, 3.0), np.array([1.0, 1.0, 1.0, 1.0])
    ours = best(lambda: rates @ crank_efforts(link, np.radians(-5.0), angle))
    peer = best(lambda: eq_10(angle, rates))
    print(
        f"a million torques            {ours:7.3f} s    eq. 10 as printed {peer:.3f} s, {peer / ours:.2f} times as long"
    )

    window = np.linspace(0.866, 4.866, 101)
    goal = RateGoal(
        curves_along_crank(link, np.radians(-5.0), np.radians(window)).effort.T, np.ones(101), np.full(4, np.inf)
    )
    print(f"minimax rates, 101 places    {1e3 * best(lambda: minimax(goal), 20):7.2f} ms")

    spec = cfmkit.load(CONFIGS / "slider_crank_li2019.yaml")
    print(f"one analysis, 761 points     {1e3 * best(lambda: cfmkit.analyze(spec), 20):7.2f} ms")
    wide = cfmkit.load(CONFIGS / "slider_crank_li2019_widest.yaml")
    print(f"the widest window            {1e3 * best(lambda: cfmkit.design(wide)):7.1f} ms")

    optimum = cfmkit.load(CONFIGS / "slider_crank_bilancia2019_optimum.yaml")
    found = cfmkit.design(optimum)
    ours = best(lambda: cfmkit.design(optimum))
    errors = [slsqp(seed) for seed in range(5)]
    peer = best(lambda: slsqp(0), 2)
    print(f"crank, start and springs     {ours:7.3f} s    {found.message}")
    reported = ", ".join(f"{error:.1e}" for error in errors)
    print(f"  SLSQP from one start       {peer:7.3f} s    errors of five starts [N]: {reported}")

    tops = {"mechanism.springs.crank_pin": 0.012, "mechanism.springs.slider_pin": 0.4}
    lists = {path: [f"{rate} N*m/rad" for rate in np.linspace(0.0, top, SIDE)] for path, top in tops.items()}
    for metrics in (("stiffness_class",), ("stiffness_class", "constant_angle"), ("torque_ripple", "band_range_05pct")):
        seconds = best(lambda metrics=metrics: cfmkit.sweep(spec, vary=lists, metrics=metrics), 2)
        print(f"{SIDE**2} designs: {', '.join(metrics):36s} {seconds:6.2f} s, {SIDE**2 / seconds:9.0f} a second")


if __name__ == "__main__":
    main()
