"""Cams of a study as rows of solutions: those of one kind are solved together.

Mechanisms that differ in what moves neither the roller nor the brace on the cam (springs, friction, weights, the width
of the contact) share one cam and its track, which is found once. Others have a cam each, or a track of their own on it,
and these stand side by side. Each cam is put together as that of a run is.

What no rows have is analysed alone: motions, measured cams, drawn ones, envelopes, forces that follow a curve, whatever
does not reach the end of the travel, and what cannot be built.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import LazySequence
from cfmkit.errors import CfmError
from cfmkit.families.cam.findings import rules_of
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TrackRows, profiles_in_rows
from cfmkit.families.cam.mechanism_from_spec import (
    assemble,
    check_first_pose,
    loads_of,
)
from cfmkit.families.cam.model import reachable_travel, shortfalls, solve
from cfmkit.families.cam.scalar_results import ROW_COLUMNS
from cfmkit.families.no_mechanism import CannotBuild
from cfmkit.families.rows import SolvedRows, drop_numbers, stack, with_values

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterator, Mapping

    from numpy.typing import NDArray

    from cfmkit.families.cam.assembly import Assembly
    from cfmkit.families.cam.solution import Solution
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.families.rows import Variants

    Rows = NDArray[np.intp]
    Group = tuple[Rows, SolvedRows[Solution]]

MAX_SAMPLES_AT_ONCE = 120_000
"""Points that are worked on together: few enough to stay in a processor's cache, 400 curves of 301 points."""

MIN_SHARED_CAMS = 8
"""Mechanisms around one cam from which on they are worth a solution of their own."""

BESIDE_THE_CAM = re.compile(
    r"mechanism\.(rolling_friction|springs\.(stiffness|count)(\.\d+)?|masses\.(slider|brace|roller)|contact\.width)"
    r"|design\.force"
)
"""Paths of what moves neither the roller nor the brace on the cam."""


def solve_rows(variants: Variants) -> Iterator[Group]:
    """Yield (indices, mechanisms that are solved together) of those that go through all of the travel."""
    if _is_left_out(variants.spec):
        return
    plain, rows = _plain_numbers(variants.spec), np.arange(len(variants))
    checks = [plain[path](values) for path, values in variants.values.items() if path in plain]
    rows = rows[np.logical_and.reduce([np.ones(len(rows), dtype=bool), *checks])]
    beside = [path for path in variants.values if path in plain and BESIDE_THE_CAM.fullmatch(path)]
    moving = [path for path in variants.values if path not in beside]
    alone: dict[Hashable, list[tuple[int, Assembly]]] = {}
    for members in _alike([variants.values[path] for path in moving], rows):
        assembly = _assemble_first(variants, members, moving, plain)
        if assembly is None:
            continue
        kind = None if len(members) >= MIN_SHARED_CAMS else _kind(assembly, plain.keys() >= set(moving))
        if kind is None:
            yield from _group_around_one_cam(assembly, members, {path: variants.values[path] for path in beside})
            continue
        for row in members.tolist():
            own = _with_others(assembly, {path: variants.values[path][row].item() for path in beside})
            alone.setdefault((kind, *_flags(own)), []).append((row, own))
    for group in alone.values():
        yield from _side_by_side(group, variants)


def _is_left_out(spec: CamSpec) -> bool:
    mechanism, analysis = spec.mechanism, spec.analysis
    curves = spec.target_curve is not None or mechanism.profile.curve is not None
    other = mechanism.profile.file is not None or mechanism.left is not None or mechanism.envelope is not None
    return spec.fidelity != "quasi-static" or analysis.manufacturing is not None or curves or other


def _plain_numbers(spec: CamSpec) -> dict[str, Callable[[NDArray[Any]], NDArray[np.bool_]]]:
    """Return the numbers for which it is enough to be within bounds of their own, and which values are."""
    mechanism, found = spec.mechanism, {"mechanism.brace_length": _is_positive}
    springs, profile = mechanism.springs, mechanism.profile
    found["mechanism.rolling_friction"] = _is_friction
    if springs.wound is None and not springs.initial_tension:
        several = range(len(springs.each)) if isinstance(springs.each, tuple) else ()
        names = [f"mechanism.springs.stiffness.{k}" for k in several] or ["mechanism.springs.stiffness"]
        found |= dict.fromkeys(names, _is_positive)
        if not several:
            found["mechanism.springs.count"] = _is_count
    if mechanism.masses is not None:
        found |= dict.fromkeys([f"mechanism.masses.{name}" for name in ("slider", "brace", "roller")], _is_mass)
    if mechanism.contact is not None:
        found["mechanism.contact.width"] = _is_positive
    if spec.design is not None and spec.design.force is not None:
        found["design.force"] = _is_positive
    lengths = ["force_constant", "stroke", "brace_length"]
    if mechanism.plate.base_width is None:
        lengths += ["rest_half_width", "roller_radius"]
        found["mechanism.roller_radius"] = _is_positive
        if springs.rest_length is None and springs.preload is None:
            found["mechanism.rest_half_width"] = _is_positive
    stated = [name for name in lengths if getattr(profile, name) is not None]
    return found | dict.fromkeys([f"mechanism.profile.{name}" for name in stated], _is_positive)


def _is_positive(values: NDArray[Any]) -> NDArray[np.bool_]:
    return np.asarray((values > 0) & np.isfinite(values))


def _is_mass(values: NDArray[Any]) -> NDArray[np.bool_]:
    return np.asarray((values >= 0) & np.isfinite(values))


def _is_friction(values: NDArray[Any]) -> NDArray[np.bool_]:
    return np.asarray((values >= 0) & (values < 1))


def _is_count(values: NDArray[Any]) -> NDArray[np.bool_]:
    return np.asarray((values >= 1) & (values <= 1000) & (values == np.rint(values)))


def _alike(columns: list[NDArray[Any]], rows: Rows) -> list[Rows]:
    """Return the rows in groups that have the same values in all columns, in the order of their first."""
    if not columns or not len(rows):
        return [rows] if len(rows) else []
    if any(column.dtype == object for column in columns):
        keys: dict[str, list[int]] = {}
        for row in rows.tolist():
            keys.setdefault(repr([column[row] for column in columns]), []).append(row)
        return [np.array(members) for members in keys.values()]
    table = np.stack([column[rows].astype(np.float64) for column in columns], axis=1)
    _, which = np.unique(table, axis=0, return_inverse=True)
    order = np.argsort(which.ravel(), kind="stable")
    groups = np.split(rows[order], np.flatnonzero(np.diff(which.ravel()[order])) + 1)
    return sorted(groups, key=lambda members: int(members[0]))


def _assemble_first(variants: Variants, members: Rows, moving: list[str], plain: Mapping[str, Any]) -> Assembly | None:
    """Return the first of some mechanisms around one cam put together; None where that is left to the run of each."""
    try:
        if plain.keys() >= set(moving):
            first = int(members[0])
            spec = with_values(variants.spec, {path: float(variants.values[path][first]) for path in moving})
        else:
            spec = variants[int(members[0])]
        if _is_left_out(spec):
            return None
        assembly = assemble(spec)
        check_first_pose(assembly)
    except (CannotBuild, CfmError):
        return None
    low, end = reachable_travel(assembly)
    return None if end <= low or shortfalls(assembly, end) else assembly


def _with_others(assembly: Assembly, values: Mapping[str, Any]) -> Assembly:
    """Return a mechanism with other springs, friction and weights, of which there may be columns."""
    if not values:
        return assembly
    spec = with_values(assembly.spec, values)
    mechanism = spec.mechanism
    return replace(assembly, spec=spec, loads=loads_of(spec, mechanism.springs.total, mechanism.springs_rest))


def _flags(assembly: Assembly) -> tuple[Hashable, ...]:
    """Return what of the loads decides which formulas hold."""
    loads = assembly.loads
    weights = bool(loads.roller_weight), bool(loads.sideways[0]), loads.plain, loads.losses is None
    return bool(assembly.spec.mechanism.rolling_friction), *weights


def _kind(assembly: Assembly, are_plain: bool) -> Hashable | None:
    """Return what mechanisms side by side have in common; None if they are not."""
    kind, spec = assembly.track.kind, assembly.spec
    if kind is None:
        return None
    analysis = spec.analysis
    corner = assembly.track.corner_end - assembly.track.start > reachable_travel(assembly)[0]
    settings = analysis.points, analysis.band, repr(analysis.window), analysis.origin, corner
    blocks = () if are_plain else (repr([drop_numbers(one) for one in (spec.mechanism, analysis, spec.design)]),)
    return kind, assembly.shortfall is None, settings, blocks


def _group_around_one_cam(assembly: Assembly, members: Rows, beside: Mapping[str, NDArray[Any]]) -> Iterator[Group]:
    """Yield mechanisms around one cam, few at a time."""
    size = max(1, MAX_SAMPLES_AT_ONCE // assembly.spec.analysis.points)
    which_act = [values > 0 for path, values in beside.items() if "friction" in path or "masses" in path]
    for some in _alike(which_act, members):
        for start in range(0, len(some), size):
            chosen = some[start : start + size]
            columns: dict[str, Any] = {
                path: values[chosen].astype(np.float64)[:, None] for path, values in beside.items()
            }
            if len(chosen) == 1:
                columns = {path: float(values[0, 0]) for path, values in columns.items()}
            yield chosen, _solve_group(solve(_with_others(assembly, columns), len(chosen)), chosen)


def _side_by_side(group: list[tuple[int, Assembly]], variants: Variants) -> Iterator[Group]:
    """Yield mechanisms of one kind, each with a track of its own, few at a time."""
    size = max(1, MAX_SAMPLES_AT_ONCE // group[0][1].spec.analysis.points)
    for start in range(0, len(group), size):
        rows, cams = zip(*group[start : start + size], strict=True)
        chosen = np.array(rows)
        if len(cams) == 1:
            yield chosen, _solve_group(solve(cams[0]), chosen)
            continue
        yield chosen, _solve_group(solve(_columns(cams, variants, chosen), len(cams), cams), chosen)


_WRITTEN_OUT = tuple(
    f"mechanism.profile.{name}" for name in ("brace_length", "rest_half_width", "roller_radius", "preload", "stroke")
)
"""What `resolve` adds to a specification."""


def _columns(cams: tuple[Assembly, ...], variants: Variants, chosen: Rows) -> Assembly:
    """Return mechanisms side by side as one, whose numbers are columns."""
    first = cams[0]
    # what all have in common stays a plain number: among it are those that are no columns, as numbers of points
    varied = {path: values[chosen] for path, values in variants.values.items() if values.dtype != object}
    numbers = [path for path, values in varied.items() if (values != values[0]).any()]
    columns = {path: variants.values[path][chosen].astype(np.float64)[:, None] for path in numbers}
    columns |= {path: stack([one.spec.get_value(path) for one in cams]) for path in _WRITTEN_OUT}
    track, profile = TrackRows([one.track for one in cams]), profiles_in_rows([one.profile for one in cams])
    loads = stack([one.loads for one in cams])
    return replace(first, spec=with_values(first.spec, columns), profile=profile, track=track, loads=loads)


def _solve_group(solution: Solution, chosen: Rows) -> SolvedRows[Solution]:
    known = np.isfinite(solution.up.slider[..., 1:].sum(axis=-1) + solution.down.slider[..., 1:].sum(axis=-1))
    held = solution.elongation.max(axis=-1) >= 0
    held = held if held.all() else held | (solution.up.contact > 0).any(axis=-1)
    complete = np.broadcast_to(known & held, len(chosen))
    return SolvedRows(solution, ROW_COLUMNS, LazySequence(partial(rules_of, solution)), complete)
