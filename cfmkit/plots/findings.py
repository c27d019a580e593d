"""What a study found, as its pictures need it: values in border units, no specification, no journal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.plots.text import axis_label

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from cfmkit.curves import FloatArray


@dataclass(frozen=True)
class Scale:
    """Something that is drawn: a parameter or a metric, in border units.

    Attributes
    ----------
    name, dimension : str
        For its label.
    values : (n,) array
        One for each point; indices into `words` where those are given.
    words : tuple of str
        Of a parameter or a metric that is no number.
    """

    name: str
    dimension: str
    values: FloatArray
    words: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """What is written on the axis: the last part of a path, with its unit."""
        short = self.name.rpartition(".")[2]
        known = self.dimension not in ("text", "count")
        return axis_label(short, self.dimension) if known else short.replace("_", " ")


@dataclass(frozen=True)
class Findings:
    """What a study found, as its pictures need it.

    Attributes
    ----------
    varied, metrics : tuple of Scale
        Parameters and the metrics to draw.
    shape : tuple of int
        Numbers of values of the parameters of a grid; empty if the points are no grid.
    meets : (n,) array of bool
        Whether a point was solved and meets every requirement.
    best : int or None
        Index of the best point.
    """

    varied: tuple[Scale, ...]
    metrics: tuple[Scale, ...]
    shape: tuple[int, ...]
    meets: NDArray[np.bool_]
    best: int | None = None


@dataclass(frozen=True)
class Line:
    """One curve of a study: branch name -> (motion, effort) in border units, and its parameter.

    Of two parameters that vary, `parameter` is the second and `panel` the first.
    """

    parameter: float
    branches: Mapping[str, tuple[FloatArray, FloatArray]]
    panel: float | None = None
