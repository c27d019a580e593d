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
    row_of,
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

MAX_SAMPLES_AT_ONCE = 125_000
"""Points that are worked on together: few enough to stay in a processor's cache, 260 curves of 481 points."""
MIN_SHARED_CAMS = 8  # mechanisms around one cam from which on they are worth a solution of their own
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
    beside = [path for path in variants.values if path not in moving]
    mixed: list[int] = []
    for members in _alike([variants.values[path] for path in moving], rows):
        if len(members) < MIN_SHARED_CAMS:
            mixed += members.tolist()
        elif plain >= set(moving):
            yield from _split_into_parcels(members, partial(_with_columns, variants, [*moving, *beside], variants.spec))
        elif (first := dict(valid(variants, members[:1].tolist()))) and not _is_left_out(first[members[0]]):
            yield from _split_into_parcels(members, partial(_with_columns, variants, beside, first[members[0]]))
    rest = np.array(sorted(mixed), dtype=np.intp)
    if plain >= set(moving):
        yield from _split_into_parcels(rest, partial(_with_columns, variants, [*moving, *beside], variants.spec))
        return
    kinds: dict[str, list[int]] = {}
    for row, spec in valid(variants, rest.tolist()):
        if not _is_left_out(spec):
            kinds.setdefault(_kind(spec), []).append(row)
    for alike in kinds.values():
        yield from _split_into_parcels(np.array(alike), partial(_stack_specs, variants), partial(_windows, variants))


def _is_left_out(spec: CamSpec) -> bool:
    mechanism, analysis = spec.mechanism, spec.analysis
    unnamed_curve = mechanism.profile.curve is not None and spec.target_curve is None  # it grows with the springs
    has_parts_of_single_cams = (
        mechanism.profile.file is not None or mechanism.left is not None or mechanism.envelope is not None
    )
    return (
        spec.fidelity != "quasi-static"
        or analysis.manufacturing is not None
        or unnamed_curve
        or has_parts_of_single_cams
    )


def _plain_numbers(spec: CamSpec) -> set[str]:
    """Return the numbers for which it is enough to be within bounds of their own."""
    mechanism, bounded_keys = spec.mechanism, {"mechanism.brace_length", "mechanism.rolling_friction"}
    springs, profile = mechanism.springs, mechanism.profile
    if springs.wound is None and not springs.initial_tension:
        several = range(len(springs.each)) if isinstance(springs.each, tuple) else ()
        bounded_keys |= {f"mechanism.springs.stiffness.{k}" for k in several} or {"mechanism.springs.stiffness"}
        if not several:
            bounded_keys.add("mechanism.springs.count")
    if mechanism.masses is not None:
        bounded_keys |= {f"mechanism.masses.{name}" for name in ("slider", "brace", "roller")}
    if mechanism.contact is not None:
        bounded_keys.add("mechanism.contact.width")
    if spec.design is not None and spec.design.force is not None:
        bounded_keys.add("design.force")
    lengths = ["force_constant", "stroke", "brace_length"]
    if mechanism.plate.base_width is None:
        lengths += ["rest_half_width", "roller_radius"]
        bounded_keys.add("mechanism.roller_radius")
        if springs.rest_length is None and springs.preload is None:
            bounded_keys.add("mechanism.rest_half_width")
    return bounded_keys | {f"mechanism.profile.{name}" for name in lengths if getattr(profile, name) is not None}


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


def _split_into_parcels(
    members: Rows, spec_of: Callable[[Rows], CamSpec], windows_of: Callable[[Rows], Sequence[Ends]] = lambda _rows: ()
) -> Iterator[Group]:
    """Yield mechanisms that are solved together, few at a time."""
    if len(members):
        samples = len(members) * spec_of(members[:1]).analysis.points
        for rows in np.array_split(members, -(-samples // MAX_SAMPLES_AT_ONCE)):
            yield from _solve_alike(spec_of(rows), rows, windows_of)


def _solve_alike(spec: CamSpec, rows: Rows, windows_of: Callable[[Rows], Sequence[Ends]]) -> Iterator[Group]:
    """Yield mechanisms of one specification with columns; those whose computation takes another way apart."""
    try:
        assembly = assemble(spec)
        check_first_pose(assembly)
        low, end = reachable_travel(assembly)
        if fails(end <= low) or shortfalls(assembly, end):
            return
        loads, track = assembly.loads, assembly.track
        for value in (assembly.spec.mechanism.rolling_friction, loads.roller_weight, loads.sideways[0]):
            agree(np.not_equal(value, 0.0))
        agree(track.corner_end - track.start > low)
        solution = replace(solve(assembly, len(rows)), windows=windows_of(rows))
    except RowsDiffer as kinds:
        if kinds.mask.all():
            for row, index in enumerate(rows.tolist()):
                yield from _solve_alike(row_of(spec, row), np.array([index]), windows_of)
        else:
            for some in (np.flatnonzero(kinds.mask), np.flatnonzero(~kinds.mask)):
                part = row_of(spec, int(some[0])) if len(some) == 1 else rows_of(spec, some)
                yield from _solve_alike(part, rows[some], windows_of)
        return
    except CfmError:  # whoever analyses it alone says why
        return
    yield rows, _solve_group(solution, rows)


def _solve_group(solution: Solution, chosen: Rows) -> SolvedRows[Solution]:
    is_known = np.isfinite(solution.up.slider[..., 1:].sum(axis=-1) + solution.down.slider[..., 1:].sum(axis=-1))
    held = solution.elongation.max(axis=-1) >= 0
    held = held if held.all() else held | (solution.up.contact > 0).any(axis=-1)
    complete = np.broadcast_to(is_known & held, len(chosen))
    return SolvedRows(solution, ROW_COLUMNS, LazySequence(partial(rules_of, solution)), complete)
