"""A path of the functional at every place of its drive: equilibria between its points, and the extremes there.

How places are chosen, corners passed and extremes found: `cfmkit.elastica.outcome.between_points`. Here an equilibrium
is one of the functional, and stresses are cheap: they are known of all beams at all points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica.mechanics.design_derivatives import Equilibria
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.outcome.between_points import FEWEST, KNOWN, BetweenLoads, BetweenPoints

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.results.path import EquilibriumPath


class _Spot(NamedTuple):
    """An equilibrium as `BetweenPoints` takes it: free unknowns, drive, unstable directions."""

    y: Any
    drive: float
    unstable: int


class _OfFunctional:
    """Equilibria of the functional between points: what `BetweenPoints` needs of an `EquilibriumPath`."""

    path: Any
    axial: bool
    _order: Any
    _stresses: Any

    @property
    def _known_drives(self) -> FloatArray:
        drives: FloatArray = self.path.at.drive
        return drives

    @property
    def _known_unknowns(self) -> FloatArray:
        return np.asarray(self.path.at.z[:, self.path.network.free])

    @property
    def _known_unstable(self) -> Any:
        return self.path.unstable

    def _solve(self, y: FloatArray, drive: float, row: Any = None, goal: Any = None) -> Any:
        own = self._equations()
        state = own.solve(y, drive) if row is None else own.solve(y, drive, row, goal)
        return None if state is None else _Spot(state.free, state.way, state.unstable)

    def _equations(self) -> Any:
        known = vars(self).get("_own_equations")
        if known is None:
            known = vars(self)["_own_equations"] = equations(self.path.network)
        return known

    def _path_of(self, y: FloatArray, loads: FloatArray, near: Any, accurate: Any) -> EquilibriumPath:
        network = self.path.network
        z = network.base + loads[:, None] * network.rate
        z[:, network.free] = y
        path: EquilibriumPath = replace(
            self.path,
            at=Equilibria(network, z, loads),
            unstable=self.path.unstable[self._order][near],
            requested=np.full(len(loads), -1),
            branch=self.path.branch[self._order][near],
            accurate=accurate,
        )
        return path

    def _poses(self, changes: FloatArray) -> FloatArray:
        moves = self.path.network.free < self.path.network.n_motions
        return np.asarray(np.abs(changes[:, moves]).max(axis=1, initial=0.0))

    def largest_stress(self, branch: str, low: float, high: float, /) -> float:
        """Return the largest stress in a window of the drive [Pa]."""
        scale, ends = self._scale, np.array([low, high])  # type: ignore[attr-defined]
        there = self.at(ends)  # type: ignore[attr-defined]
        solved = np.max([there.beam_stress(name, self.axial)[0] for name in self.path.net.beams], axis=0)
        known = self.stress(branch, ends)  # type: ignore[attr-defined]
        tops = [
            values[(places >= low) & (places <= high)]
            for stretch, beams in self._stresses
            for places, values in ((scale * stretch.drive(t), own) for t, own in beams)
        ]
        return float(np.max(np.concatenate([*tops, np.where(there.accurate, solved, known)])))


@dataclass(frozen=True, eq=False, repr=False)
class BetweenStates(_OfFunctional, BetweenPoints):  # type: ignore[misc]
    """The effort and the stress of a path under a motion at every place (a `cfmkit.results.ClosedForm`)."""

    @property
    def _scale(self) -> float:
        scale: float = self.path.at.network.scales.drive  # type: ignore[attr-defined]
        return scale


@dataclass(frozen=True, eq=False)
class BetweenLoadStates(_OfFunctional, BetweenLoads):  # type: ignore[misc]
    """The same of a path under a load, over the motion of a node."""


def between_points(
    path: EquilibriumPath, unit: float = 1.0, axial: bool = True, allowed: float | None = None
) -> BetweenStates | None:
    """Return a path at every place of its drive; None of one that turns back, is too short, or misses its tolerance.

    Parameters
    ----------
    path : EquilibriumPath
        Under a displacement or a rotation.
    unit : float
        What the effort is multiplied by: parts side by side.
    axial : bool
        Whether the stress has its axial part.
    allowed : float or None
        Stress [Pa]; where it is passed is solved for.
    """
    if isinstance(path.given, Loading) or len(path) < FEWEST or not np.all(path.accurate):
        return None
    steps = np.diff(path.at.drive)
    if not ((steps > 0).all() or (steps < 0).all()):
        return None
    return BetweenStates(path, unit, axial, allowed)  # type: ignore[arg-type]


def between_loads(
    path: EquilibriumPath,
    node: str,
    along: float | None,
    unit: float = 1.0,
    axial: bool = True,
    allowed: float | None = None,
) -> BetweenLoadStates | None:
    """Return a path under loads at every place of a node's motion.

    None where the motion turns back, where a link with an arm moves the node, where points are too few, or miss the
    tolerance.

    Parameters
    ----------
    path : EquilibriumPath
        Under loads.
    node : str
        Whose motion it is over.
    along : float or None
        Direction of the motion [rad]; None: its rotation.
    unit : float
        What the load is multiplied by: parts side by side.
    axial : bool
        Whether the stress has its axial part.
    allowed : float or None
        Stress [Pa]; where it is passed is solved for.
    """
    network = path.network
    if len(path) < FEWEST or not np.all(path.accurate) or (along is not None and node not in network.bodies):
        return None
    place = network.nodes[node]
    unknowns, frame = network.attachments.unknowns[place], network.attachments.frame[place]
    if along is None:
        parts, scale = {int(unknowns[3]): 1.0}, 1.0
    else:
        cos, sin = np.cos(along), np.sin(along)
        shares = cos * frame[0] + sin * frame[1], sin * frame[0] - cos * frame[1]
        parts, scale = dict(zip(unknowns[:2].tolist(), shares, strict=True)), network.scales.length
    row, slots = np.zeros(len(network.free) + 1), {unknown: k for k, unknown in enumerate(network.free.tolist())}
    for unknown, share in parts.items():
        if unknown in slots:
            row[slots[unknown]] += share
    moved = path.motion(node)
    motion = moved[:, 2] if along is None else moved[:, 0] * np.cos(along) + moved[:, 1] * np.sin(along)
    rest = motion - scale * (path.at.z[:, network.free] @ row[:-1])
    steps = np.diff(motion)
    if not row.any() or np.ptp(rest) > KNOWN * np.ptp(motion) or not ((steps > 0).all() or (steps < 0).all()):
        return None
    return BetweenLoadStates(path, unit, axial, allowed, read_only(row), scale, float(rest.mean()))  # type: ignore[arg-type]
