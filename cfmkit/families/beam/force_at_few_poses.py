"""Force and stress of a beam mechanism at a few poses, in a hundredth of the time of its analysis: for searches.

The network and the path are those of the analysis; what is left out is everything that a search does not look at.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import PathStatus, trace
from cfmkit.elastica.model.drive import Displacement
from cfmkit.families.base import Sampled
from cfmkit.families.beam.build import assemble

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.beam.spec import BeamSpec


def sampled(spec: BeamSpec, places: FloatArray) -> Sampled | None:
    """Return force and stress at places, each beam's own stress; None where the path does not reach them all.

    Parameters
    ----------
    spec : BeamSpec
        Driven by a displacement, not solved as a solid.
    places : (p,) array
        Increasing displacements [m].
    """
    if spec.mechanism.drive.kind != "displacement" or spec.fidelity == "solid" or spec.analysis.through_folds:
        return None
    assembly = assemble(spec)
    poses = np.unique(np.append(0.0, places))
    path = trace(assembly.network, Displacement(assembly.driven, assembly.direction, poses), assembly.control())
    keep = path.at_requested
    if path.status is not PathStatus.COMPLETE or len(keep) != len(poses):
        return None
    at = keep[np.searchsorted(poses, places)]
    axial = spec.stress == "total"
    stress = [path.beam_stress(name, axial)[0][at] for name in path.layout.network.beams]
    return Sampled({"load": assembly.effort_unit * path.effort[at]}, np.array(stress))


def errors(spec: BeamSpec) -> dict[str, str]:
    """Return which values a process errs in, and whether in thickness or in position: thicknesses and free nodes."""
    mechanism = spec.mechanism
    found = {}
    if isinstance(mechanism.thickness, float) and any(one.thickness is None for one in mechanism.beams.values()):
        found["mechanism.thickness"] = "thickness"
    for name, beam in mechanism.beams.items():
        if isinstance(beam.thickness, float):
            found[f"mechanism.beams.{name}.thickness"] = "thickness"
    for name, node in mechanism.nodes.items():
        if node.support == "free":
            found |= {f"mechanism.nodes.{name}.at.{axis}": "position" for axis in (0, 1)}
    return found
