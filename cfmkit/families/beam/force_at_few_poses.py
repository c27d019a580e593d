"""Force and stress of a beam mechanism at a few poses, for searches: in a hundredth of the time of an analysis.

A specification and places of the drive go in; force and stress there come out, with exact derivatives by values of the
specification. Network and path are those of the analysis; metrics, findings and the curve are not computed.
"""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica import PathStatus, gradient, trace
from cfmkit.elastica.model.drive import Displacement
from cfmkit.errors import CfmError
from cfmkit.families.base import Sampled
from cfmkit.families.beam.network_from_spec import assemble, change_at

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network, Path
    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec

_SMOOTH_KEYS = re.compile(
    r"mechanism\.(nodes\.[^.]+\.at\.[01]"
    r"|(beams\.[^.]+\.)?(thickness|width|material\.(youngs_modulus|poisson_ratio))"
    r"|beams\.[^.]+\.((start|end)_offset\.[01]|shape\.(coefficients\.\d+|sweep|rise))"
    r"|springs\.[^.]+\.(stiffness|free_length|free_angle|free_displacement))"
)
"""Values of which every number of the network is a smooth function that takes complex ones."""


def sample_poses(
    spec: BeamSpec,  # driven by a displacement, not solved as a solid
    places: FloatArray,  # (p,): displacements, increasing, all to one side of rest [m]
    # of values by which slopes are wanted; of nodes, shapes, sections, moduli and springs they are known, others are
    # left out, and all of them where the tangent is singular at a place
    paths: Sequence[str] = (),
) -> Sampled | None:
    """Return force and stress at places, each beam's own stress; None if the path does not reach them all."""
    followed = _follow_path(spec, places)
    if followed is None:
        return None
    assembly, path, at = followed
    stress = path.beam_stresses(spec.stress == "total")[0][:, at]
    slopes = _find_slopes(assembly, path, at, paths) if paths else {}
    return Sampled({"load": assembly.effort_unit * path.effort[at]}, stress, slopes)


def _find_slopes(assembly: Assembly, path: Path, at: NDArray[np.int64], paths: Sequence[str]) -> dict[str, Sampled]:
    """Return derivatives of force and stress at some points of a path by values of the specification."""
    # other nodes of a chain follow from its beams, and other stages from the first, through numbers that stay real
    spec = assembly.spec
    if spec.mechanism.closure == "chain" or spec.mechanism.layers > 1:
        return {}
    smooth_keys = [name for name in paths if _SMOOTH_KEYS.fullmatch(name) and isinstance(spec.get_value(name), float)]
    if not smooth_keys:
        return {}

    def build(x: Any) -> Network:
        return assemble(replace_values(spec, dict(zip(smooth_keys, x, strict=True)))).network

    try:
        slopes = gradient(path, build, np.array([spec.get_value(key) for key in smooth_keys]), at)
        axial = spec.stress == "total"
        by_stress = []
        for name in path.network.beams:
            extremes = path.stress_extremes(name, axial).value[at].reshape(len(at), 4)
            worst = np.abs(extremes).argmax(axis=1)
            pick = np.arange(len(at)), worst
            by = slopes.stress_extremes(name, axial).reshape(len(at), 4, -1)
            by_stress.append(np.sign(extremes[pick])[:, None] * by[pick])
        by_effort = assembly.effort_unit * slopes.effort
    except (CfmError, np.linalg.LinAlgError):
        return {}
    return {
        name: Sampled({"load": by_effort[:, k]}, np.array(by_stress)[:, :, k]) for k, name in enumerate(smooth_keys)
    }


def _follow_path(spec: BeamSpec, places: FloatArray) -> tuple[Assembly, Path, NDArray[np.int64]] | None:
    """Return a mechanism, its path from rest, and the path's points at places; None if it does not get there."""
    if not spec.mechanism.drive.is_displacement or spec.fidelity == "solid" or spec.analysis.through_folds:
        return None
    if places[0] < 0 < places[-1]:
        return None
    assembly = assemble(spec)
    poses = np.array(sorted({0.0, *places.tolist()}, key=abs))
    drive = Displacement(assembly.driven, assembly.direction, poses, assembly.growing(spec.extent))
    path = trace(assembly.network, drive, assembly.control())
    keep = path.at_requested
    if path.status is not PathStatus.COMPLETE or len(keep) != len(poses):
        return None
    return assembly, path, np.asarray(keep[np.searchsorted(np.abs(poses), np.abs(places))])


def replace_values(spec: BeamSpec, values: Mapping[str, Any]) -> BeamSpec:
    """Return a specification with other values at dotted paths, which are not checked: complex ones."""

    def take(value: Any, _before: Any) -> Any:
        return value

    for path, value in values.items():
        spec = change_at(spec, path, partial(take, value))
    return spec
