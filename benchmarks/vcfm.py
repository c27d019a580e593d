"""Speed of the mechanism of V-beams and a diamond: block of analytic curves, exact V-beam curve, design, Sobol study.

Beside the first a peer: the same closed form for one leaf as a loop over scipy's root finder. The best of several
rounds counts.

Run: python benchmarks/vcfm.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from timing import best

import cfmkit
from cfmkit import api
from cfmkit.elastica import Displacement, trace
from cfmkit.families.vcfm.exact_model import DOWN_ANGLE, leaf_network
from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Diamond
from cfmkit.families.vcfm.leaves.v_beam import VBeam
from cfmkit.studies.engine import run
from cfmkit.studies.sensitivity.run_and_files import carry_out
from cfmkit.studies.sensitivity.setup import prepare

CONFIGS = Path(__file__).resolve().parent.parent / "configs"
DESIGNS, POINTS = 200, 301
GOALS = {"values": 5e5, "exact": 50e-3, "design": 2.0}


def block() -> np.ndarray:
    """Return the forces of many designs at many travels."""
    thickness = np.linspace(0.6, 1.2, DESIGNS)[:, None]
    leaf, side = (
        LeafStrip(length, np.radians(7), t, b, 1477.0, 0.3)
        for length, t, b in ((35.0, thickness, 6.0), (25.0, 1.5, 10.0))
    )
    travel = np.linspace(0.0, 6.0, POINTS)[None, :]
    return 4 * VBeam(leaf).force(travel) + Diamond(side).force(travel)


def peer(points: int = 100) -> np.ndarray:
    """Return the force of one leaf in S form at some travels, one root at a time."""
    length, angle, slim = 35.0, np.radians(7), 1 / 35
    unit, found = 1477 * 6 / 12 / length**2, []
    for travel in np.linspace(0.01, 0.9, points) / length:
        x, y = np.cos(angle), np.sin(angle) - travel
        chord, tilt = np.hypot(x, y), np.arctan2(y, x)
        turn = angle - tilt

        def excess(q: float, chord: float = chord, turn: float = turn) -> float:
            gap = q * np.cos(q) - np.sin(q)
            e = 0.5 * (q * q / 2 + q * np.sin(2 * q) / 4 - np.sin(q) ** 2) / gap**2
            return slim**2 / 3 * q * q + turn**2 * e - (1 - chord)

        q = brentq(excess, 1e-3, 4.49)
        w = -2 * q * q * np.sin(q) / (q * np.cos(q) - np.sin(q))
        found.append(unit * (4 * q * q * np.sin(tilt) + 2 * turn * w / chord * np.cos(tilt)))
    return np.array(found)


def main() -> None:
    """Print one line per part."""
    spec = cfmkit.load(CONFIGS / "vcfm_ding2022.yaml")
    ours = VBeam(LeafStrip(35.0, np.radians(7), 1.0, 6.0, 1477.0, 0.3)).s_force(np.linspace(0.01, 0.9, 100))
    print(f"the peer's forces differ by {np.abs(peer() / ours - 1).max():.1e}")
    values, alone = DESIGNS * POINTS / best(block), 100 / best(peer)
    verdict = "goal met" if values >= GOALS["values"] else "goal missed"
    print(f"analytic forces, {DESIGNS} designs x {POINTS}: {values:.2e} per second and core; with brentq {alone:.1e}; "
          f"ratio {values / alone:.0f}; {verdict} ({GOALS['values']:.0e})")  # fmt: skip
    network, points = leaf_network(spec), np.linspace(0.0, 6e-3, 201)[1:]
    seconds = best(lambda: trace(network, Displacement("shuttle", DOWN_ANGLE, points)).effort)
    print(f"exact V-beam, 200 points, both bifurcations: {1e3 * seconds:.1f} ms; "
          f"{'goal met' if seconds <= GOALS['exact'] else 'goal missed'} (50 ms)")  # fmt: skip
    for name, change in (("analytic", "analytic"), ("exact", "exact")):
        one = spec.replace({"analysis.fidelity": change})
        print(f"whole analysis at four preloads, {name}: {1e3 * best(lambda one=one: cfmkit.analyze(one)):.1f} ms")
    pla = cfmkit.load(CONFIGS / "vcfm_pla.yaml")
    seconds = best(lambda: api.design(pla), 3)
    verdict = "goal met" if seconds <= GOALS["design"] else "goal missed"
    print(f"design with the exact pass: {1e3 * seconds:.0f} ms; {verdict} (2 s)")
    study = cfmkit.load(CONFIGS / "studies" / "vcfm_sobol.yaml")
    seconds = best(lambda: carry_out(prepare(study), run), 2)
    print(f"Sobol indices from 3072 curves: {seconds:.2f} s")


if __name__ == "__main__":
    main()
