"""Analysis of a beam mechanism: the path of its equilibria, stresses, and the forces of each beam.

Beams bend without stretching unless the specification says otherwise [Lan]; with stretching and shear they follow
Reissner. The force is that of all copies together; the forces of single beams are those of one copy.

Reference
---------
[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism for adaptive robot end-effector
operations (2010), sec. 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.curves import Column, Curve
from cfmkit.elastica import Path, PathStatus, trace
from cfmkit.elastica.model.bundle import coils
from cfmkit.elastica.model.layout import Layout
from cfmkit.elastica.outcome.path import most_stressed
from cfmkit.errors import InputError
from cfmkit.families.beam.build import Assembly, assemble, mirror_axis, resolve, thickest_of
from cfmkit.families.beam.checks import findings_of
from cfmkit.families.beam.endings import ending_of
from cfmkit.families.beam.strips import Gap, mirrored, smallest_gap
from cfmkit.families.beam.surface.ride import curve_of, findings_along, ride, values_along
from cfmkit.families.beam.values import natural, travel_of, values_of
from cfmkit.families.beam.words import in_units
from cfmkit.results import Result, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Kind
    from cfmkit.elastica.vibration import Frequencies
    from cfmkit.families.base import Run
    from cfmkit.families.beam.spec import BeamSpec

_NOTHING = 1e-15
_POSES = 7
_FLUTTER = 4  # modes among which two may meet: it is the lowest ones that do
_ALONG = np.linspace(0.0, 1.0, 1001)  # where a coil's radius is looked at: a polynomial of few terms


@dataclass(frozen=True, eq=False)
class Solution:
    """A solved mechanism, as checks, scalar values and pictures need it.

    Attributes
    ----------
    assembly : Assembly
        The network and what is done to it.
    path : Path
        Its equilibria.
    keep : (n,) int array
        Which points of the path make the curve: those asked for, or all where the path is followed through folds.
    """

    assembly: Assembly
    path: Path
    keep: Any

    @property
    def spec(self) -> BeamSpec:
        """The specification."""
        return self.assembly.spec

    @cached_property
    def motion(self) -> FloatArray:
        """Displacement or rotation of the driven node along the drive [m or rad]."""
        kind = self.spec.mechanism.drive.kind
        if kind in ("displacement", "rotation"):
            return read_only(self.path.drive[self.keep])
        moved = self.path.motion(self.assembly.driven)[self.keep]
        if kind == "moment":
            return read_only(moved[:, 2])
        angle = self.assembly.direction
        along = moved[:, 0] * np.cos(angle) + moved[:, 1] * np.sin(angle)
        return read_only(np.where(np.abs(along) > _NOTHING * np.abs(along).max(), along, 0.0))

    @property
    def motion_dimension(self) -> str:
        """The dimension of the motion: "length" or "angle"."""
        return "angle" if self.spec.mechanism.drive.kind in ("rotation", "moment") else "length"

    @cached_property
    def effort(self) -> FloatArray:
        """Force [N] or torque [N m] of all copies; none where the tolerance is not reached."""
        by_motion = self.spec.mechanism.drive.kind in ("displacement", "rotation")
        effort = self.path.effort if by_motion else self.path.drive
        return read_only(np.where(self.accurate, self.assembly.effort_unit * effort[self.keep], np.nan))

    @cached_property
    def accurate(self) -> Any:
        """Whether each point reaches the tolerance."""
        return read_only(np.broadcast_to(self.path.accurate, (len(self.path),))[self.keep], np.bool_)

    @cached_property
    def stresses(self) -> Mapping[str, tuple[FloatArray, FloatArray]]:
        """Of each beam, the largest stress [Pa] and its place, at every point of the curve."""
        axial, keep = self.spec.stress == "total", self.keep
        found = {name: self.path.beam_stress(name, axial) for name in self.path.layout.network.beams}
        return {name: (value[keep], place[keep]) for name, (value, place) in found.items()}

    @cached_property
    def stress(self) -> FloatArray:
        """The largest stress at every point of the curve [Pa]."""
        largest = np.max([value for value, _ in self.stresses.values()], axis=0)
        return read_only(np.where(self.accurate, largest, np.nan))

    @cached_property
    def stress_at(self) -> tuple[Any, FloatArray]:
        """The beam with the largest stress at every point of the curve, and the place on it."""
        values, places = (np.array(rows) for rows in zip(*self.stresses.values(), strict=True))
        best, pick = most_stressed(values, places), np.arange(len(self.keep))
        return read_only(np.array(list(self.stresses))[best], np.str_), read_only(places[best, pick])

    @cached_property
    def stable(self) -> Any:
        """Whether each point is a stable equilibrium that reaches the tolerance.

        Under loads that turn with their node all motions decide where masses are known, else the path's count.
        """
        found = self.frequencies if self.follows else None
        stable = self.path.stable[self.keep] if found is None else ~(found.flutters | found.diverges)
        return read_only(stable & self.accurate, np.bool_)

    @cached_property
    def follows(self) -> bool:
        """Whether a load turns with its node: stability may then be lost by flutter."""
        return bool(self.path.solver.model.load_follows.any())

    @cached_property
    def frequencies(self) -> Frequencies | None:
        """Natural frequencies about every point of the curve; None where none are asked for and nothing can flutter."""
        masses = self.assembly.masses()
        count = self.spec.analysis.modes or (_FLUTTER if self.follows else 0)
        if masses is None or not count or not len(self.keep):
            return None
        from cfmkit.elastica.vibration import frequencies

        return frequencies(self.path, masses, count, self.keep, self.assembly.hold())

    @cached_property
    def cross_stiffness(self) -> FloatArray:
        """Stiffness of the driven node across the drive at every point of the curve, of all copies [N/m].

        nan where nothing gives way, where the tolerance is not reached, and of drives that turn.
        """
        if self.spec.mechanism.drive.kind in ("rotation", "moment") or not len(self.keep):
            return read_only(np.full(len(self.keep), np.nan))
        from cfmkit.elastica.outcome.crosswise import cross_stiffness

        found = cross_stiffness(self.path, self.assembly.driven, self.assembly.direction, self.keep)
        known = self.accurate & np.isfinite(found)
        return read_only(np.where(known, self.assembly.parallel * found, np.nan))

    @cached_property
    def gaps(self) -> tuple[Gap | None, Gap | None]:
        """The smallest gap between two beams before any load, and of some places of the curve [m]."""
        poses = sorted(set(np.linspace(0, len(self.keep) - 1, _POSES).astype(int).tolist()))
        found = [self._gap(int(self.keep[pose])) for pose in poses]
        moving = min((gap for gap in found if gap is not None), default=None)
        return found[0], moving

    def _gap(self, point: int) -> Gap | None:
        network = self.path.layout.network
        lines = {name: self.path.shape(name, point) for name in network.beams}
        halves = {name: 0.5 * thickest_of(beam.section) for name, beam in network.beams.items()}
        axis = mirror_axis(self.assembly)
        if axis is not None:
            lines |= {f"{name}'": mirrored(line, *axis) for name, line in lines.items()}
        return smallest_gap(lines, halves)

    def beam_force(self, beam: str) -> FloatArray:
        """Return force and moment that a beam exerts on its last node, (n, 3) [N, N, N m], of one copy."""
        return read_only(-self.path.end_force(beam, 1)[self.keep])


def analyze(spec: BeamSpec, run: Run) -> Result:
    """Return the force-displacement path of a beam mechanism, with everything that is wrong with it.

    Parameters
    ----------
    spec : BeamSpec
        The mechanism and how far its drive goes.
    run : Run
        Not needed here: one path is solved at once.

    Returns
    -------
    Result
        PARTIAL if the path ends before what was asked, NO_EQUILIBRIUM if there is none under the constant loads.
    """
    solution, resolved = solve(spec), resolve(spec)
    if len(solution.keep) < 2:
        message = f"no curve: {ending_of(solution).message}"
        return Result(resolved, Status.NO_EQUILIBRIUM, message, warnings=findings_of(solution))
    status, message = _ending(solution)
    curves: tuple[Curve, ...] = (_curve(solution),)
    values, warnings = values_of(solution), findings_of(solution)
    if (along := ride(solution)) is not None:
        curves += (curve_of(along),) if len(along.place) > 1 else ()
        values, warnings = {**values, **values_along(along)}, (*warnings, *findings_along(along))
        if along.missing and status is Status.COMPLETE:
            status, message = Status.PARTIAL, along.missing
    return Result(
        spec=resolved,
        status=status,
        message=message,
        curves=curves,
        values=values,
        warnings=warnings,
        travel=travel_of(solution),
        target=_target(spec),
        reference=None if spec.analysis.reference is None else float(spec.analysis.reference),
        allowable_stress=solution.assembly.allowable_stress,
        state=solution,
    )


def solve(spec: BeamSpec) -> Solution:
    """Return the path of a mechanism as its specification asks for it."""
    assembly = assemble(spec)
    _refuse_tight_coils(assembly)
    path = trace(assembly.network, assembly.drive(), assembly.control())
    return Solution(assembly, path, _kept(spec, path))


def _refuse_tight_coils(assembly: Assembly) -> None:
    """Refuse coils that are wound more tightly than strips of their thickness can be: the inside would have no length.

    Thousands of steps would be needed to follow them.
    """
    network = assembly.network
    wound = [name for name, beam in network.beams.items() if coils(beam)]
    fits = Layout(network, assembly.drive()).fits if wound else {}
    for name in wound:
        turns = np.abs(np.diff(fits[name].angle(_ALONG, 0.5))) / np.diff(_ALONG)
        radius, thick = float(fits[name].length / turns.max()), thickest_of(network.beams[name].section)
        if radius < 0.5 * thick:
            raise InputError(
                f"mechanism.beams.{name}.shape winds the beam to a radius of {format_short(radius, 'length')}, less "
                f"than half of its thickness of {format_short(thick, 'length')}: fewer turns, or a thinner beam"
            )


def _kept(spec: BeamSpec, path: Path) -> Any:
    """Return which points make the curve: those asked for, or all where folds may make it many-valued."""
    keep = np.arange(len(path)) if spec.analysis.through_folds else path.at_asked
    return read_only(keep, np.int64)


def _ending(solution: Solution) -> tuple[Status, str]:
    path = solution.path
    if path.status is PathStatus.COMPLETE:
        return Status.COMPLETE, ""
    return Status.PARTIAL, ending_of(solution).message


def _target(spec: BeamSpec) -> float | None:
    rescale = spec.design.rescale if spec.design else None
    return rescale.force if rescale else None


def _curve(solution: Solution) -> Curve:
    """Return the curve with stresses and the forces of each beam."""
    keep, path = solution.keep, solution.path
    extra = {
        "max_stress": Column(solution.stress, "stress"),
        "stress_beam": Column(solution.stress_at[0], "text"),
        "stress_place": Column(solution.stress_at[1], "ratio"),
        "path": Column(_branches(solution), "text"),
    }
    for name in path.layout.network.beams:
        x, y, moment = solution.beam_force(name).T
        extra |= {
            f"{name}_force_x": Column(x, "force"),
            f"{name}_force_y": Column(y, "force"),
            f"{name}_moment": Column(moment, "torque"),
        }
    extra |= _outputs(solution) | _frequencies(solution)
    kind: Kind = "torque" if solution.spec.mechanism.drive.kind in ("rotation", "moment") else "force"
    return Curve(solution.motion, solution.effort, np.repeat(["load"], len(keep)), solution.stable, extra, kind)


def _outputs(solution: Solution) -> dict[str, Column]:
    """Return the motions and reactions that the specification names, of one copy."""
    keep, path, outputs = solution.keep, solution.path, solution.spec.analysis.outputs
    columns: dict[str, Column] = {}
    for name in outputs.nodes:
        x, y, turn = path.motion(name)[keep].T
        columns |= {f"{name}_x": Column(x, "length"), f"{name}_y": Column(y, "length")}
        columns[f"{name}_rotation"] = Column(turn, "angle")
    for name in outputs.reactions:
        x, y, moment = path.reaction(name)[keep].T
        columns |= {f"{name}_fx": Column(x, "force"), f"{name}_fy": Column(y, "force")}
        columns[f"{name}_m"] = Column(moment, "torque")
    if outputs.cross_stiffness:
        columns["cross_stiffness"] = Column(solution.cross_stiffness, "stiffness")
    if solution.spec.mechanism.drive.kind == "loads":
        columns["load_factor"] = Column(path.drive[keep], "factor")
    return columns


def _frequencies(solution: Solution) -> dict[str, Column]:
    """Return the natural frequencies that were asked for: empty where a pose is not stable, or not accurate."""
    found, columns = solution.frequencies, {}
    for k in range(solution.spec.analysis.modes if found is not None else 0):
        for name, values in natural(solution).items():
            columns[f"frequency_{k + 1}_{name}"] = Column(values[:, k], "frequency")
    return columns


def _branches(solution: Solution) -> Any:
    """Return the name of the branch at every point, with units."""
    names = solution.path.branch[solution.keep]
    told = {name: in_units(solution.assembly, name) for name in sorted(set(names.tolist()))}
    return read_only(np.array([told[name] for name in names.tolist()]), np.str_)
