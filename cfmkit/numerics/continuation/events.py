"""The one location of events: a bisection for changes of stability, limit points, and whatever else has a sign."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.numerics.continuation.arc import step_along, unit_tangent
from cfmkit.numerics.continuation.path import PathEvent
from cfmkit.numerics.continuation.problem import Border, arc_weights, largest_motion
from cfmkit.numerics.continuation.steps import correct, hermite, predict

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.numerics.continuation.arc import ArcMove
    from cfmkit.numerics.continuation.path import Walk
    from cfmkit.numerics.continuation.problem import ContinuationProblem, PathEquilibrium

CLOSE_TO_BIFURCATION, CLOSE_TO_FOLD = 1e-6, 3e-4
"""Shares of the first values at which a location ends: beside a pitchfork rounding acts as an imperfection does, and
the drive of a fold is better known than its place, by the square."""
MAX_SAMPLES = 40
JUST_BEFORE = 1e-4  # of a step: how far the last equilibrium before a fold lies from it
SAME_PATH_VALUE = 0.03  # share of the first values below which a sample comes on one path
SAME_PATH_WIDTH = 5.0  # times its width by which the ends of a bracket may lie apart on one path
MAX_HALVINGS = 40  # until only one direction changes its stability
ONE_LOSS = 1e-4  # share of the way from the piece's begin below which several losses are one


class Located(NamedTuple):
    """Zero of a function of equilibria, between two of them."""

    x: FloatArray
    drive: float
    nearest: PathEquilibrium  # of the samples
    before: PathEquilibrium  # on both sides
    behind: PathEquilibrium
    share: float  # of the way between the first two
    within: tuple[PathEquilibrium, PathEquilibrium]  # the first two
    rounded: bool = False  # whether an imperfection rounds a bifurcation so that they lie on two paths

    def as_bifurcation(self, before: int, after: int, modes: Any = None) -> PathEvent:
        """Return the event between two numbers of unstable directions."""
        return PathEvent("bifurcation", self.drive, before, after, self.nearest, modes, self.within)


class _Sample(NamedTuple):
    share: float
    value: float
    at: PathEquilibrium


def locate(
    problem: ContinuationProblem,
    first: PathEquilibrium,
    last: PathEquilibrium,
    solve: Callable[[float], PathEquilibrium | None],
    value: Callable[[PathEquilibrium], float],
    close: float,
    patient: bool = True,
) -> Located | None:
    """Return where `value` vanishes between two equilibria, or None if they lie on two paths.

    `solve` returns an equilibrium at a share of the way. By the Illinois variant of false position, then interpolation
    through the three nearest samples. It is not one path if the value jumps, or if the sides of a narrow bracket stay
    apart: imperfect corners beside an unstable branch look like a bifurcation else. Without patience that ends it.
    """
    low, high = _Sample(0.0, value(first), first), _Sample(1.0, value(last), last)
    if low.value * high.value > 0:
        return None
    samples = [low, high]
    at_low, at_high, side = low.value, high.value, 0
    goal = close * max(abs(at_low), abs(at_high))
    for k in range(MAX_SAMPLES):
        part = at_low / (at_low - at_high) if k % 5 < 4 else 0.5
        share = low.share + (high.share - low.share) * part
        middle = solve(share)
        if middle is None:
            share = 0.5 * (low.share + high.share)
            middle = solve(share)
        if middle is None:
            break
        sample = _Sample(share, value(middle), middle)
        samples.append(sample)
        if sample.value * low.value > 0:
            low, at_low, at_high, side = sample, sample.value, (0.5 * at_high if side == 1 else at_high), 1
        else:
            high, at_high, at_low, side = sample, sample.value, (0.5 * at_low if side == -1 else at_low), -1
        if abs(sample.value) < goal or high.share - low.share < 1e-12:
            break
        if not patient and _lie_apart(problem, low, high, first, last):
            break
    if _lie_apart(problem, low, high, first, last):
        return None
    return _interpolate(samples, low, high, (first, last), SAME_PATH_VALUE * goal / close)


def _lie_apart(
    problem: ContinuationProblem, low: _Sample, high: _Sample, first: PathEquilibrium, last: PathEquilibrium
) -> bool:
    """Return True if the sides of a narrow bracket are on two paths."""
    width = high.share - low.share
    apart = largest_motion(problem, high.at.x - low.at.x)
    return width < 0.2 and apart > SAME_PATH_WIDTH * width * largest_motion(problem, last.x - first.x) + 1e-5


def _interpolate(
    samples: list[_Sample],
    low: _Sample,
    high: _Sample,
    within: tuple[PathEquilibrium, PathEquilibrium],
    largest: float,
) -> Located | None:
    """Return the place where the value vanishes by Lagrange's formula through the three smallest values."""
    smallest = sorted(samples, key=lambda sample: abs(sample.value))[:3]
    if abs(smallest[0].value) > largest:
        return None
    nearest = smallest[0]
    if len({sample.value for sample in smallest}) < 3:
        smallest = smallest[:1]
    weights = _root_weights(smallest)
    share = float(weights @ [sample.share for sample in smallest])
    if not low.share <= share <= high.share:
        smallest = [low, high]  # the third lies on another path
        weights = _root_weights(smallest)
        share = float(weights @ [sample.share for sample in smallest])
    x, drive = weights @ [sample.at.x for sample in smallest], float(weights @ [sample.at.drive for sample in smallest])
    return Located(x, drive, nearest.at, low.at, high.at, share, within)


def _root_weights(samples: list[_Sample]) -> FloatArray:
    """Return the weights of samples in Lagrange's interpolation to where their function vanishes."""
    return np.array([math.prod(b.value / (b.value - a.value) for b in samples if b is not a) for a in samples])


def stability_value(problem: ContinuationProblem, reference: PathEquilibrium) -> Callable[[PathEquilibrium], float]:
    """Return a function that vanishes where the number of unstable directions leaves that of an equilibrium."""

    softest: Callable[..., Any] | None = getattr(problem, "softest", None)
    mode: Any = None

    def value(at: PathEquilibrium) -> float:
        nonlocal mode
        if softest is not None:
            size, mode = softest(at, mode)
        else:
            size = abs(float(problem.modes(at, 1)[0][0]))
        return float(size if at.unstable == reference.unstable else -size)

    return value


def locate_loss(walk: Walk, new: PathEquilibrium) -> Located | None:
    """Return the first change of stability between here and a new equilibrium on the same path.

    Where an imperfection may round a bifurcation it is looked for by as short a step; if the path with the unstable
    directions is another there, the last equilibrium that is stable stands for it, where the path would be without it.
    """
    problem, old, widest = walk.problem, walk.current, walk.options.corner * walk.options.span or np.inf
    begin = walk.origin.drive
    narrowest = min(ONE_LOSS * abs(new.drive - begin), 1e-3 * abs(old.drive - begin) + 1e-12 * walk.options.span)
    for _ in range(MAX_HALVINGS):
        width = abs(new.drive - old.drive)
        if (abs(new.unstable - old.unstable) <= 1 and width <= widest) or width < narrowest:
            break
        drive = 0.5 * (old.drive + new.drive)
        middle = correct(problem, hermite(old, new, drive), drive)
        if middle is None:
            break
        old, new = (middle, new) if middle.unstable == walk.current.unstable else (old, middle)
    if not walk.options.corner:
        return locate_stability_change(problem, old, new)
    if abs(new.drive - old.drive) > widest:
        return None
    located = locate_stability_change(problem, old, new, patient=False)
    return located or Located(predict(walk, old.drive), old.drive, old, old, new, 0.0, (old, new), rounded=True)


def locate_stability_change(
    problem: ContinuationProblem, first: PathEquilibrium, last: PathEquilibrium, patient: bool = True
) -> Located | None:
    """Return the change of stability between two equilibria at different drives."""

    def solve(share: float) -> PathEquilibrium | None:
        drive = first.drive + share * (last.drive - first.drive)
        return correct(problem, hermite(first, last, drive), drive)

    return locate(problem, first, last, solve, stability_value(problem, first), CLOSE_TO_BIFURCATION, patient)


def relocate(
    problem: ContinuationProblem, event: PathEvent, lift: Callable[[FloatArray], FloatArray], span: float
) -> float | None:
    """Return the drive of an event of a path on a finer mesh, into whose unknowns `lift` takes those of the path.

    None if it is not there: the path is another then.
    """
    if event.kind == "limit point" and event.nearest is not None:
        lifted = event.nearest._replace(x=lift(event.nearest.x), rate=lift(event.nearest.rate))
        along = np.append(lifted.rate, 1.0)
        row = arc_weights(problem, span) * along / np.linalg.norm(along)
        moved = correct(problem, lifted.x, lifted.drive, Border(row, float(row @ lifted.place)))
        return None if moved is None else event.drive + moved.drive - lifted.drive
    if event.within is None:
        return None
    first, last = (correct(problem, lift(at.x), at.drive) for at in event.within)
    if first is None or last is None:
        return None
    if (first.unstable, last.unstable) != tuple(at.unstable for at in event.within):
        return None
    # of several changes next to each other it is that to the stable side
    located = locate_stability_change(problem, *((first, last) if event.before < event.after else (last, first)))
    return None if located is None else located.drive


def locate_stability_change_on_arc(problem: ContinuationProblem, move: ArcMove, span: float) -> Located | None:
    """Return the change of stability within a step along the arc."""
    first, last = move.old.place, move.new.place
    row = arc_weights(problem, span) * (last - first)
    row /= np.linalg.norm(row)

    def solve(share: float) -> PathEquilibrium | None:
        place = first + share * (last - first)
        return correct(problem, place[:-1], float(place[-1]), Border(row, float(row @ place)))

    return locate(problem, move.old, move.new, solve, stability_value(problem, move.old), CLOSE_TO_BIFURCATION)


def locate_fold(problem: ContinuationProblem, move: ArcMove, span: float) -> tuple[Located, int] | None:
    """Return where the drive turns back within a step along the arc, and the unstable directions behind it.

    At a limit point their number changes by one; at the end of a branch it does not. They are counted well behind the
    fold: counts right beside it are noise.
    """

    def solve(share: float) -> PathEquilibrium | None:
        step = step_along(problem, move.old, move.tangent_before, share * move.length, span)
        return None if step is None else step.new

    def value(at: PathEquilibrium) -> float:
        if at is move.old:
            return float(move.tangent_before[-1])
        return float(unit_tangent(problem, at, move.tangent_before, span)[-1])

    fold = locate(problem, move.old, move.new, solve, value, CLOSE_TO_FOLD)
    if fold is None:
        return None
    just_before = solve(fold.share - JUST_BEFORE)
    if (
        just_before is not None
        and just_before.unstable == move.old.unstable
        and value(just_before) * value(move.old) > 0
    ):
        fold = fold._replace(before=just_before)
    past = solve(fold.share + 0.3 * (1 - fold.share))
    return fold, move.new.unstable if past is None or past.unstable == move.old.unstable else past.unstable
