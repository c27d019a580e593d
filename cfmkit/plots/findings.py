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


PERCENT = "percent"
"""Dimension of shares that are drawn in per cent."""


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
        if self.dimension == PERCENT:
            return f"{short.replace('_', ' ')} [%]"
        known = self.dimension not in ("text", "count")
        return axis_label(short, self.dimension) if known else short.replace("_", " ")

    @property
    def plain(self) -> str:
        """The label without the unit, for sentences."""
        return self.label.partition(" [")[0]

    def text(self, value: float) -> str:
        """Return one of the values with its unit, or as its word."""
        if self.words:
            return self.words[int(value)]
        unit = "" if self.dimension in ("text", "count") else self.label.partition(" [")[2].removesuffix("]")
        return f"{value:.4g}" + (f" {unit}" if unit not in ("", "1") else "")


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
    name : str
        Whose study it is, for the heading.
    best_words : str
        What makes the best point the best, for the key.
    """

    varied: tuple[Scale, ...]
    metrics: tuple[Scale, ...]
    shape: tuple[int, ...]
    meets: NDArray[np.bool_]
    best: int | None = None
    name: str = ""
    best_words: str = ""


@dataclass(frozen=True)
class Line:
    """One curve of a study: branch name -> (motion, effort) in border units, and its parameter.

    Of two parameters that vary, `parameter` is the second and `panel` the first.
    """

    parameter: float
    branches: Mapping[str, tuple[FloatArray, FloatArray]]
    panel: float | None = None
