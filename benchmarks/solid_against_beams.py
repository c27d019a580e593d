"""Solids beside the beam models of their family: the tables of docs/solid.md for vcfm and slider-cranks, without ccx.

Run: python benchmarks/solid_against_beams.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import cfmkit

CONFIGS = Path(__file__).resolve().parent.parent / "configs"
VCFM = ("vcfm_ding2022", "vcfm_u_shape", "vcfm_straight", "vcfm_cosine", "vcfm_hybrid")
CRANKS = {"slider_crank_strip": "beam", "slider_crank_tapered": "beam", "slider_crank_lumped": "lumped"}


def pair(name: str, beams: str) -> tuple[cfmkit.Result, cfmkit.Result]:
    """Return a shipped specification as a solid and as beams."""
    solid, other = (
        cfmkit.analyze(cfmkit.load(CONFIGS / f"{name}.yaml", [f"analysis.fidelity={one}"])) for one in ("solid", beams)
    )
    return solid, other


def more(solid: float | None, beams: float | None) -> str:
    """Return by how much a value of the solid is larger."""
    return "" if solid is None or not beams else f"{100 * (solid / beams - 1):+.1f} %"


def vcfm(name: str) -> str:
    """Return the row of a vcfm."""
    values = [{key: one.value for key, one in result.values.items()} for result in pair(name, "exact")]
    solid, exact = values
    keys = ("negative_stiffness", "positive_stiffness", "bistable_stress_max", "spring_stress_max")
    falls, stiff, leaves, spring = (more(solid[key], exact[key]) for key in keys)
    ranges = [
        " and ".join(f"{1e3 * one[key]:.3f}" for key in ("linear_start", "linear_end")) if one["linear_start"] else ""
        for one in values
    ]
    reported = f"{ranges[0]} ({ranges[1]})" if ranges[0] else ""
    return f"| `{name}` | {falls} | {reported} | {stiff} | {leaves}, {spring} |"


def crank(name: str, beams: str) -> str:
    """Return the row of a slider-crank: mean force and largest stress in its window."""
    solid, other = (cfmkit.evaluate(result) for result in pair(name, beams))
    force, stress = (more(solid[key].value, other[key].value) for key in ("force_mean", "stress_max"))
    return f"| `{name}` | {force} | {stress} |"


def main() -> None:
    """Print both tables, and the force of one vcfm at two travels."""
    for name in VCFM:
        print(vcfm(name), flush=True)
    curves = [result.curve for result in pair("vcfm_ding2022", "exact")]
    solid, exact = (np.interp([0.8e-3, 4.5e-3], one.motion, one.effort) for one in curves)
    print("force of vcfm_ding2022 at 0.8 and 4.5 mm:", *(more(*both) for both in zip(solid, exact, strict=True)))
    for name, beams in CRANKS.items():
        print(crank(name, beams), flush=True)


if __name__ == "__main__":
    main()
