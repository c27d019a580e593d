"""Why a path has no beginning, or ends before it was to: what the engine says, with the keys that are in its way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.elastica import PathStatus
from cfmkit.families.beam.words import in_units
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.beam.model import Solution

STRETCH = "analysis.fidelity=extensible"

_STRAIGHT = 0.995  # of the length of a taut beam lies between its ends
_TIGHT = 50.0  # N L^2 / EI: it is pulled so hard that only its ends are bent


@dataclass(frozen=True)
class Ending:
    """One sentence, and what would change it, as ``--set`` takes it."""

    message: str
    cures: tuple[str, ...] = ()


def ending_of(solution: Solution) -> Ending:
    """Return why a path ended; a path that is complete has nothing to say."""
    path = solution.path
    said = in_units(solution.assembly, path.message or path.status.value)
    rigid = solution.spec.fidelity == "inextensible"
    if len(solution.keep) < 2:
        return Ending(f"{said}: {_in_the_way(solution)}", (STRETCH,) if rigid else ())
    taut = list(_taut(solution)) if rigid and path.status in (PathStatus.LIMIT_POINT, PathStatus.LOST) else []
    if not taut:
        return Ending(said)
    where = format_short(float(solution.motion[-1]), solution.motion_dimension)
    return Ending(
        f"the beams are taut at {where} ({', '.join(taut)}), and beams that do not stretch go no further: allow "
        "stretching (mechanism.axial)",
        (STRETCH,),
    )


def _taut(solution: Solution) -> Iterator[str]:
    """Yield the beams that are pulled straight at the last point, each with its length and the way between its ends."""
    path, last = solution.path, int(solution.keep[-1])
    for name, beam in path.layout.network.beams.items():
        line = path.shape(name, last)
        chord = line[-1] - line[0]
        way, length = float(np.hypot(*chord)), float(np.real(path.fits[name].length))
        if way < _STRAIGHT * length:
            continue
        pull = float(path.end_force(name, 1)[last, :2] @ chord) / way
        stiffness = float(np.real(beam.section.rigidities(np.array([0.5]), 0.5)[0][0]))
        if pull * length**2 > _TIGHT * stiffness:
            yield f"{name}: {format_short(way, 'length')} of {format_short(length, 'length')}"


def _in_the_way(solution: Solution) -> str:
    """Return the keys that may keep a mechanism from having a first pose."""
    spec = solution.spec
    mechanism = spec.mechanism
    moved = [f"mechanism.nodes.{name}.moved" for name, node in mechanism.nodes.items() if node.moved is not None]
    acting = [f"mechanism.{what}" for what in ("loads", "springs") if getattr(mechanism, what)]
    keys = [*moved, *acting] or ["mechanism.drive", *(f"mechanism.nodes.{name}.support" for name in mechanism.nodes)]
    said = f"look at {', '.join(keys)}"
    if spec.fidelity != "inextensible":
        return said
    return f"{said}; beams do not stretch: mechanism.axial allows it"
