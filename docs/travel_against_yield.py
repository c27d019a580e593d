"""Print the table of travel against yield in benchmarks/RESULTS.md: python docs/travel_against_yield.py [TRAVEL ...].

The strip of configs/studies/slider_crank_strip_yield.yaml, which bends as that of configs/slider_crank_strip.yaml, is
designed with margins for several travels [mm]. 99 % is requested, so that the search gives the best that it finds. Its
parts are then drawn anew and analysed in full. Takes a minute of processor time for each travel.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cfmkit
from cfmkit.families.run_control import Run
from cfmkit.results import Status
from cfmkit.studies.parts.drawn_parts import analyze_parts
from cfmkit.studies.parts.parts import Parts

CONFIG = Path(__file__).resolve().parent.parent / "configs" / "studies" / "slider_crank_strip_yield.yaml"
TRAVELS = (34.0, 35.0, 36.0, 37.0, 37.25, 37.5, 37.75, 38.0, 39.0)
"""At which the design is made [mm]."""

N_PARTS, ASKED = 400, 0.99


def of_travel(travel: float, asked: float = ASKED) -> cfmkit.Spec:
    """Return the study with the end of its travel, and of the windows of its requirements, elsewhere [mm]."""
    windows = ("design.travel", "analysis.travel", "analysis.window", "requirements.0.over", "requirements.2.over")
    return cfmkit.load(CONFIG, [*(f"{key}.1={travel:g} mm" for key in windows), f"design.yield={asked}"])


def row(travel: float) -> str:
    """Return a row of the table: what was chosen, and how many of its parts are good."""
    spec, asked = of_travel(travel), ASKED
    found = cfmkit.design(spec)
    while found.spec is None and "design.yield" in (found.nearest_feasible or {}):
        asked = 0.01 * float(found.nearest_feasible["design.yield"].rstrip(" %"))
        if asked <= 0.0:
            break
        found = cfmkit.design(of_travel(travel, asked))
    if found.spec is None:
        return f"| {travel:g} mm | | | | none |"
    nominal, mechanism = cfmkit.analyze(found.spec), found.spec.mechanism
    if nominal.status is not Status.COMPLETE:
        return f"| {travel:g} mm | | | | none |"
    parts = Parts.from_design(found.spec, found.spec.design, 0)
    share = analyze_parts(parts, parts.draw(N_PARTS), nominal, Run()).share()
    low, high = share.clopper_pearson
    chosen = f"{1e3 * mechanism.beam.thickness:.4f} mm | {1e3 * mechanism.beam.width:.3f} mm | "
    chosen += f"{mechanism.unloaded_angle:.5f} rad"
    return f"| {travel:g} mm | {chosen} | {100 * share.value:.3g} % ({100 * low:.3g} to {100 * high:.3g}) |"


if __name__ == "__main__":
    print("| travel to | thickness | width | unloaded angle | yield |\n|---|---|---|---|---|")
    for place in map(float, sys.argv[1:] or TRAVELS):
        print(row(place), flush=True)
