"""Surroundings of snap-through leaves: bought springs, walls, stop, seat of the spring; parts list and spring warnings.

Springs are bought where they are no structure of leaves. The others are what of the leaves' part does not bend.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import GeometryError
from cfmkit.export.posed_part import PosedBody, rectangle
from cfmkit.families.findings import mm, newton, rate
from cfmkit.families.hardware import mm as exact
from cfmkit.families.vcfm.leaf_laws_from_spec import strip_of
from cfmkit.families.vcfm.surroundings_spec import StandingFrame
from cfmkit.stock.parts_list import ListedPart
from cfmkit.stock.springs.support_spec import guide_cure, guide_needed, guide_words

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.arrays import FloatArray
    from cfmkit.families.vcfm.solution import Solution
    from cfmkit.families.vcfm.spec import VcfmSpec
    from cfmkit.families.vcfm.surroundings_spec import BoughtSprings


def parts_of(spec: VcfmSpec) -> tuple[ListedPart, ...]:
    """Return the leaves, and their spring: made, or bought."""
    mechanism, springs = spec.mechanism, spec.mechanism.springs
    material, leaves, flexures = mechanism.material.words, mechanism.bistable, mechanism.positive
    data = f"{leaves.half_beams} {leaves.structure}, {material}; geometry/vcfm.dxf"
    made = [ListedPart("shuttle, leaves and walls", "leaves", 1, data, "make", f"{exact(leaves.width)} deep")]
    if flexures is not None:
        data = f"{flexures.structure}, {material}; geometry/vcfm.dxf"
        made.append(ListedPart("below the shuttle", "spring", 1, data, "make", f"{exact(flexures.width)} deep"))
    return (*made, *([] if springs is None else [_list_springs(springs)]))


def _list_springs(springs: BoughtSprings) -> ListedPart:
    """Return the bought springs of the list."""
    data = [f"{springs.kind} spring, {rate(springs.rate)}"]
    if springs.initial_tension:
        data.append(f"initial tension {newton(springs.initial_tension)}")
    if springs.max_elongation:
        data.append(f"up to {mm(springs.max_elongation)}")
    if springs.free_length:
        data.append(f"{mm(springs.free_length)} relaxed")
    size = ""
    if wire := springs.wound:
        size = f"wire {exact(wire.wire)}, coil {exact(wire.coil)}, {wire.turns:g} turns"
        data.append(f"wire {mm(wire.wire)}, mean coil {mm(wire.coil)}, {wire.turns:g} turns")
    data += guide_words(springs)
    place = "above the shuttle" if springs.hang else "below the shuttle"
    return ListedPart(place, springs.name or "", springs.count, ", ".join(data), "buy", size)


def _extremes(solution: Solution) -> tuple[FloatArray, FloatArray]:
    """Return the largest preload of each mechanism and the deflection at the end of its travel, (m,) each [m]."""
    preload = solution.split_by_mechanism(solution.curves.preload[:, 0])
    rows, most = np.arange(len(preload)), preload.argmax(axis=1)
    last = solution.split_by_mechanism(solution.curves.ends[1])
    return preload[rows, most], (last + preload)[rows, most]


def is_overstretched(solution: Solution) -> Any:
    """Return which mechanisms deflect bought springs beyond their limit, (m,)."""
    limits = solution.column(
        lambda spec: (None if spec.mechanism.springs is None else spec.mechanism.springs.max_elongation) or None
    )
    return _extremes(solution)[1] > limits * (1 + 1e-9)


def overstretching(solution: Solution) -> tuple[Any, ...]:
    """Return by how much the springs of one mechanism are deflected, and where they reach their limit."""
    springs, (preload, most) = (solution.spec.mechanism.springs, (float(value[0]) for value in _extremes(solution)))
    limit = springs.max_elongation if springs is not None and springs.max_elongation else 0.0
    place = f"at {mm(limit - preload)} of travel" if limit > preload else "by the preload alone"
    return (
        f"with a preload of {mm(preload)} the springs are deflected by {mm(most)}, their limit is "
        f"{mm(limit)}, reached {place} ('mechanism.springs.max_elongation')",
    )


def buckles(solution: Solution) -> Any:
    """Return which mechanisms press springs without a guide so far that they buckle, (m,)."""
    limits = solution.column(
        lambda spec: None if spec.mechanism.springs is None or spec.mechanism.springs.is_guided
        else spec.mechanism.springs.unguided
    )  # fmt: skip
    return _extremes(solution)[1] > limits * (1 + 1e-9)


def buckling(solution: Solution) -> tuple[Any, ...]:
    """Return how far the springs of one mechanism are pressed, and what guides them."""
    springs, (preload, most) = (solution.spec.mechanism.springs, (float(value[0]) for value in _extremes(solution)))
    assert springs is not None
    return (
        f"a spring of {mm(springs.free_length or 0.0)} buckles when it is deflected by {mm(springs.unguided)} "
        f"(ends {springs.seats}), and is deflected by {mm(most)} with a preload of {mm(preload)}; "
        f"{guide_needed(springs, springs.coil, 'mechanism.springs')}",
        *guide_cure(springs.coil, "mechanism.springs"),
    )


Point = tuple[float, float]


@dataclass(frozen=True)
class FrameSizes:
    """Places of walls, stop and ground [m]; the unloaded apex of the lowest leaves is the origin."""

    # half, bottom, top: half the width of the shuttle, its lower end, and its upper one without a bar across it
    half: float
    bottom: float
    top: float
    # wall, out: faces of the right wall at the leaves and outside
    wall: float
    out: float
    # wall_top, wall_bottom: heights at which the walls end; without a ground for the latter
    wall_top: float
    wall_bottom: float
    # shuttle, ground: thicknesses of the bar across the shuttle's top, and of the ground
    shuttle: float
    ground: float
    under: float  # lower face of that bar
    stopped: bool  # whether there is one
    floor: float | None  # upper face of the ground; None without one
    # corners of raised seats on the right half of the ground, from the wall on, and its middle
    ledge: tuple[Point, ...] = ()

    @property
    def head(self) -> float:
        """Upper end of the shuttle, its bar included."""
        return self.under + self.shuttle if self.stopped else self.top

    @property
    def foot(self) -> float:
        """Lower end of what stands."""
        return self.wall_bottom if self.floor is None else self.floor - self.ground

    def bodies(self) -> Iterator[PosedBody]:
        """Yield shuttle and walls, and a bar across the shuttle, the ground and the seats on it if there are any."""
        low = self.wall_bottom if self.floor is None else self.floor
        yield PosedBody.polygon("shuttle", "driven", rectangle(-self.half, self.bottom, self.half, self.under))
        if self.stopped:
            yield PosedBody.polygon("shuttle", "driven", rectangle(-self.out, self.under, self.out, self.head))
        for x in (self.wall, -self.out):
            yield PosedBody.polygon("wall", "held", rectangle(x, low, x + self.out - self.wall, self.wall_top))
        if self.floor is not None:
            yield PosedBody.polygon("ground", "held", rectangle(-self.out, self.foot, self.out, self.floor))
        if len(self.ledge) > 1:
            seat = PosedBody.polygon("seat", "held", rectangle(*self.ledge[0], *self.ledge[2]))
            yield from (seat, seat.mirror())


def frame_sizes(
    spec: VcfmSpec,
    # smallest x and y, largest x and y of the unloaded spring [m], where it has a seat
    spring: tuple[float, float, float, float] | None,
) -> FrameSizes:
    """Return the sizes of what stands.

    Raises GeometryError if the spring does not fit between the walls, or the shuttle comes to the seat.
    """
    frame, about = spec.mechanism.frame, spec.mechanism.bistable
    standing = spec.mechanism.cut_part.frame or StandingFrame()
    levels, strip = -(-about.half_beams // 2), strip_of(about, spec.mechanism.material)
    wall, rise = 0.5 * frame.shuttle_width + float(strip.reach), float(strip.rise)
    thick, block = standing.wall or frame.block, frame.block
    top, bottom = (levels - 1) * frame.spacing + frame.clearance, -frame.clearance
    wall_top, wall_bottom = (levels - 1) * frame.spacing - rise + block, -rise - block
    under = top
    if standing.stop is not None:  # the bar stays above the leaves that it moves with
        under = max(top, wall_top + standing.stop)
        wall_top = under - standing.stop
    floor, ledge = _floor(spec, standing, spring, (bottom, wall_bottom, wall))
    return FrameSizes(
        half=0.5 * frame.shuttle_width,
        bottom=bottom,
        top=top,
        wall=wall,
        out=wall + thick,
        wall_top=wall_top,
        wall_bottom=wall_bottom,
        shuttle=standing.shuttle or block,
        ground=standing.ground or block,
        under=under,
        stopped=standing.stop is not None,
        floor=floor,
        ledge=ledge,
    )


def _floor(
    spec: VcfmSpec,
    standing: StandingFrame,
    spring: tuple[float, float, float, float] | None,
    around: tuple[float, float, float],
) -> tuple[float | None, tuple[Point, ...]]:
    """Return where the ground is, and the raised seats on it; without a ground nothing."""
    bottom, wall_bottom, wall = around
    least = min(bottom - spec.travel - standing.clearance, wall_bottom)
    if standing.seat is None or spring is None:
        return (None, ()) if standing.ground is None else (least, ((0.0, least),))
    _, low, right, high = spring
    seat = bottom - (high - low - standing.seat)
    about, block = spec.mechanism.flexures, spec.mechanism.frame.block
    widest = right + (about.length - float(strip_of(about, spec.mechanism.material).reach))  # leaves that lie flat
    if widest + standing.clearance > wall:
        raise GeometryError(
            f"the spring does not fit between the walls onto its seat, at ({mm(wall)}, {mm(seat)}): it is "
            f"{mm(2 * widest)} wide and the walls are {mm(2 * wall)} apart; use longer leaves, or leave out "
            f"'mechanism.part.frame.seat'"
        )
    if not about.kind.stands_on_ends:
        if seat > bottom - spec.travel - standing.clearance:
            raise GeometryError(
                f"the shuttle comes to the seat at (0 mm, {mm(seat)}) within the travel of {mm(spec.travel)}: reduce "
                f"'mechanism.part.frame.seat' ({mm(standing.seat)}) or 'analysis.travel'"
            )
        return seat, ((0.0, seat),)
    # the middle block goes down between the two seats of a straight beam, farther than they are high
    floor = min(least, seat - standing.seat - spec.travel - standing.clearance)
    seats: tuple[Point, ...] = (
        (right, floor),
        (right, seat),
        (right - block, seat),
        (right - block, floor),
        (0.0, floor),
    )
    return floor, seats


def frame_notes(spec: VcfmSpec, sizes: FrameSizes) -> Iterator[str]:
    """Yield what stop and seat are for."""
    standing = spec.mechanism.cut_part.frame
    if standing is not None and standing.stop is not None:
        yield f"the bar across the shuttle lands on the walls after {mm(standing.stop)}"
    if standing is not None and standing.seat is not None:
        yield f"on the ground below the shuttle the spring is preloaded by {mm(standing.seat)}"
        if all(abs(standing.seat - preload) > 1e-9 for preload in spec.analysis.preloads):
            yield "'analysis.preloads' does not have the preload of the seat"
