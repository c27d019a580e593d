"""The largest stress of leaves and spring of a vcfm in each of their fillets, over the preloads of an analysis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.fillet_table import FilletRow, fillet_table
from cfmkit.stock.spec import CutPart

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.solid.fillet_stress import FilletStress
    from cfmkit.solid.meshed_part import MeshSolution
    from cfmkit.tables import Table


def fillets(solution: Solution) -> Table:
    """Return the fillets of a leaf and of a chain of the spring, with their largest stress up to the window's end.

    That of all preloads, as in `spring_stress_max` and `bistable_stress_max`.
    """
    sampler: Any = solution.sampler  # of solids
    radius = (solution.spec.mechanism.part or CutPart()).fillet
    pieces = [("leaf", "shuttle", (sampler.pushed, sampler.pulled))]
    if sampler.sides:
        pieces.append(("spring", "block", tuple(sampler.sides)))
    rows = []
    for piece, moved, (pushed, pulled) in pieces:
        for one in _both_ways(pushed.solved, pulled.solved, radius):
            joined = one.arc.touched(_rigid(pushed.solved, moved))
            row = _largest(solution, one, f"{piece} at {joined[0] if joined else 'corner'}", piece == "spring")
            rows += [] if row is None else [row]
    return fillet_table(rows)


def _both_ways(pushed: MeshSolution, pulled: MeshSolution, radius: float) -> Iterator[FilletStress]:
    """Yield the fillets of a part with the poses of both ways: they are of one mesh, and begin with the same pose."""
    from cfmkit.solid.fillet_stress import FilletStress, stressed_fillets

    back = {tuple(one.arc.middle.tolist()): one for one in stressed_fillets(pulled, radius)}
    for one in stressed_fillets(pushed, radius):
        other = back.get(tuple(one.arc.middle.tolist()))
        if other is None:
            yield one
        else:
            travel, stress = (np.concatenate([a[:-1], b]) for a, b in zip(_poses(other), _poses(one), strict=True))
            yield FilletStress(one.arc, travel, stress)


def _poses(one: FilletStress) -> tuple[Any, Any]:
    return one.travel, one.stress


def _rigid(solved: MeshSolution, moved: str) -> dict[str, list[Any]]:
    """Return the polygons of what moves and of what stands [m]; the middle of a corner is a line, and no piece."""
    found: dict[str, list[Any]] = {}
    for place in solved.part.places:
        name = moved if place.name == "shuttle" else {"shuttle": "wall"}.get(moved, moved)
        found.setdefault(name, []).extend(shape for shape in place.shapes if len(shape) > 2)
    return found


def _largest(solution: Solution, one: FilletStress, place: str, of_spring: bool) -> FilletRow | None:
    """Return the row of a fillet: at the preload and the travel of the shuttle where its stress is largest."""
    found = []
    for push in solution.pushes:
        share, ahead = (solution.sampler.chain.travel, push.preload) if of_spring else (1.0, 0.0)  # type: ignore[attr-defined]
        start, end = float(push.travel[0]), min(solution.window[1], float(push.travel[-1]))
        if (worst := one.largest(share * (start + ahead), share * (end + ahead))) is not None:
            found.append(FilletRow(place, one.arc, worst[0], worst[1] / share - ahead, push.preload))
    return max(found, key=lambda row: row.stress, default=None)
