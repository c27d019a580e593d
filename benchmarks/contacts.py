"""Curves with contacts beside the same curves without: processor times in turn, minima of some turns.

Run: nice python benchmarks/contacts.py [--only TEXT] [--turns N]; another version's: the same with its interpreter.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import cfmkit
from cfmkit.elastica import Control, Displacement, Loading, trace
from cfmkit.families.beam.network_from_spec import assemble

ROOT = Path(__file__).parents[1]
sys.path += [str(ROOT / "tests" / part) for part in ("support", "elastica")]
import test_elastica_beam_on_beam as pairs  # noqa: E402
import test_elastica_pads_on_beams as pads  # noqa: E402
from contact_layouts import among_discs, with_pads  # noqa: E402

if TYPE_CHECKING:
    from collections.abc import Iterator

DISC_SEEDS, PAD_SEED = (1, 2, 50), 0
LANS_STOP = "  stops:\n    end: {node: n3, direction: 0 deg, gap: 0.26513192912 mm}\n"


def cases() -> Iterator[tuple[str, Any, Any, Control]]:
    """Yield name, network, drive and control of each case."""
    for name, block in (("beam_stop", ""), ("beam_gripper", ""), ("beam_lan2010", LANS_STOP)):
        text = (ROOT / "configs" / f"{name}.yaml").read_text(encoding="utf-8")
        assembly = assemble(cfmkit.loads(text.replace("  drive:", f"{block}  drive:", 1)))
        yield f"{name} with a stop" if block else name, assembly.network, assembly.drive(), Control()
    yield "stops and pads, out and back", *with_pads(PAD_SEED), Control()
    for seed in DISC_SEEDS:
        yield f"side among discs {seed}, out and back", *among_discs(seed), Control()
    load = Loading(pads.TIP_LOAD, np.array([0.25, 0.5, 1, 2, 3, 2, 1, 0.5, 0.25]))
    yield "pad on a leaf, out and back", pads.two_leaves(), load, Control()
    yield "two leaves, sides, out and back", pairs.BULGE, replace(load, points=load.points / 2), Control()
    fall = Displacement("root", pairs.DOWN, np.array([0.1, 0.2, 0.3, 0.2, 0.1]))
    yield "two leaves, end and side, out and back", pairs.falling_leaf(), fall, Control()


def main() -> None:
    """Print one line a case."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", default="")
    parser.add_argument("--turns", type=int, default=3)
    given = parser.parse_args()
    print("| case | points | events | without [ms] | with [ms] | ratio |\n|---|---|---|---|---|---|")
    for name, network, drive, control in cases():
        if given.only not in name:
            continue
        least = {True: np.inf, False: np.inf}
        for _ in range(given.turns):
            for touches in least:
                began = time.process_time()
                path = trace(network if touches else replace(network, contacts=()), drive, control)
                least[touches] = min(least[touches], time.process_time() - began)
                if touches:
                    points, events = len(path), len(path.contact_events)
        times = f"{1e3 * least[False]:.1f} | {1e3 * least[True]:.1f} | {least[True] / least[False]:.1f}"
        print(f"| {name} | {points} | {events} | {times} |", flush=True)


if __name__ == "__main__":
    main()
