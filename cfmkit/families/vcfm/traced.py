"""A traced beam network as a function: force, stress and form at any travel, from converged points of its path.

Between two bifurcations the force is smooth, and a cubic spline through the points of the path gives it to 1e-7; the
stress, which begins like a square root where a leaf buckles, is interpolated linearly. A leaf with a stated waviness
has corners instead of bifurcations: there the path is traced densely, and all is linear.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.beams import Network, Path
    from cfmkit.curves import FloatArray

DOWN = -0.5 * np.pi

GRIDS = (127, 113)
"""Points asked for along a path; the second where the first leave a doubt."""

CLOSE = 0.02
"""Bifurcations closer than this share of the travel are looked at again."""

DENSE = 600
"""Points asked for of a path with corners."""


@dataclass(frozen=True)
class Traced:
    """Converged points of a path, from zero on.

    Attributes
    ----------
    places : (n,) array
        Travel, all of one sign [m].
    force, stress : (n,) array
        [N, Pa].
    stable, buckled : (n,) array of bool
        Whether the form is stable, and another than as made.
    edges : tuple of float
        Zero, the bifurcations and the end [m].
    smooth : bool
        Whether the force is smooth between the edges.
    problem : str
        Why the path ends early; empty if it does not.
    """

    places: FloatArray
    force: FloatArray
    stress: FloatArray
    stable: Any
    buckled: Any
    edges: tuple[float, ...]
    smooth: bool
    problem: str = ""

    @property
    def sense(self) -> float:
        """1 for travels from zero up, -1 for those from zero down."""
        return -1.0 if self.edges[-1] < 0 else 1.0

    def _piece(self, travel: FloatArray) -> Any:
        inner = self.sense * np.array(self.edges[1:-1])
        return np.searchsorted(inner, self.sense * np.asarray(travel), side="right")

    @cached_property
    def _laws(self) -> list[Callable[[FloatArray], Any]]:
        """One function of the travel for each piece between two edges."""
        from scipy.interpolate import CubicSpline

        pieces = self._piece(self.places)
        found: list[Callable[[FloatArray], Any]] = []
        for number in range(len(self.edges) - 1):
            here = np.flatnonzero(pieces == number)
            x, y = self.sense * self.places[here], self.force[here]
            if self.smooth and len(here) >= 4:
                found.append(CubicSpline(x, y))
            elif len(here):
                found.append(partial(np.interp, xp=x, fp=y))
            else:
                found.append(partial(np.interp, xp=self.sense * self.places, fp=self.force))
        return found

    def at(self, travel: FloatArray) -> tuple[FloatArray, FloatArray, Any, Any]:
        """Return force, stress, stability and form at some travels [m]; NaN beyond the end."""
        x, pieces = self.sense * np.asarray(travel, dtype=float), self._piece(travel)
        force = np.empty(x.shape)
        for number, law in enumerate(self._laws):
            chosen = pieces == number
            force[chosen] = law(x[chosen])
        own = self.sense * self.places
        stress = np.interp(x, own, self.stress)
        beyond = x > self.sense * self.edges[-1] * (1 + 1e-9) + 1e-15
        force[beyond], stress[beyond] = np.nan, np.nan
        return force, stress, self._stable[pieces], self._buckled[pieces]

    @property
    def buckled_range(self) -> tuple[float, float]:
        """Where another form than as made is taken, from and to [m]; NaN where none is."""
        found = np.flatnonzero(self._buckled)
        return (self.edges[found[0]], self.edges[found[-1] + 1]) if len(found) else (np.nan, np.nan)

    @cached_property
    def _buckled(self) -> Any:
        """Whether each piece is on a branch that was not there as made."""
        return self._most(self.buckled, False)

    @cached_property
    def _stable(self) -> Any:
        """Whether each piece is stable."""
        return self._most(self.stable, True)

    def _most(self, flags: Any, empty: bool) -> Any:
        """Return what most of the points of each piece are."""
        pieces = self._piece(self.places)
        found = [flags[pieces == number] for number in range(len(self.edges) - 1)]
        return np.array([one.mean() > 0.5 if len(one) else empty for one in found])


def traced(network: Network, node: str, end: float, **control: Any) -> Traced:
    """Return what a network does while a node moves down by up to `end` [m], or up where that is negative."""
    grids = (DENSE,) if control.get("imperfection") else GRIDS
    for count in grids:
        found = _once(network, node, end * np.arange(1, count + 1) / count, control)
        gaps = np.abs(np.diff(found.edges[1:-1]))
        # bifurcations close together may come from a point asked for next to one: other points tell
        if found.problem or not (gaps < CLOSE * abs(found.edges[-1])).any():
            break
    return found


def _once(network: Network, node: str, places: FloatArray, control: dict[str, Any]) -> Traced:
    from cfmkit.beams import Control, Displacement, PathStatus, trace

    path: Path = trace(network, Displacement(node, DOWN, places), Control(**control))
    sense = np.sign(places[-1])
    kept = _forward(sense * path.drive, np.asarray(path.accurate))
    stress = np.max([path.beam_stress(name)[0] for name in network.beams], axis=0)[kept]
    reached = float(path.drive[kept[-1]]) if len(kept) else 0.0
    whole = abs(reached - places[-1]) <= 1e-9 * abs(places[-1])
    events = [event.drive for event in path.events if event.kind == "bifurcation"]
    problem = "" if path.status is PathStatus.COMPLETE and whole else path.message
    inner = tuple(sorted({round(event, 10) for event in events if 0 < sense * event < sense * reached}, key=abs))
    names = np.asarray(path.branch)[kept]
    first = 0 if len(kept) and path.drive[kept[0]] == 0 else 1  # the pose as made, where the path does not list it
    zero = [0.0] * first
    return Traced(
        np.concatenate([zero, path.drive[kept]]),
        np.concatenate([zero, path.effort[kept]]),
        np.concatenate([zero, stress]),
        np.concatenate([[True] * first, path.stable[kept]]).astype(bool),
        np.concatenate([[False] * first, np.char.startswith(names, "bifurcated")]).astype(bool),
        (0.0, *inner, reached),
        not control.get("imperfection"),
        problem,
    )


def _forward(drive: FloatArray, accurate: Any) -> Any:
    """Return the indices of accurate points at which the drive is farther than ever before."""
    farthest = np.maximum.accumulate(np.concatenate([[-1e-30], drive[:-1]])) if len(drive) else drive
    return np.flatnonzero(accurate & (drive > farthest + 1e-15))
