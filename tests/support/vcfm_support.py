"""The mechanism of Ding, Li and Li (2022), Table I, in millimetres and newtons, and short ways to run it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import cfmkit
from cfmkit.families.vcfm.leaves import LeafStrip

if TYPE_CHECKING:
    from cfmkit.results import Result

MM = 1e-3
CONFIGS = Path(__file__).parents[2] / "configs"
TABLE_I = CONFIGS / "vcfm_ding2022.yaml"


def leaf(thickness: Any = 1.0, length: float = 35.0, degrees: Any = 7.0, width: float = 6.0) -> LeafStrip:
    """Return a leaf of the V-beam in mm, N and MPa."""
    return LeafStrip(length, np.radians(degrees), thickness, width, 1477.0, 0.3)


def side(thickness: Any = 1.5, length: Any = 25.0, degrees: float = 7.0) -> LeafStrip:
    """Return a leaf of the diamond in mm, N and MPa."""
    return LeafStrip(length, np.radians(degrees), thickness, 10.0, 1477.0, 0.3)


def table_i(*changes: str, preloads: str = "[0 mm]") -> Any:
    """Return Table I with changes as ``--set`` takes them, at the nominal preload only unless others are named."""
    return cfmkit.load(TABLE_I, [f"analysis.preloads={preloads}", *changes])


def analyzed(*changes: str, preloads: str = "[0 mm]") -> Result:
    return cfmkit.analyze(table_i(*changes, preloads=preloads))


def force_at(result: Result, places: Any, curve: int = 0) -> Any:
    """Return the force [N] of a result at places [mm], between its samples."""
    one = result.curves[curve]
    return np.interp(np.asarray(places, dtype=float) * MM, one.motion, one.effort)


def names(result: Result) -> list[str]:
    return [found.name for found in result.warnings]


def message(result: Result, name: str) -> str:
    """Return the message of one finding; there must be exactly one of that name."""
    (found,) = [found for found in result.warnings if found.name == name]
    return found.message
