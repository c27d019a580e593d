"""Cams of a study as rows of solutions: those of one kind are solved together.

Mechanisms that differ in what moves neither the roller nor the brace on the cam (springs, friction, weights, the width
of the contact) share one cam and its track, which is found once. Others have a cam each, or a track of their own on it,
and these stand side by side. Each cam is put together as that of a run is.

What no rows have is analysed alone: motions, measured cams, drawn ones, envelopes, cams cut for a curve that no target
names, whatever does not reach the end of the travel, and what cannot be built. Cams that are cut for a curve and for
friction or weights of their own each take a solution of their own.
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
from cfmkit.families.cam.mechanism_from_spec import assemble, check_first_pose
from cfmkit.families.cam.model import reachable_travel, shortfalls, solve
from cfmkit.families.cam.scalar_results import ROW_COLUMNS
from cfmkit.families.rows import (
    RowsDiffer,
    SolvedRows,
    agree,
    drop_numbers,
    fails,
    rows_of,
    stack,
    valid,
    with_values,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from cfmkit.families.cam.solution import Solution
    from cfmkit.families.cam.spec import CamSpec
    from cfmkit.families.rows import Variants
    from cfmkit.specs.units import Ends

    Rows = NDArray[np.intp]
    Group = tuple[Rows, SolvedRows[Solution]]

MAX_SAMPLES_AT_ONCE = 250_000
"""Points that are worked on together: 520 curves of 481 points. A quarter of them takes twice the time a point."""
MIN_SHARED_CAMS, MIN_SHARED_UNCHECKED = 8, 400
"""Mechanisms around one cam from which on they are worth a solution of their own: where each other one is validated,
and where bounds of its numbers are enough.
"""
BESIDE_THE_CAM = re.compile(
    r"mechanism\.(rolling_friction|springs\.(stiffness|count)(\.\d+)?|masses\.(slider|brace|roller)|contact\.width)"
    r"|design\.force"
)
"""Paths of what moves neither the roller nor the brace on the cam."""


def solve_rows(variants: Variants) -> Iterator[Group]:
    """Yield (indices, mechanisms that are solved together) of those that go through all of the travel."""
    if _is_left_out(variants.spec):
        return
    plain = _plain_numbers(variants.spec)
    rows = np.flatnonzero(variants.keep_bounds(variants.values.keys() & plain))
    moving = [path for path in variants.values if path not in plain or not BESIDE_THE_CAM.fullmatch(path)]
    is_checked = plain >= set(moving)
    as_columns = partial(_with_columns, variants, tuple(variants.values), variants.spec)
    least = MIN_SHARED_UNCHECKED if is_checked else MIN_SHARED_CAMS
    shared, rest = _group_shared([variants.values[path] for path in moving], rows, least)
    for members in shared:
        if is_checked:
            yield from _solve_alike(members, as_columns)
        elif (first := dict(valid(variants, members[:1].tolist()))) and not _is_left_out(first[members[0]]):
            beside = [path for path in variants.values if path not in moving]
            yield from _solve_alike(members, partial(_with_columns, variants, beside, first[members[0]]))
    if is_checked:
        yield from _solve_alike(rest, as_columns)
        return
    kinds: dict[str, list[int]] = {}
    for row, spec in valid(variants, rest.tolist()):
        if not _is_left_out(spec):
            kinds.setdefault(_kind(spec), []).append(row)
    for alike in kinds.values():
        yield from _solve_alike(np.array(alike), partial(_stack_specs, variants), partial(_windows, variants))


def _is_left_out(spec: CamSpec) -> bool:
    mechanism, analysis = spec.mechanism, spec.analysis
    unnamed_curve = mechanism.profile.curve is not None and spec.target_curve is None  # it grows with the springs
    other = mechanism.profile.file is not None or mechanism.left is not None or mechanism.envelope is not None
    return spec.fidelity != "quasi-static" or analysis.manufacturing is not None or unnamed_curve or other


def _plain_numbers(spec: CamSpec) -> set[str]:
    """Return the numbers for which it is enough to be within bounds of their own."""
    mechanism, found = spec.mechanism, {"mechanism.brace_length", "mechanism.rolling_friction"}
    springs, profile = mechanism.springs, mechanism.profile
    if springs.wound is None and not springs.initial_tension:
        several = range(len(springs.each)) if isinstance(springs.each, tuple) else ()
        found |= {f"mechanism.springs.stiffness.{k}" for k in several} or {"mechanism.springs.stiffness"}
        if not several:
            found.add("mechanism.springs.count")
    if mechanism.masses is not None:
        found |= {f"mechanism.masses.{name}" for name in ("slider", "brace", "roller")}
    if mechanism.contact is not None:
        found.add("mechanism.contact.width")
    if spec.design is not None and spec.design.force is not None:
        found.add("design.force")
    lengths = ["force_constant", "stroke", "brace_length"]
    if mechanism.plate.base_width is None:
        lengths += ["rest_half_width", "roller_radius"]
        found.add("mechanism.roller_radius")
        if springs.rest_length is None and springs.preload is None:
            found.add("mechanism.rest_half_width")
    return found | {f"mechanism.profile.{name}" for name in lengths if getattr(profile, name) is not None}


def _group_shared(columns: list[NDArray[Any]], rows: Rows, least: int) -> tuple[list[Rows], Rows]:
    """Return groups of many rows with the same values in all columns, in the order of their first, and other rows."""
    if not columns or not len(rows):
        return [], rows
    if any(column.dtype == object for column in columns):
        table: Any = [repr([column[row] for column in columns]) for row in rows.tolist()]
        _, which, count = np.unique(table, return_inverse=True, return_counts=True)
    else:
        table = np.stack([column[rows].astype(np.float64) for column in columns], axis=1)
        _, which, count = np.unique(table, axis=0, return_inverse=True, return_counts=True)
    which = which.ravel()
    groups = [rows[which == kind] for kind in np.flatnonzero(count >= least)]
    return sorted(groups, key=lambda members: int(members[0])), rows[count[which] < least]


def _with_columns(variants: Variants, paths: Sequence[str], spec: CamSpec, rows: Rows) -> CamSpec:
    """Return a specification with the values of some variants at paths, as columns where they differ."""
    values = {path: variants.values[path][rows].astype(np.float64) for path in paths}
    return with_values(spec, {path: stack(column.tolist()) for path, column in values.items()})


def _stack_specs(variants: Variants, rows: Rows) -> CamSpec:
    """Return variants of one kind as one specification, with columns where numbers differ."""
    specs: list[CamSpec] = [variants[row] for row in rows.tolist()]
    analyses = [spec.analysis.model_copy(update={"window": specs[0].analysis.window}) for spec in specs]
    blocks = {name: stack([getattr(spec, name) for spec in specs]) for name in ("mechanism", "design")}
    return specs[0].model_copy(update=blocks | {"analysis": stack(analyses)})


def _windows(variants: Variants, rows: Rows) -> Sequence[Ends]:
    """Return the window of each of some variants where windows vary; nothing where all have the same, or none."""
    varied = any(path.startswith("analysis.window") for path in variants.values)
    windows = [variants[row].analysis.window for row in rows.tolist()] if varied else []
    return () if None in windows else windows


def _kind(spec: CamSpec) -> str:
    """Return what mechanisms side by side have in common beside the way that their computation takes."""
    analysis = spec.analysis
    settings = analysis.points, analysis.window is None, analysis.origin
    curves = spec.mechanism.profile.curve, spec.target_curve
    return repr((settings, curves, [drop_numbers(block) for block in (spec.mechanism, analysis, spec.design)]))


def _solve_alike(
    rows: Rows, spec_of: Callable[[Rows], CamSpec], windows_of: Callable[[Rows], Sequence[Ends]] = lambda _rows: ()
) -> Iterator[Group]:
    """Yield mechanisms that are put together at once and solved a few at a time; those of another kind apart."""
    if not len(rows):
        return
    try:
        assembly = assemble(spec_of(rows))
        check_first_pose(assembly)
        low, end = reachable_travel(assembly)
        if fails(end <= low) or shortfalls(assembly, end):
            return
        loads, track = assembly.loads, assembly.track
        for value in (assembly.spec.mechanism.rolling_friction, loads.roller_weight, loads.sideways[0]):
            agree(np.not_equal(value, 0.0))
        agree(track.corner_end - track.start > low)
    except RowsDiffer as kinds:
        parts = rows[:, None] if kinds.mask.all() else (rows[kinds.mask], rows[~kinds.mask])
        for part in parts:
            yield from _solve_alike(part, spec_of, windows_of)
        return
    except CfmError:  # whoever analyses it alone says why
        return
    samples = len(rows) * assembly.spec.analysis.points
    for some in np.array_split(np.arange(len(rows)), -(-samples // MAX_SAMPLES_AT_ONCE)):
        parcel = replace(rows_of(assembly, some), track=track.of_rows(some)) if len(some) < len(rows) else assembly
        windows = windows_of(rows[some])
        yield rows[some], _solve_group(replace(solve(parcel, len(some)), windows=windows), rows[some])


def _solve_group(solution: Solution, chosen: Rows) -> SolvedRows[Solution]:
    known = np.isfinite(solution.up.slider[..., 1:].sum(axis=-1) + solution.down.slider[..., 1:].sum(axis=-1))
    held = solution.elongation.max(axis=-1) >= 0
    held = held if held.all() else held | (solution.up.contact > 0).any(axis=-1)
    complete = np.broadcast_to(known & held, len(chosen))
    return SolvedRows(solution, ROW_COLUMNS, LazySequence(partial(rules_of, solution)), complete)
