"""Audit of a designed strip of a printed slider-crank: its sizes are rounded and its force is computed at many places.

The search works with few places and unrounded numbers. Its outcome goes in; the rounded strip comes out with the travel
over which it keeps its limits, its ripple, and the bounds and limits that hold the design.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.rounded_and_reported_values import find_active_bounds
from cfmkit.families.findings import mm, mpa
from cfmkit.families.slider_crank.printed.beam_chain_from_spec import strip_chain
from cfmkit.families.slider_crank.printed.equilibrium_path import PressingEnd
from cfmkit.families.slider_crank.printed.solution import Solution, first_at

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.printed.flexures_as_beam_network import Strip
    from cfmkit.families.slider_crank.printed.sqp_program import Form
    from cfmkit.families.slider_crank.printed.strip_thickness_search import FoundStrip


N_AUDIT_PLACES = 240
BOUND_TOLERANCES = 1e-6, 1e-5  # a nanometre and a share: a number so near to an end of its range is held by it
STRESS_RTOL = 2e-4  # of the stress: by how much its peak depends on how finely the strip is sampled
ACTIVE_LIMIT_SHARE = 0.02  # a value so near to its limit, as a share of the limit, holds the design


@dataclass(frozen=True)
class FinishedStrip:
    """A designed strip with rounded sizes, and what it reaches."""

    strip: Strip  # rounded
    shares: tuple[tuple[float, ...], ...] | None  # where its stations are, as `mechanism.beam.shares` says it
    window: tuple[float, float]  # travel over which it keeps its limits [m]
    # ripple, rms: largest deviation in it as a share, and root mean square of ten points [N]
    ripple: float
    rms: float
    active: tuple[str, ...]  # bounds and limits that hold the design
    overstress: float  # largest stress over the allowed one where the stroke is given; 1 where the stress ends it


def judge_strip(
    values: FloatArray,  # (n,): numbers of the form
    search_result: FoundStrip,  # the search that they come from
    # ripple as a share and stress [Pa] that end the stroke, where it is what is sought
    limits: tuple[float | None, float | None],
    pins: FloatArray,  # (3, 2): where it is kinked, as `beam_chain_from_spec.pins_of` says [m]
) -> FinishedStrip | None:
    """Return the outcome of a strip; None if it has no equilibrium over its travel, or breaks its band at once."""
    task, form = search_result.program.task, search_result.program.form
    strip = form.strip(values, task.corners)
    chain = strip_chain(strip, task.material, pins, task.direction)
    end = search_result.program.stroke(search_result.descent.z)
    first = max(task.start, 1e-3 * end)
    travel = np.unique(
        np.concatenate([np.geomspace(first, end, N_AUDIT_PLACES // 4), np.linspace(first, end, N_AUDIT_PLACES)])
    )
    pressed = chain.press(travel)
    if pressed.ending is not PressingEnd.COMPLETE:
        return None
    solution = Solution(chain, pressed, task.material, 1, (task.start, end))
    ratio = solution.force / task.force - task.share(solution.travel)
    ripple, stress = limits
    stroke = min(end, _end_of_stroke(solution, ratio, ripple, stress))
    stroke = float(np.floor(stroke * 1e6) / 1e6) if task.goal == "stroke" else end
    inside = (travel >= task.start) & (travel <= stroke)
    if not inside.any() or stroke <= task.start:
        return None
    return FinishedStrip(
        strip,
        _list_station_shares(form, values),
        (task.start, stroke),
        float(np.abs(ratio[inside]).max()),
        _rms(chain_force(solution, task.start, stroke), task.force * task.share(_even_places(task.start, stroke))),
        (*_find_at_bounds(search_result, values), *_find_active_limits(solution, ratio, inside, limits)),
        1.0 if stress is None or task.goal == "stroke" else float(solution.stress.max() / stress),
    )


def chain_force(solution: Solution, start: float, stroke: float) -> FloatArray:
    """Return the force at ten even places of the travel, its start left out [N]."""
    return np.asarray(solution.chain.press(_even_places(start, stroke)).force)


def _even_places(start: float, stroke: float) -> FloatArray:
    return start + (stroke - start) * np.arange(1, 11) / 10


def _rms(force: FloatArray, target: FloatArray | float) -> float:
    return float(np.sqrt(np.mean((force - target) ** 2)))


def _end_of_stroke(solution: Solution, ratio: FloatArray, ripple: float | None, stress: float | None) -> float:
    """Return the travel at which the first limit is met [m]."""
    ends = [float(solution.travel[-1])]
    if ripple is not None:
        place = first_at(solution.travel, np.abs(ratio), ripple * (1.0 + 1e-12))
        ends += [] if place is None else [place]
    if stress is not None:
        place = first_at(solution.travel, solution.stress, stress * (1.0 - STRESS_RTOL))
        ends += [] if place is None else [place]
    return min(ends)


def _list_station_shares(form: Form, values: FloatArray) -> tuple[tuple[float, ...], ...] | None:
    if not form.per_piece:
        return form.shares or None
    ends = np.cumsum((0, *form.per_piece))
    shares = values[form.count : form.count + form.placed]
    return tuple(tuple(float(v) for v in shares[a:b]) for a, b in itertools.pairwise(ends))


def _find_at_bounds(strip: FoundStrip, values: FloatArray) -> list[str]:
    """Return which numbers are at an end of their range."""
    task, form, reasons = strip.program.task, strip.program.form, []
    ends = find_active_bounds(values, strip.ranges, *BOUND_TOLERANCES)
    for k in np.flatnonzero(ends).tolist():
        value, side = float(values[k]), "smallest" if ends[k] < 0 else "largest"
        if k < form.count:
            reasons.append(f"mechanism.beam.thickness.{k} at its {side}, {mm(value * 1e-3)}")
        elif k < form.count + form.placed:
            reasons.append(f"mechanism.beam.shares, number {k - form.count + 1}, at its {side}, {value:.4g}")
        else:
            reasons.append(f"mechanism.beam.width at its {side}, {mm(value * 1e-3)}")
    if task.goal == "stroke" and np.isclose(0.01 * strip.descent.z[-1], task.longest, rtol=1e-6):
        reasons.append(f"stroke at its longest, {mm(task.longest)}")
    return reasons


def _find_active_limits(
    solution: Solution, ratio: FloatArray, inside: Any, limits: tuple[float | None, float | None]
) -> list[str]:
    """Return where the band and the stress hold the strip."""
    reasons = []
    ripple, stress = limits
    if ripple is not None:
        for sign, name in ((1.0, "upper"), (-1.0, "lower")):
            off = np.where(inside, sign * ratio, -np.inf)
            peaks = [k for k in np.flatnonzero(off > (1.0 - ACTIVE_LIMIT_SHARE) * ripple).tolist() if _is_peak(off, k)]
            if peaks:
                places = ", ".join(mm(float(solution.travel[k])) for k in peaks)
                reasons.append(f"{name} edge of the band at {places}")
    last = np.flatnonzero(inside)[-1]
    if stress is not None and solution.stress[last] > (1.0 - 0.5 * ACTIVE_LIMIT_SHARE) * stress:
        where = mm(float(solution.place[last]))
        reasons.append(f"stress {mpa(stress)} at the end, {where} along the strip")
    return reasons


def _is_peak(values: FloatArray, k: int) -> bool:
    """Return whether a value is not below its neighbours."""
    return all(values[k] >= values[j] for j in (k - 1, k + 1) if 0 <= j < len(values))
