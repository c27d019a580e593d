"""What the yield of many drawn parts costs: a cam, a vcfm and a slider-crank with springs, closed models all of them.

Each yield is that of `cfmkit design`: parts as they are, without errors of the whole part, and of the specification as
given. Processor seconds are compared, in turn with those of another installation where its Python is named; that one
may draw fewer parts, if it takes long for each. The best of the rounds counts.

Run: python benchmarks/yields.py [--against OTHER/bin/python] [--parts 2000] [--parts-of-other 100] [--rounds 2]
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CASES = {"cam": "laser", "vcfm_pla": "fdm", "slider_crank_bought": "laser"}
"""Configuration -> the process whose assumed tolerances its parts have."""


def seconds(name: str, parts: int) -> dict[str, float]:
    """Return processor seconds for the yield of a configuration as it stands, and the yield."""
    import cfmkit
    from cfmkit.families.run_control import Run

    try:
        from cfmkit.studies.parts.drawn_parts import yields_of
    except ImportError:  # until November 2026
        from cfmkit.studies.yield_of_drawn_parts import yields_of

    spec = cfmkit.load(ROOT / "configs" / f"{name}.yaml")
    spec = spec.replace({"design.process": CASES[name], "design.samples": parts})
    result, few = cfmkit.analyze(spec), spec.replace({"design.samples": 20})
    result = replace(result, spec=spec)  # as designed: what follows from other values follows from those of each part
    yields_of(replace(result, spec=few), few, Run())  # what is imported, and compiled, once
    began = time.process_time()
    given = spec.replace({"description": "another one"})  # as given: of the design itself it would be known
    found = yields_of(result, given, Run())
    return {"seconds": time.process_time() - began, "yield": found.after.value}


def main() -> None:
    """Print processor time per part, of this installation and of another one."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--against", help="Python of another installation")
    parser.add_argument("--parts", type=int, default=2000)
    parser.add_argument("--parts-of-other", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--case", choices=CASES, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.case:
        print(json.dumps(seconds(options.case, options.parts)))
        return
    sides = {"here": (sys.executable, options.parts)}
    if options.against:
        sides["other"] = (options.against, options.parts_of_other)
    for name in CASES:
        best = dict.fromkeys(sides, float("inf"))
        for _ in range(options.rounds):
            for side, (python, parts) in sides.items():
                command = [python, __file__, "--case", name, "--parts", str(parts)]
                found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
                best[side] = min(best[side], found["seconds"] / parts)
        shown = ", ".join(f"{side} {1e3 * each:7.3f} ms a part" for side, each in best.items())
        ratio = f"   {best['other'] / best['here']:5.1f} times as fast" if options.against else ""
        print(f"{name:20s} {shown}{ratio}", flush=True)


if __name__ == "__main__":
    main()
