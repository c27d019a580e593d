"""The largest stress of leaves and spring of a vcfm in each of their fillets, over the preloads of an analysis.

Nominal stresses are those of the beams that the exact model traces, as straight as they are drawn.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.fem_results import FilletRow, with_nominal
from cfmkit.families.nominal_stress_beside_fillets import both_images, nominal_stresses
from cfmkit.families.vcfm.exact_model import DOWN_ANGLE, leaf_network
from cfmkit.families.vcfm.leaf_laws_from_spec import strip_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network
    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.families.vcfm.spec import VcfmSpec
    from cfmkit.solid.meshed_part import MeshSolution
    from cfmkit.solid.stress_along_fillets import FilletStress


def fillets(solution: Solution) -> tuple[tuple[FilletRow, ...], tuple[FilletRow, ...]]:
    """Return the fillets of a leaf, and of a chain of the spring, with their largest stress up to the window's end.

    That of all preloads, as in `spring_stress_max` and `bistable_stress_max`. A bought spring has none.
    """
    sampler: Any = solution.sampler  # of solids
    leaf = _rows(solution, "leaf", "shuttle", (sampler.pushed, sampler.pulled))
    network, placed = leaf_network(solution.spec), partial(_in_leaf_network, solution.spec)
    leaf = _with_nominal(leaf, [row.motion for row in leaf], network, "shuttle", placed)
    if not sampler.sides:
        return leaf, ()
    chain, spring = sampler.chain, _rows(solution, "spring", "block", sampler.sides)
    travel = [chain.travel * (row.motion + (row.preload or 0.0)) for row in spring]
    return leaf, _with_nominal(spring, travel, chain.network, chain.node, partial(_in_chain, solution.spec))


def _rows(solution: Solution, piece: str, moved: str, ways: Sequence[Any]) -> tuple[FilletRow, ...]:
    """Return the fillets of one piece that is pushed and pulled."""
    radius = solution.spec.mechanism.fillet
    pushed, pulled = (way.solved for way in ways)
    rows = []
    for one in _both_ways(pushed, pulled, radius):
        joined = one.arc.find_touched(_rigid(pushed, moved))
        row = _largest(solution, one, f"{piece} at {joined[0] if joined else 'corner'}", piece == "spring")
        rows += [] if row is None else [row]
    return tuple(rows)


def _with_nominal(
    rows: Sequence[FilletRow],
    travel: Sequence[float],
    network: Network,
    node: str,
    placed: Callable[[FloatArray], FloatArray],
) -> tuple[FilletRow, ...]:
    """Return rows with the nominal stress of beams whose node has some travels (n,) [m]."""
    from cfmkit.elastica import Displacement

    paths = partial(both_images, network, partial(Displacement, node, DOWN_ANGLE))
    return with_nominal(rows, nominal_stresses(rows, np.array(travel), paths, placed))


def _in_leaf_network(spec: VcfmSpec, points: FloatArray) -> FloatArray:
    """Return where in the network of leaves points of the drawing are (m, 2) [m]: there the walls come first."""
    strip, half = strip_of(spec.mechanism.bistable, spec.mechanism.material), 0.5 * spec.mechanism.frame.shuttle_width
    x, y = points.T
    return np.column_stack([float(strip.reach) + half * np.sign(x) - x, y + float(strip.rise)])


def _in_chain(spec: VcfmSpec, points: FloatArray) -> FloatArray:
    """Return where in the network of the spring points of the drawing are (m, 2) [m]: there the block stands."""
    block = spec.mechanism.frame.block
    return np.column_stack([points[:, 0] - 0.5 * block, -points[:, 1] - block])


def _both_ways(pushed: MeshSolution, pulled: MeshSolution, radius: float) -> Iterator[FilletStress]:
    """Yield the fillets of a part with the poses of both ways: they are of one mesh, and begin with the same pose."""
    from cfmkit.solid.stress_along_fillets import FilletStress, stressed_fillets

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
        start, end = float(push.travel[0]), min(solution.window_of_one[1], float(push.travel[-1]))
        if (worst := one.largest(share * (start + ahead), share * (end + ahead))) is not None:
            found.append(FilletRow(place, one.arc, worst[0], worst[1] / share - ahead, push.preload))
    return max(found, key=lambda row: abs(row.stress), default=None)
