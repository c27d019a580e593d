"""Whole traces of beam networks: start, path, events, error estimate; minima of processor time over some turns.

Run: nice python benchmarks/beams_traces.py [--only TEXT] [--tolerance T] [--turns N]; in turn with another checkout's.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))
from beams_engine import MM, cantilever, lan, v_beam
from network_cases import from_json, read_cases

from cfmkit.elastica import (
    CLAMPED_SUPPORT,
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
    trace,
)
from cfmkit.elastica.mechanics.march import engine

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

FROZEN = {
    "config: beam_lee_frame 1": "Lee's frame, through folds",
    "config: vcfm_cosine 1": "vcfm leaf, free",
    "config: vcfm_pla 2": "vcfm leaf, pushed",
    "equal leaves buckle together and straighten together 1": "two equal leaves",
    "steps do not shrink until they follow a rounded corner 1": "five leaves",
    "columns under one platform bear its load together 1": "columns under a platform",
    "config: slider_crank_strip 2": "slider-crank strip",
    "config: beam_v_bifurcation 1": "V mechanism, 201 points",
    "config: beam_two_layers 1": "two layers, 8 beams",
    "config: beam_williams_toggle 1": "Williams' toggle",
    "random 4, drive 0": "random network, displacement",
    "random 4, drive 2": "random network, loads",
    "column 0.0001 m thick, clamped": "column of slenderness 1000",
    "strip in tension, alpha 100": "strip in tension",
    "cantilever under a following load of 16 EI/L2 across": "load that follows",
    "arc of 3.5 rad under a load, through folds": "arc through folds",
}


def cases() -> Iterator[tuple[str, Callable[[], Network], Any, Control]]:
    """Yield name, network, drive and control of each case."""
    curve = Displacement("n5", -np.pi / 2, np.arange(1, 33) * 0.5 * MM)
    yield "Lan, 32 points", lan, curve, Control()
    bend = Loading((PointLoad("tip", fy=-1.0),), np.linspace(0.1, 1, 10) * 10 * 2e-2 / 0.4**2)
    yield "cantilever, 10 points", cantilever, bend, Control()
    snap = Displacement("d", -np.pi / 2, np.linspace(0.02, 1, 50) * 7 * MM)
    yield "V-beam, both bifurcations, 50 points", v_beam, snap, Control()
    follower = Network(
        {"a": Node(0, 0, CLAMPED_SUPPORT), "b": Node(0.1, 0)}, {"x": Beam("a", "b", Section(2e9, 1e-2, 1e-3))}
    )
    load = Loading((PointLoad("b", fy=1.0, follows=True),), np.arange(1, 21) * 0.05)
    yield "load that follows, 20 points", lambda: follower, load, Control()
    strip = Beam("a", "b", Section(2e9, 1e-2, 1e-4), arc(2 * np.pi * 20.25))
    coil = Network({"a": Node(0, 0, CLAMPED_SUPPORT), "b": Node(0.1, 0.0)}, {"coil": strip})
    yield "coil of 20 turns, 10 points", lambda: coil, Rotation("b", np.arange(1, 11) / 5), Control()
    known = {case["name"]: case for case in read_cases()}
    for name, title in FROZEN.items():
        network, drive, control = (from_json(known[name][part]) for part in ("network", "drive", "control"))
        yield title, lambda network=network: network, drive, control


def main() -> None:
    """Print processor times."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", default="")
    parser.add_argument("--tolerance", type=float, default=1e-7)
    parser.add_argument("--turns", type=int, default=5)
    options = parser.parse_args()
    print(f"runs on {engine()}, tolerance {options.tolerance:.0e}\n{'':40s}     time   error told")
    for name, build, drive, control in cases():
        if options.only not in name:
            continue
        times = []
        for _ in range(options.turns):
            start = time.process_time()
            path = trace(build(), drive, replace(control, tolerance=options.tolerance))
            assert len(path.effort)
            times.append(time.process_time() - start)
        mesh = f"degree {path.mesh.degree}, {len(path.mesh.elements.length)} elements"
        print(f"{name:38s} {1e3 * min(times):9.2f} ms  {path.error:.0e} {mesh} {path.status.name}", flush=True)


if __name__ == "__main__":
    main()
