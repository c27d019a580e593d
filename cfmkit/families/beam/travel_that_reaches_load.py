"""A beam mechanism's part under a force or a moment: the same part with its node moved, far enough for the load."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica import trace
from cfmkit.families.beam.network_from_spec import assemble
from cfmkit.families.beam.solution import Solution

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.families.beam.network_from_spec import Assembly
    from cfmkit.families.beam.spec import BeamSpec
    from cfmkit.solid.meshed_part import Part

INITIAL_TRAVEL = 1e-3  # travel that is looked at first where beams have no pose under the load, in m or rad


def driven_by_load(spec: BeamSpec) -> bool:
    """Return True if a force or a moment drives a mechanism."""
    return spec.mechanism.drive.by_load


def moved_by(spec: BeamSpec, travel: float) -> BeamSpec:
    """Return a mechanism that a load drives with its node moved by that load's motion instead [m or rad]."""
    drive: Any = spec.mechanism.drive
    if drive.turns:
        drive_keys, extent = {"kind": "rotation", "node": drive.node}, f"{travel!r} rad"
    else:
        drive_keys = {"kind": "displacement", "node": drive.node, "direction": drive.direction}
        extent = f"{travel!r} m"
    return spec.replace(
        {
            "mechanism.drive": drive_keys,
            "analysis.travel": extent,
            "analysis.force": None,
            "analysis.moment": None,
            "analysis.through_folds": False,
        }
    )


def moved_far_enough(
    spec: BeamSpec,
    part: Callable[[BeamSpec, Assembly], Part],  # returns the part of a mechanism whose node is moved
    # is given the share that is done, and what is being done
    report: Callable[[float, str], None] = lambda _share, _text: None,
) -> BeamSpec:
    """Return a mechanism that a load drives with its node moved until a coarse mesh of the part carries the load.

    Raises GeometryError if the part cannot be meshed.
    """
    from cfmkit.solid.path_up_to_load import travel_for

    guess = _travel_of_beams(assemble(spec))
    moved = moved_by(spec, guess)
    moved_part = part(moved, assemble(moved))
    travel = travel_for(
        moved_part.create_mesh(),
        load_of_one(spec),
        guess,
        max(spec.analysis.solid.poses, 5),
        spec.analysis.through_folds,
        lambda share: report(share, "travel at the load"),
    )
    return moved_by(spec, travel)


def load_of_one(spec: BeamSpec) -> float:
    """Return the load at the end of the drive on what is drawn: one leg, with its mirror image [N or N m]."""
    copies = spec.mechanism.copies
    return spec.extent / (copies.legs if copies is not None else 1)


def _travel_of_beams(assembly: Assembly) -> float:
    """Return how far the load moves the beams [m or rad]: as far as they go."""
    path = trace(assembly.network, assembly.drive(), assembly.control())
    kept = np.asarray(path.at_requested, np.int64)
    moved = float(Solution(assembly, path, kept).motion[-1]) if len(kept) > 1 else 0.0
    return moved if moved * assembly.spec.extent > 0 else float(np.sign(assembly.spec.extent)) * INITIAL_TRAVEL
