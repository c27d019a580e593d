"""The published slider-cranks, in the papers' units."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

import cfmkit
from cfmkit.bodies.slider_crank import Linkage
from cfmkit.bodies.slider_crank_springs import along_crank, along_slider

CONFIGS = Path(__file__).parents[2] / "configs"
DEG = math.pi / 180

LI = Linkage(10.0, 50.0, 3.0)
"""Li and Hao 2019, in cm; torques per N cm."""
START = -5.0 * DEG

ALPHA = math.atan(0.6)
BILANCIA = Linkage(54.0, math.hypot(100.0, 60.0) - 54.0, 60.0)
"""Bilancia et al. 2019, Table 1, in mm."""
TABLE_1 = np.array([28.303, 35.379, 35.379, 0.0])


def config(name, **changes):
    """Return a config of the family, with dotted paths replaced (``mechanism__springs__slider=0``)."""
    spec = cfmkit.load(CONFIGS / f"slider_crank_{name}.yaml")
    return spec.replace({path.replace("__", "."): value for path, value in changes.items()})


def li(degrees, start=START):
    """Return the unit curves of Li and Hao's linkage at crank angles [deg]."""
    return along_crank(LI, start, np.asarray(degrees, dtype=float) * DEG)


def force(travel, unloaded=0.542, linkage=BILANCIA, rates=TABLE_1):
    """Return Bilancia's force [N] at travels [mm]."""
    return rates @ along_slider(linkage, unloaded, 1, np.asarray(travel, dtype=float)).effort
