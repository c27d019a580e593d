"""The slider-crank of Bilancia et al. 2019 as flexures and as a strip, for tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.slider_crank import Linkage
from cfmkit.families.slider_crank.printed import (
    FLEXURE_BEAMS,
    STRIP_BEAM,
    Chain,
    Elasticity,
    Flexure,
    Strip,
    flexure_ends,
    flexure_network,
    joints,
    stations,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.elastica import Path

MM = 1e-3
LINKAGE = Linkage(54 * MM, (np.hypot(100, 60) - 54) * MM, 60 * MM)
UNLOADED = 0.542
ABS = Elasticity(1800e6, 0.35, 42.5e6)
RATES = np.array([28.303, 35.379, 35.379]) * 1e-3  # Table 1
TABLE_2 = tuple(Flexure(10.8 * MM, h * MM, b * MM) for b, h in ((2.478, 0.908), (2.621, 0.960), (2.621, 0.960)))
SHARES = ((0.285, 0.803), (0.582, 0.851), (0.245, 0.842), (0.578, 0.798), (0.231, 0.765))  # a1 to a10, Table 3
THICKNESS = MM * np.array([0.927, 0.997, 0.929, 1.356, 1.339, 0.996, 0.920, 1.440, 1.434, 0.968, 1.046, 0.947])
WIDTH = 5.138 * MM


def corners(unloaded: float = UNLOADED, before: Sequence[float] = (0.5, 0.5, 0.5)) -> np.ndarray:
    """Return S1 to S6."""
    return flexure_ends(joints(LINKAGE, unloaded), [10.8 * MM] * 3, before)


def knee(path: Path, index: int, unloaded: float) -> np.ndarray:
    """Return where the crank pin, or the middle of a strip, is."""
    pins = joints(LINKAGE, unloaded)
    if STRIP_BEAM not in path.network.beams:
        return pins[1] + path.motion("crank end")[index, :2]
    shape = path.shape(STRIP_BEAM, index)
    marks = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(shape, axis=0).T))])
    return shape[np.abs(marks - 60 * MM).argmin()]


def lumped_chain(unloaded: float = UNLOADED, flexures: Sequence[Flexure] = TABLE_2) -> Chain:
    """Return Table 2 as a chain."""
    pins = joints(LINKAGE, unloaded)
    ends = flexure_ends(pins, [item.length for item in flexures], [item.before for item in flexures])
    return Chain(ends, pins, lambda p: flexure_network(p, flexures, ABS), np.pi, lambda p, i: knee(p, i, unloaded))


def strip_chain(
    thickness: np.ndarray | float = THICKNESS,
    places: np.ndarray | None = None,
    unloaded: float = UNLOADED,
    width: float = WIDTH,
    material: Elasticity = ABS,
    points: np.ndarray | None = None,
) -> Chain:
    """Return Table 3, or another strip along the same line, as a chain."""
    points = corners(unloaded) if points is None else points
    values = np.atleast_1d(np.asarray(thickness, dtype=float))
    if len(values) == 1:
        values = np.repeat(values, 2)
    if places is None:
        places = stations(points, SHARES) if len(values) == 12 else np.linspace(0, 1, len(values))

    def build(at: np.ndarray) -> object:
        return Strip(at, width, values, places).network(material)

    return Chain(points, joints(LINKAGE, unloaded), build, np.pi, lambda p, i: knee(p, i, unloaded))  # type: ignore[arg-type]


__all__ = ["ABS", "FLEXURE_BEAMS", "LINKAGE", "MM", "RATES", "SHARES", "TABLE_2", "THICKNESS", "UNLOADED", "WIDTH"]
