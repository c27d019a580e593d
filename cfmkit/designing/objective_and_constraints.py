"""A design problem as a program of `cfmkit.numerics.sqp`: an objective, and rows that must be at least zero.

A family says what is seen at a point; here that becomes the vectors and matrices that the solver wants. Limits may be
let give way, all by the same amount, which is then the last variable and is minimised in place of the objective: zero
where the limits can be met together, and where they cannot, the least by which they are missed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.designing.limits import LimitRows


@dataclass(frozen=True)
class SeenPoint:
    """What is known at a point: the objective with its derivatives (k,), if they were requested, and all rows."""

    objective: float
    slope: FloatArray | None
    rows: Sequence[LimitRows]


class Source(Protocol):
    """What a family knows of its design at a point."""

    def seen(self, z: FloatArray, sloped: bool) -> SeenPoint | None:
        """Return objective and rows at z, with derivatives or without; None where the model has no answer."""


def values(source: Source, z: FloatArray, elastic: tuple[str, ...] = ()) -> tuple[float, FloatArray] | None:
    """Return the objective and the constraints (m,) at z, as `numerics.sqp.Program.values`.

    Parameters
    ----------
    source : Source
        What is seen.
    z : (n,) array
        The variables; with limits that give way the last of them is by how much.
    elastic : tuple of str
        Limits that give way.
    """
    seen = source.seen(z[:-1] if elastic else z, False)
    if seen is None:
        return None
    rows = [one.values + z[-1] if one.name in elastic else one.values for one in seen.rows]
    return (float(z[-1]) if elastic else seen.objective), np.concatenate([np.zeros(0), *rows])


def slopes(source: Source, z: FloatArray, elastic: tuple[str, ...] = ()) -> tuple[FloatArray, FloatArray] | None:
    """Return the derivatives (n,) and (m, n) of objective and constraints at z, as `numerics.sqp.Program.slopes`."""
    seen = source.seen(z[:-1] if elastic else z, True)
    if seen is None:
        return None
    objective = np.zeros(len(z))
    if elastic:
        objective[-1] = 1.0
    elif seen.slope is not None:
        objective[: len(seen.slope)] = seen.slope
    return objective, np.concatenate([np.zeros((0, len(z))), *(_wide(one, len(z), elastic) for one in seen.rows)])


def _wide(rows: LimitRows, count: int, elastic: tuple[str, ...]) -> FloatArray:
    """Return the derivatives of rows by all variables."""
    wide = np.zeros((len(rows.values), count))
    if rows.slopes is not None:
        wide[:, : rows.slopes.shape[1]] = rows.slopes
    if rows.name in elastic:
        wide[:, -1] = 1.0
    return wide
