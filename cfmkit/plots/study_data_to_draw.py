"""Outcome of a study, as its pictures need it: values in border units, no specification, no journal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.arrays import ShortRepr
from cfmkit.plots.axis_labels_and_headings import axis_label

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray


PERCENT_DIMENSION = "percent"  # dimension of shares that are drawn in per cent
MAX_LABEL_LENGTH = 64  # characters of an axis label: so many of 8 pt fit on 92 mm of print, the axis of a map


@dataclass(frozen=True, repr=False)
class DrawnScale(ShortRepr):
    """Something that is drawn: a parameter or a metric, in border units."""

    # name, dimension: for its label
    name: str
    dimension: str
    values: FloatArray  # (n,) one for each point; indices into `words` where those are given
    words: tuple[str, ...] = ()  # of a parameter or a metric that is not a number
    short: str = ""  # what it is called beside others; the last part of the name where that is empty
    about: str = ""  # what it is, in a few words; for its axis

    @property
    def label(self) -> str:
        """Label of the axis: the short name, with its unit."""
        short = self.short or self.name.rpartition(".")[2]
        if self.dimension == PERCENT_DIMENSION:
            return f"{short.replace('_', ' ')} [%]"
        known = self.dimension not in ("text", "count")
        return axis_label(short, self.dimension) if known else short.replace("_", " ")

    @property
    def axis(self) -> str:
        """The label with what it is, where an axis has room for it: ``positive.length: of one leaf, L1 [mm]``."""
        short, bracket, unit = self.label.partition(" [")
        path = self.name.removeprefix("mechanism.").replace("_", " ")
        reported = f"{path}: {self.about}{bracket}{unit}"
        return reported if self.about and len(reported) <= MAX_LABEL_LENGTH else f"{short}{bracket}{unit}"

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


def short_names(paths: Sequence[str]) -> tuple[str, ...]:
    """Return the last part of each path, with as many parts before it as tell it from the others.

    Examples
    --------
    >>> short_names(["mechanism.bistable.length", "mechanism.positive.length", "mechanism.springs.stiffness.0"])
    ('bistable length', 'positive length', 'stiffness 0')
    """
    parts = [path.split(".") for path in paths]
    counts = [2 if one[-1].isdigit() else 1 for one in parts]
    while True:
        names = [" ".join(one[-count:]) for one, count in zip(parts, counts, strict=True)]
        longer = [
            count + (names.count(name) > 1 and count < len(one))
            for one, name, count in zip(parts, names, counts, strict=True)
        ]
        if longer == counts:
            return tuple(names)
        counts = longer


@dataclass(frozen=True, repr=False)
class StudyMarks(ShortRepr):
    """Outcome of a study, as its pictures need it."""

    # varied, metrics: parameters and the metrics to draw
    varied: tuple[DrawnScale, ...]
    metrics: tuple[DrawnScale, ...]
    shape: tuple[int, ...]  # numbers of values of the parameters of a grid; empty if the points are no grid
    meets: NDArray[np.bool_]  # (n,) whether a point was solved and meets every requirement
    best: int | None = None  # index of the best point
    name: str = ""  # whose study it is, for the heading
    best_words: str = ""  # what makes the best point the best, for the key


@dataclass(frozen=True)
class StudyCurve:
    """One curve of a study: branch name -> (motion, effort) in border units, and its parameter.

    Of two parameters that vary, `parameter` is the second and `panel` the first.
    """

    parameter: float
    branches: Mapping[str, tuple[FloatArray, FloatArray]]
    panel: float | None = None
