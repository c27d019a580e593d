"""The published slider-cranks, in the papers' units."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

import cfmkit
from cfmkit.families.slider_crank import Linkage, curves_along_crank, curves_along_slider

CONFIGS = Path(__file__).parents[2] / "configs"
DEG = math.pi / 180

LI = Linkage(10.0, 50.0, 3.0)
"""Li and Hao 2019, in cm; torques per N cm."""
START = -5.0 * DEG

ALPHA = math.atan(0.6)
BILANCIA = Linkage(54.0, math.hypot(100.0, 60.0) - 54.0, 60.0)
"""Bilancia et al. 2019, Table 1, in mm."""
TABLE_1 = np.array([28.303, 35.379, 35.379, 0.0])


def config(name, *settings, **changes):
    """Return a config of the family with settings, and dotted paths replaced (``mechanism__springs__slider=0``)."""
    spec = cfmkit.load(CONFIGS / f"slider_crank_{name}.yaml", settings)
    return spec.replace({path.replace("__", "."): value for path, value in changes.items()})


def li(degrees, start=START):
    """Return the unit curves of Li and Hao's linkage at crank angles [deg]."""
    return curves_along_crank(LI, start, np.asarray(degrees, dtype=float) * DEG)


def force(travel, unloaded=0.542, linkage=BILANCIA, rates=TABLE_1):
    """Return Bilancia's force [N] at travels [mm]."""
    return rates @ curves_along_slider(linkage, unloaded, 1, np.asarray(travel, dtype=float)).effort


def force_of_energy(link, unloaded, rates, side, travel):
    """Return the force [N] as the derivative of the energy by the travel: law of cosines, nothing of the package's.

    The knee keeps its sign `side`; travel goes against the direction of the branch, past the pivot's foot if need be.
    """
    r1, r2, e, way = link.crank, link.coupler, link.offset, link.branch
    start = way * np.longdouble(r1) * np.cos(np.longdouble(unloaded))
    start += np.sqrt(np.longdouble(r2) ** 2 - (r1 * np.sin(np.longdouble(unloaded)) - e) ** 2)

    def pose(x, sign):
        knee = sign * way * np.arccos((x * x + e * e - r1**2 - r2**2) / (2 * np.longdouble(r1) * r2))
        return np.arctan2(e, x), np.arctan2(r2 * np.sin(knee), r1 + r2 * np.cos(knee)), knee

    first = pose(start, 1 if link.knee(unloaded) >= 0 else -1)

    def energy(u):
        # joints turn on through the stretched position, the line from pivot to slider by the shorter way
        view, lead, knee = (b - a for a, b in zip(first, pose(start - u, side), strict=True))
        view = np.remainder(view + np.pi, 2 * np.pi) - np.pi
        turns = view + lead, -knee, view + lead - knee, u
        return 0.5 * sum(rate * turn**2 for rate, turn in zip(rates, turns, strict=True))

    travel = np.asarray(travel, dtype=np.longdouble)
    step = np.longdouble(1e-6) * (r1 + r2)
    near = (energy(travel + step) - energy(travel - step)) / (2 * step)
    far = (energy(travel + 2 * step) - energy(travel - 2 * step)) / (4 * step)
    return np.asarray((4 * near - far) / 3, dtype=float)
