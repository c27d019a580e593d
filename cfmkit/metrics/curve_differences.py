"""Two curves over one motion: how far one is from the other, in numbers, branch by branch.

What a model is compared with may be a measurement or another model. Nothing is
extrapolated, and a branch that turns back is not compared: it is many-valued.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.metrics.branches_cut_to_window import Undefined, Window, traces
from cfmkit.results import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve

    Measure = tuple[Callable[["Difference"], float], str]


@dataclass(frozen=True, eq=False)
class Difference:
    """Difference of two curves on one branch."""

    values: FloatArray  # (n,) one less the other at each place [N or N m]; NaN where one of them has no value
    reason: str  # why they cannot be summed up, should one of them be NaN
    # (n,) how much each place counts, such as the way that it stands for; None: all alike
    weights: FloatArray | None = None


def rms(difference: Difference) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.average(difference.values**2, weights=difference.weights)))


def largest(difference: Difference) -> float:
    """Return the value that is largest in magnitude, with its sign."""
    return float(difference.values[np.argmax(np.abs(difference.values))])


def mean(difference: Difference) -> float:
    """Return the mean."""
    return float(np.average(difference.values, weights=difference.weights))


def summarize(
    differences: Mapping[str, Difference], measures: Mapping[str, Measure], kind: str, tag: str = ""
) -> dict[str, Quantity]:
    """Return what there is to say about differences per branch, and over all where there are several, by name.

    Parameters
    ----------
    differences : mapping of str to Difference
        By branch.
    measures : mapping of str to (callable, str)
        Name -> (function of a difference, definition; ``{}`` in it becomes the kind).
    kind : {"force", "torque"}
        Of the curves.
    tag : str
        Of which curve, where there are several: ``name[tag]`` and ``name[tag,branch]``.
    """
    several, found = len(differences) > 1, {}
    whole = {"": _joined(differences)} if several else {}
    for branch, item in (whole | dict(differences)).items():
        inside = ",".join(part for part in (tag, branch if several else "") if part)
        for name, (function, words) in measures.items():
            value = function(item) if len(item.values) and np.isfinite(item.values).all() else None
            reason = item.reason if value is None else ""
            found[f"{name}[{inside}]" if inside else name] = Quantity(value, kind, words.format(kind), reason)
    return found


def _joined(differences: Mapping[str, Difference]) -> Difference:
    """Return the differences of all branches, with the reason of the first that has a gap."""
    items = list(differences.values())
    gaps = [item.reason for item in items if not np.isfinite(item.values).all()]
    weights = [np.ones(len(item.values)) if item.weights is None else item.weights for item in items]
    values = np.concatenate([item.values for item in items])
    return Difference(values, gaps[0] if gaps else items[0].reason, np.concatenate(weights))


def counterpart(curve: Curve, branch: str, way: float) -> str:
    """Return the branch of a curve to compare with one of another: by name, else by its direction.

    Parameters
    ----------
    curve : Curve
        Where the branch is looked for.
    branch : str
        Name of the other curve's branch.
    way : float
        Positive if the motion grows along the other curve's branch.
    """
    if branch in curve.branches or len(curve.branches) == 1:
        return branch if branch in curve.branches else curve.branches[0]
    for name in curve.branches:
        motion = curve.on(name).motion
        if way * (motion[-1] - motion[0]) > 0:
            return name
    return curve.branches[0]


def effort_at(curve: Curve, branch: str, places: FloatArray) -> FloatArray:
    """Return the effort of a branch at some places, linearly between its points; NaN where it has none.

    Raises
    ------
    Undefined
        If the branch turns back.
    """
    trace = next(item for item in traces(curve) if item.name == branch)
    if not trace.way:
        raise Undefined(f"branch {branch!r} turns back: its {curve.kind} is many-valued")
    motion, effort = trace.motion[:: trace.way], trace.effort[:: trace.way]
    values: FloatArray = np.interp(places, motion, effort, left=np.nan, right=np.nan)
    return values


def overlap(extents: Iterable[tuple[float, float]], wanted: Window | None = None) -> Window | None:
    """Return where all of several intervals of the motion exist, inside the window that is wanted; None if nowhere.

    Examples
    --------
    >>> overlap([(0.0, 0.2), (0.05, 0.3)], Window(0.1, 0.4))
    Window(lo=0.1, hi=0.2)
    """
    ends = [*extents, *([(wanted.lo, wanted.hi)] if wanted else [])]
    lo, hi = max(end[0] for end in ends), min(end[1] for end in ends)
    return Window(lo, hi) if lo < hi else None
