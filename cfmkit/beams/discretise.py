"""From a layout to the arrays of the compiled code: beams cut into segments and steps, all without dimension."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.beams.kernels.model import Model
from cfmkit.beams.kernels.rk8 import NODES
from cfmkit.beams.section import Taper

if TYPE_CHECKING:
    from cfmkit.beams.layout import Layout
    from cfmkit.curves import FloatArray


@dataclass(frozen=True)
class Mesh:
    """How many segments each beam has and how many Runge-Kutta steps a segment has."""

    segments: int = 2
    steps: int = 2

    def finer(self) -> Mesh:
        """Return the mesh with twice the steps."""
        return replace(self, steps=2 * self.steps)

    def shorter(self) -> Mesh:
        """Return the mesh with twice the segments."""
        return Mesh(2 * self.segments, max(1, self.steps // 2) if self.steps > 1 else 1)


@dataclass(frozen=True)
class Grid:
    """Where the steps lie: per beam, the parameters at the step boundaries of its segments.

    Attributes
    ----------
    edges : (steps, 2) array
        Parameter of the shape at both ends of every step.
    inside : (steps,) array
        Fraction of the arc length at the middle of every step: says which smooth piece it lies on.
    middle : (steps,) array
        Parameter at the middle of every step.
    beam_of_step, piece : (steps,) int arrays
        The beam that a step is on, and the smooth piece of it; pieces count through all beams.
    segment_step, beam_segment : int arrays
        As in `cfmkit.beams.kernels.model.Model`.
    """

    edges: FloatArray
    inside: FloatArray
    middle: FloatArray
    segment_step: Any
    beam_segment: Any
    beam_of_step: Any
    piece: Any


def grid(layout: Layout, mesh: Mesh) -> Grid:
    """Cut every beam at its corners and stations, then evenly."""
    edges: list[tuple[float, float]] = []
    segment_step, beam_segment, beam_of_step = [0], [0], []
    piece: list[int] = []
    for number, (name, beam) in enumerate(layout.network.beams.items()):
        fitted = layout.fits[name]
        stations = [fitted.parameter(float(u)) for u in beam.section.stations[1:-1]]
        breaks = np.unique(np.concatenate([fitted.course.breaks, stations]))
        breaks = breaks[np.concatenate([[True], np.diff(breaks) > 1e-12])]
        count = len(segment_step) - 1
        for left, right in itertools.pairwise(breaks):
            share = float(np.real(fitted.arc(float(right)) - fitted.arc(float(left))))
            pieces = max(1, int(np.ceil(mesh.segments * share - 1e-9)))
            marks = np.linspace(left, right, pieces * mesh.steps + 1)
            edges += list(zip(marks[:-1].tolist(), marks[1:].tolist(), strict=True))
            beam_of_step += [number] * (pieces * mesh.steps)
            piece += [piece[-1] + 1 if piece else 0] * (pieces * mesh.steps)
            segment_step += [segment_step[-1] + mesh.steps * (k + 1) for k in range(pieces)]
            count += pieces
        beam_segment.append(count)
    array = np.array(edges)
    middle = array.mean(axis=1)
    names = list(layout.network.beams)
    owner = np.array(beam_of_step, dtype=np.int64)
    inside = middle.copy()
    for number, name in enumerate(names):
        if not layout.fits[name].course.uniform:
            inside[owner == number] = np.real(layout.fits[name].arc(middle[owner == number]))
    return Grid(
        array,
        inside,
        middle,
        np.array(segment_step, dtype=np.int64),
        np.array(beam_segment, dtype=np.int64),
        owner,
        np.array(piece, dtype=np.int64),
    )


def table(layout: Layout, cut: Grid, known: Any = None) -> Any:
    """Return the reference angle, speed and compliances at the stages of all steps, dimensionless.

    `known` is the table of the layout that this one took fits over from: those beams' rows are taken over too.
    """
    blocks = []
    for number, name in enumerate(layout.network.beams):
        steps = np.flatnonzero(cut.beam_of_step == number)
        kept = layout.known is not None and layout.fits[name] is layout.known.fits[name]
        blocks.append(known[steps] if known is not None and kept else beam_table(layout, name, cut, steps))
    return np.ascontiguousarray(np.concatenate(blocks))


def beam_table(layout: Layout, name: str, cut: Grid, steps: Any) -> Any:
    """Return the table of one beam, dimensionless."""
    block, scales = _si_table(layout, name, cut, steps), layout.scales
    block[..., 1:] /= scales.length
    block[..., 2] *= scales.rigidity
    block[..., 3:] *= scales.force
    return block


def _si_table(layout: Layout, name: str, cut: Grid, steps: Any) -> Any:
    """Return the table of one beam in SI: angle, g, g L0/EI-like compliances before scaling."""
    fitted, section = layout.fits[name], layout.network.beams[name].section
    blocks = []
    pieces = cut.piece[steps]
    for piece in np.unique(pieces):
        own = steps[pieces == piece]
        left, right = cut.edges[own, :1], cut.edges[own, 1:]
        t = left + (right - left) * NODES
        middle, inside = cut.middle[own[0]], cut.inside[own[0]]
        angle, speed = fitted.angle(t, middle), fitted.speed(t, middle)
        place = fitted.arc(t) if isinstance(section.thickness, Taper) else t
        bending, axial, shear = section.rigidities(place, inside)
        blocks.append(
            np.stack(np.broadcast_arrays(angle, speed, speed / bending, speed * axial, speed * shear), axis=-1)
        )
    return np.concatenate(blocks)


def model(layout: Layout, mesh: Mesh, ramp: bool = False) -> Model:
    """Return the network's arrays.

    With `ramp` the drive takes the place of a factor on everything constant (held displacements, constant loads):
    at one it is the state from which the real drive starts.
    """
    cut = grid(layout, mesh)
    return assemble_model(layout, cut, table(layout, cut), ramp)


def assemble_model(layout: Layout, cut: Grid, values: Any, ramp: bool = False) -> Model:
    """Return the network's arrays for given tables."""
    scales = layout.scales
    places = layout.places
    base, rate = _held(layout)
    load_place, load_value, load_follows = _loads(layout)
    line = layout.line_load / scales.force * scales.length
    line[:, 1] *= scales.drive
    if ramp:
        base, rate = np.zeros_like(base), base
        load_value[:, 1], load_value[:, 0] = load_value[:, 0], 0.0
        line[:, 1], line[:, 0] = line[:, 0], 0.0
    slot = np.full(layout.dof_count, -1, dtype=np.int64)
    slot[layout.free] = np.arange(int(layout.free.sum()))
    spring_place, spring_kind, spring_value = _springs(layout)
    return Model(
        table=values,
        width=np.ascontiguousarray(cut.edges[:, 1] - cut.edges[:, 0]),
        segment_step=cut.segment_step,
        beam_segment=cut.beam_segment,
        beam_end=layout.beam_end,
        line_load=line,
        place_dof=np.array(places.dof, dtype=np.int64),
        place_frame=np.array(places.frame),
        place_origin=np.array(places.origin) / scales.length,
        place_arm=np.array(places.arm) / scales.length,
        base=base,
        rate=rate,
        slot=slot,
        load_place=load_place,
        load_value=load_value,
        load_follows=load_follows,
        spring_place=spring_place,
        spring_kind=spring_kind,
        spring_value=spring_value,
    )


def _held(layout: Layout) -> tuple[Any, Any]:
    """Return the held values and those that the drive moves, dimensionless."""
    base, rate = layout.base.copy(), np.zeros(layout.dof_count)
    for name in layout.masters:
        first = layout.first[name]
        base[first : first + 2] /= layout.scales.length
    if layout.driven is not None:
        dof, sense = layout.driven
        rate[dof] = sense
    return base, rate


def _loads(layout: Layout) -> tuple[Any, Any, Any]:
    scales = layout.scales
    count = len(layout.load_rows)
    place, follows = np.zeros(count, np.int64), np.zeros(count, np.int64)
    value: list[list[tuple[Any, ...]]] = [[(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)] for _ in range(count)]
    for k, (at, when, (fx, fy, moment), turns, _) in enumerate(layout.load_rows):
        unit = scales.drive if when == 1 else 1.0
        place[k], follows[k] = at, int(turns)
        value[k][when] = (fx / scales.force * unit, fy / scales.force * unit, moment / scales.moment * unit)
    return place, np.array(value).reshape(count, 2, 3), follows


def _springs(layout: Layout) -> tuple[Any, Any, Any]:
    """Return the springs' attachments, kinds and dimensionless values."""
    scales = layout.scales
    count = len(layout.spring_rows)
    place, kind, value = np.zeros((count, 2), np.int64), np.zeros(count, np.int64), []
    line, turn, length = scales.force / scales.length, scales.moment, scales.length
    units = {0: (line, length, 1.0, 1.0), 1: (turn, 1.0, 1.0, 1.0), 2: (line, 1.0, 1.0, length)}
    for k, (what, start, end, values) in enumerate(layout.spring_rows):
        place[k], kind[k] = (start, end), what
        value.append([own / unit for own, unit in zip(values, units[what], strict=True)])
    return place, kind, np.array(value).reshape(count, 4)
