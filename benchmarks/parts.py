"""Parts of a run that users wait for, each beside a plain numpy task of known size, in one run.

The best of several rounds counts; the ratio to the peer is what to compare between machines.

Run: python benchmarks/parts.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from timing import best

import cfmkit
from cfmkit.families import family
from cfmkit.families.cam.outline import flank_edge
from cfmkit.numerics.arc_chains import fit_arcs
from cfmkit.plots.figures import figures
from cfmkit.plots.style import png

CONFIG = Path(__file__).resolve().parent.parent / "configs" / "cam.yaml"


def main() -> None:
    """Print one line per part."""
    spec = cfmkit.load(CONFIG)
    result = cfmkit.analyze(spec)
    edge = flank_edge(result.state.assembly.profile)
    numbers = np.random.default_rng(0).normal(size=100_000)
    parts = {
        "analyse a cam, 2 x 481 points": lambda: cfmkit.analyze(spec),
        "all metrics of its curve": lambda: cfmkit.evaluate(result),
        "arcs within 5 um through its flank": lambda: fit_arcs(edge.points, edge.tangents, 5e-6, 1e-3),
        "all of its figures as PNG": lambda: [png(draw()) for draw in figures(family("cam"), result).values()],
    }
    peer = best(lambda: np.sort(numbers), 40)
    print(f"{'sort 100 000 floats (the peer)':40s} {1e3 * peer:8.2f} ms")
    for name, task in parts.items():
        seconds = best(task, 3 if "PNG" in name else 40)
        print(f"{name:40s} {1e3 * seconds:8.2f} ms   {seconds / peer:7.2f} x the peer")


if __name__ == "__main__":
    main()
