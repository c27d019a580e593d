"""Printed slider-cranks: one curve, exact slopes, optima of nine and seventeen thicknesses.

    python benchmarks/slider_crank_beams.py

Minima over repetitions, warm (the beam engine compiled); processor time beside wall time, for a shared machine.
The published optimum of 23 variables took a genetic algorithm with a finite element program; a search with
finite differences and a shooting program took 2 to 7 s for nine thicknesses.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import cfmkit
from cfmkit.families.run_control import Run
from cfmkit.families.slider_crank.linkage import resolve
from cfmkit.families.slider_crank.printed.beam_chain_from_spec import chain_of
from cfmkit.families.slider_crank.printed.design import form_of, task_of
from cfmkit.families.slider_crank.printed.sqp_program import StripProgram
from cfmkit.families.slider_crank.printed.strip_thickness_search import search

if TYPE_CHECKING:
    from collections.abc import Callable

CONFIGS = Path(__file__).parents[1] / "configs"
ROWS = (
    (5.138, 0.01, 38.205),
    (5.138, 0.005, 33.909),
    (5.138, 0.002, 28.361),
    (8.0, 0.01, 46.223),
    (8.0, 0.002, 36.041),
)


def best(work: Callable[[], object], repetitions: int) -> tuple[float, float]:
    """Return the smallest wall and processor times of a piece of work [s]."""
    times = []
    for _ in range(repetitions):
        wall, processor = time.perf_counter(), time.process_time()
        work()
        times.append((time.perf_counter() - wall, time.process_time() - processor))
    return min(one for one, _ in times), min(two for _, two in times)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=5)
    count = parser.parse_args().repetitions
    spec = resolve(cfmkit.load(CONFIGS / "slider_crank_taper_design.yaml"))
    chain = chain_of(spec)
    travel = np.linspace(0.0, 38e-3, 11)
    task = task_of(spec)
    program = StripProgram(task, form_of(spec, spec.design.beam, task)[0])
    z = np.append(np.full(9, 0.98), 3.0)
    program.values(z)
    print(f"{'':44s}{'wall':>10s}{'processor':>12s}")
    for name, work in (
        ("curve of 11 points from rest", lambda: chain.press(travel)),
        ("exact slopes by 9 thicknesses and the stroke", lambda: StripProgram.slopes(program, z)),
        ("analyze, 481 points", lambda: cfmkit.analyze(spec)),
        ("design, 9 thicknesses, all in", lambda: cfmkit.design(spec)),
    ):
        wall, processor = best(work, count)
        print(f"{name:44s}{1e3 * wall:8.1f} ms{1e3 * processor:9.1f} ms")
    print(
        f"\n{'width':>6s}{'ripple':>8s}{'yardstick':>11s}{'nodes':>7s}{'stroke':>10s}{'strips':>8s}{'processor':>12s}"
    )
    for width, ripple, known in ROWS:
        for nodes in (9, 17):
            changes = {"design.beam.nodes": nodes, "design.tolerance": ripple, "design.beam.width": width * 1e-3}
            wanted = spec.replace(changes)
            task = task_of(wanted)
            form, ranges = form_of(wanted, wanted.design.beam, task)
            found = search(replace(task, longest=60e-3), form, ranges, 1, Run())
            _, processor = best(lambda t=task, f=form, r=ranges: search(t, f, r, 1, Run()), max(1, count // 2))
            stroke = 1e3 * found.program.stroke(found.descent.z)
            row = f"{width:6.3f}{100 * ripple:7.1f}%{known:8.3f} mm{nodes:7d}{stroke:7.3f} mm"
            print(row + f"{found.descent.evaluations:8d}{processor:10.2f} s")


if __name__ == "__main__":
    main()
