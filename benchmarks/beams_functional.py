"""The functional's pieces beside the shooting engine: curves, a coil, a batch, gradients, frequencies, stresses.

Run: nice python benchmarks/beams_functional.py. Both take turns in one process; minima of processor time. A march is
without its decisions (events, error estimate, start under constant loads), which `trace` includes: the ratios of curves
say what is left for those. Degrees are those at which the march has the error that `trace` has at its tolerance.
"""

from __future__ import annotations

import sys
import threading
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))
from beams_engine import MM, SHAPE, lan
from functional_paths import functional_path

import cfmkit.elastica.vibration as today
from cfmkit.elastica import (
    CLAMPED,
    Beam,
    Control,
    Displacement,
    Loading,
    Network,
    Node,
    PointLoad,
    Rotation,
    Section,
    arc,
    gradient,
    trace,
    trace_many,
)
from cfmkit.elastica.mechanics.design_derivatives import effort_slopes
from cfmkit.elastica.mechanics.designs import set_up
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.mechanics.equations import COMPLEX_STEP, MarchPlan, NumpyEquations, begin
from cfmkit.elastica.mechanics.march import engine, equations, march_many
from cfmkit.elastica.vibration import frequencies
from cfmkit.elastica.vibration import NetworkMasses

if TYPE_CHECKING:
    from collections.abc import Callable

DEGREES = ((1e-4, 5), (1e-6, 7), (1e-8, 9))
CURVE = Displacement("n5", -np.pi / 2, np.arange(1, 33) * 0.5 * MM)


def row(name: str, old: Callable[[], Any], new: Callable[[], Any], turns: int = 7, unit: str = "ms") -> None:
    """Print the shortest times of both, in turn, and their ratio."""
    times: list[list[float]] = [[], []]
    for work in (old, new):
        work()
    for _ in range(turns):
        for work, own in zip((old, new), times, strict=True):
            start = time.process_time()
            work()
            own.append(time.process_time() - start)
    before, after = (1e3 * min(own) for own in times)
    print(f"{name:44s} {before:9.3f} {after:9.3f} {unit}  {before / after:6.2f}", flush=True)


def _effort(case: Any, tolerance: float) -> Any:
    """Return the efforts of the shooting engine on a new path."""
    return trace(*case, Control(tolerance=tolerance)).effort


def march(net: Network, drive: Any, degree: int, kind: Any = equations) -> Any:
    """Return the march to the points of a drive."""
    own = kind(discretise(net, drive, degree))
    goals = drive.points / own.network.scales.drive
    return own.march(begin(own), goals, MarchPlan(0.05 * abs(goals[-1]), abs(goals[-1]), tolerance=1e-8))


def curves() -> None:
    """Print curves of networks."""
    beam = Beam("a", "b", Section(2e9, 1e-2, 1e-4), arc(2 * np.pi * 20.25))
    coil = Network({"a": Node(0, 0, CLAMPED), "b": Node(0.1, 0.0)}, {"coil": beam}), Rotation("b", np.arange(1, 11) / 5)
    follower = (
        Network({"a": Node(0, 0, CLAMPED), "b": Node(0.1, 0)}, {"x": Beam("a", "b", Section(2e9, 1e-2, 1e-3))}),
        Loading((PointLoad("b", fy=1.0, follows=True),), np.arange(1, 21) * 0.05),
    )
    lans = [((lan(), CURVE), f"Lan, 32 points, {tolerance:.0e}", tolerance, degree) for tolerance, degree in DEGREES]
    others = [(coil, "coil of 20 turns, 1e-06", 1e-6, 8), (follower, "load that follows, 20 points, 1e-06", 1e-6, 8)]
    for case, name, tolerance, degree in (*lans, *others):
        row(f"{name}: degree {degree}", partial(_effort, case, tolerance), partial(march, *case, degree))
    row(
        "Lan in numpy beside C: degree 6",
        lambda: march(lan(), CURVE, 6, NumpyEquations),
        lambda: march(lan(), CURVE, 6),
        2,
    )


def batch(count: int = 640) -> None:
    """Print a batch, and what two threads make of it."""
    rng = np.random.default_rng(0)
    shapes = [SHAPE * (1 + 1e-3 * rng.standard_normal(13)) for _ in range(count)]

    def functional() -> Any:
        pairs = [(lan(shape), CURVE) for shape in shapes]
        return march_many(set_up(discretise(*pairs[0], 6), pairs[0], pairs), CURVE.points, tolerance=1e-8)

    def shooting() -> Any:
        return list(trace_many((lan(shape) for shape in shapes), CURVE, Control(tolerance=1e-5)))

    row(f"batch of {count} designs, 1e-5: degree 6", shooting, functional, 2)
    pairs = [(lan(shape), CURVE) for shape in shapes]
    designs = set_up(discretise(*pairs[0], 6), pairs[0], pairs)
    start = time.perf_counter()
    for _ in range(2):
        march_many(designs, CURVE.points, tolerance=1e-8)
    one = time.perf_counter() - start
    threads = [
        threading.Thread(target=march_many, args=(designs, CURVE.points), kwargs={"tolerance": 1e-8}) for _ in range(2)
    ]
    start = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    print(f"two threads, wall clock: {one / (time.perf_counter() - start):.2f} times one")


def results() -> None:
    """Print gradients, stresses and frequencies of Lan's curve."""
    path = trace(lan(), CURVE, Control(tolerance=1e-5))
    new = functional_path(lan(), CURVE, 6)
    own = equations(new.network)
    states = [own.solve(z[new.network.free], drive) for z, drive in zip(new.at.z, new.at.drive, strict=True)]
    rates = np.array([state.rate for state in states])

    def slopes() -> Any:
        stepped = [(lan(SHAPE + 1j * COMPLEX_STEP * unit), CURVE) for unit in np.eye(13)]
        return effort_slopes(new.at, set_up(new.network, (lan(), CURVE), stepped), rates)

    row("13 gradients, 32 points, 1e-5: degree 6", lambda: gradient(path, lan, SHAPE).effort, slopes)
    names = list(new.net.beams)
    row(
        "largest stresses of 4 beams, 32 points",
        lambda: [replace(path).beam_stress(name) for name in names],
        lambda: [replace(new).beam_stress(name) for name in names],
    )
    masses, some = NetworkMasses(dict.fromkeys(new.net.beams, 1100.0)), [8, 16, 24]
    row("5 frequencies, held and free, 3 points", lambda: today.frequencies(path, masses, 5, path.at_requested[some]),
        lambda: frequencies(new, masses, 5, some), 3)  # fmt: skip


if __name__ == "__main__":
    print(f"runs on {engine()}\n{'':44s}   shooting functional     ratio")
    curves()
    batch()
    results()
