"""The poses at which a design is looked at: rest, some on the way, the window, the two that the paper compares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.numerics.quadrature import clenshaw_curtis

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.shaping.task import Task

_EACH = 8  # poses of the window for one before it
_MIDDLE = 0.7  # of the end: a pose under load that stays where it is while the window grows


@dataclass(frozen=True)
class Poses:
    """Displacements, and which of them are what.

    Attributes
    ----------
    at : (p,) array
        From rest, increasing [m].
    window : (j,) array
        Indices of those in the window.
    shown : (3,) array
        Indices of those at which gaps are looked at: rest, on the way, and the end.
    mean : (p,) array
        Weights of the mean over the window.
    compared : (2,) array
        Indices of a and b; of the end where the paper's objective is not requested.
    """

    at: FloatArray
    window: Any
    shown: Any
    mean: FloatArray
    compared: Any


def poses_of(task: Task, start: float) -> Poses:
    """Return the poses for a window that begins at `start` [m]."""
    end = task.window[1]
    inside = start + 0.5 * (end - start) * (1 - np.cos(np.linspace(0, np.pi, task.points)))
    inside[-1] = end
    before = np.linspace(0.0, start, task.points // _EACH + 2)[1:-1] if start > 0 else np.zeros(0)
    also = np.array(task.compared or (end, end))
    middle = _MIDDLE * end
    at = np.unique(np.concatenate([[0.0], before, inside, also, [middle]]))
    window = np.searchsorted(at, inside)
    mean = np.zeros(len(at))
    mean[window] = clenshaw_curtis(task.points)
    shown = np.array([0, np.searchsorted(at, middle), window[-1]])
    return Poses(read_only(at), window, shown, read_only(mean), np.searchsorted(at, also))
