"""Designs of sizes that can be bought and made: sheets of a series, and dimensions with the digits of the process.

Both come before the last analysis: the values that are analysed are those that are written.

A sheet is bought in steps of some 20 %: the design is repeated for the nearest one, and adapts what else it may choose.
Dimensions that the design has chosen are rounded to a power of ten that is at most a tenth of the standard deviation
of the process, so that rounding does not matter beside it. What was stated is left as it is.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.metrics import evaluate, mean_effort
from cfmkit.results import Design, Status
from cfmkit.specs.units import format_short
from cfmkit.stock.processes import is_whole, strands, strands_in_words
from cfmkit.stock.stock_series import series_of
from cfmkit.studies.parts.parts import accuracy_of, process_of_part

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cfmkit.families.run_control import Run
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.stock.processes import ProcessAccuracy
    from cfmkit.stock.stock_series import StockSeries

MAX_SHEETS = 4  # sheets for which a design is tried, the nearest first: farther ones would be another mechanism
SHARE_OF_DEVIATION = 0.1
"""Largest unit of the last digit over the standard deviation of the process: the error is at most 5 % of it."""
MOST_CHANGE = 0.05  # change of the mean force with which a design of whole strands still counts as the same design
FINER_DIGITS = 4
"""Decimals by which the digits are refined where a rounded design misses a requirement that it met: to a nanometre."""
NOT_CHOSEN = ("wound", "bought", "catalogue", "free", "tolerances", "material")
"""Blocks whose sizes are those of a maker, or limits that are stated."""


def with_stock_sheet(original: Spec, outcome: Design, finish: Callable[[Spec], Design], run: Run) -> Design:
    """Return a design that is cut from a sheet of its series, where `part.stock` asks for one.

    Parameters
    ----------
    original : Spec
        With a `design` block.
    outcome : Design
        Its design, of any width.
    finish : callable
        What designs a specification.
    run : Run
        For the analyses that tell by how much the force changes.

    Returns
    -------
    Design
        INFEASIBLE where no design exists for the sheets around its width.
    """
    part: Any = getattr(getattr(original, "mechanism", None), "part", None)
    system = getattr(part, "stock", None)
    widths = {} if outcome.spec is None else _widths(outcome.spec)
    process = process_of_part(original)
    if system is None or outcome.spec is None or not widths or getattr(part, "sheet", None) is not None:
        return outcome
    if (process is not None and process.prints) or accuracy_of(original).name in ("fdm", "sls"):
        return outcome
    material = getattr(getattr(original.get_value("mechanism"), "material", None), "name", None)
    series = series_of("sheet", system, material)
    if series is None:
        text = f"no {system} series of {material or 'this material'} is known: its width is not rounded"
        return replace(outcome, notes=(*outcome.notes, ("stock", text)))
    middle = math.exp(float(np.mean([math.log(width) for width in widths.values()])))
    reasons = []
    for sheet in series.sort_by_distance(middle)[:MAX_SHEETS]:
        try:
            again = finish(original.replace({"mechanism.part.sheet": sheet, **dict.fromkeys(widths, sheet)}))
        except SpecError as error:
            reasons.append(f"{format_short(sheet, 'length')}: {error.problems[0].message}")
            continue
        if again.spec is not None:
            note = _describe_sheet(outcome.spec, again.spec, series, sheet, widths, run)
            return replace(again, notes=(*again.notes, ("stock", note)))
        reasons.append(f"{format_short(sheet, 'length')}: {again.message}")
    text = f"part.stock: no design from a sheet of {material} that is sold ({system}: {'; '.join(reasons)})"
    return Design(None, Status.INFEASIBLE, text)


def with_whole_strands(original: Spec, outcome: Design, finish: Callable[[Spec], Design], run: Run) -> Design:
    """Return a design whose printed leaves are whole strands thick, where `part.stock` asks for sizes that exist.

    The next whole numbers are tried, the nearest first, and the design is repeated for each. Where it would then miss a
    requirement that it meets, or another force results, it is left as it is, with a note.
    """
    part: Any = getattr(getattr(original, "mechanism", None), "part", None)
    if outcome.spec is None or getattr(part, "stock", None) is None or accuracy_of(original).name != "fdm":
        return outcome
    nozzle = accuracy_of(original).least_feature
    leaves = {path: size for path, size in outcome.spec.leaves() if is_leaf(path, size)}
    if not leaves or all(is_whole(size, nozzle) for size in leaves.values()):
        return outcome
    neighbours = [{path: _choose_whole_strands(size, nozzle, rank) for path, size in leaves.items()} for rank in (0, 1)]
    before, _ = _outcomes(outcome.spec, run)
    words = "; ".join(strands_in_words(size, nozzle) for size in dict.fromkeys(leaves.values()))
    for changes in neighbours:
        try:
            levers = _list_changed_keys(original, leaves, changes)
            stated = {path: value for path, value in original.leaves() if path in levers}  # the stated ones stay
            again = finish(original.replace({**changes, **levers}))
            spec = None if again.spec is None else again.spec.replace({**changes, **stated})
        except SpecError:
            continue
        if spec is None or any(was and not now for was, now in zip(before, _outcomes(spec, run)[0], strict=True)):
            continue
        means = [mean_effort(family(entry.family).analyze(entry, run)) or math.nan for entry in (outcome.spec, spec)]
        if not abs(means[1] / means[0] - 1.0) <= MOST_CHANGE:
            continue
        told = _describe_change(f"whole strands taken: {words}", outcome.spec, spec, run)
        return replace(again, spec=spec, notes=(*again.notes, ("strands", told)))
    text = f"left as they are, because no design of whole strands meets as much: {words}"
    return replace(outcome, notes=(*outcome.notes, ("strands", text)))


def _list_changed_keys(original: Spec, leaves: Mapping[str, float], changes: Mapping[str, float]) -> dict[str, Any]:
    """Return by which keys a design comes to thicknesses: a strip is as thick as its stress allows, or thinner."""
    beam = "mechanism.beam.thickness"
    if beam not in changes or getattr(getattr(original, "design", None), "beam", None) is None:
        return {}
    thinner = max(1.0, leaves[beam] / changes[beam])
    return {"mechanism.safety_factor": thinner * float(original.get_value("mechanism").safety_factor)}


def is_leaf(path: str, size: Any) -> bool:
    """Return True for the thickness of a leaf [m], not for the deviation of it that a process has."""
    leaf = path.startswith("mechanism.") and path.endswith(".thickness") and ".process." not in path
    return leaf and isinstance(size, float)


def _choose_whole_strands(thickness: float, nozzle: float, rank: int) -> float:
    numbers = strands(thickness, nozzle)
    return round(numbers[min(rank, len(numbers) - 1)] * nozzle, 9)


def _widths(spec: Spec) -> dict[str, float]:
    """Return the widths out of the plane, by their paths [m]."""
    stated = spec.out_of_plane_widths.items()
    return {f"mechanism.{key}": float(width) for key, width in stated if width is not None}


def _describe_sheet(
    before: Spec, after: Spec, series: StockSeries, sheet: float, widths: Mapping[str, float], run: Run
) -> str:
    """Return which sheet was taken instead of which widths, and what that does to the force."""
    old = ", ".join(format_short(width, "length") for width in dict.fromkeys(widths.values()))
    begun = f"sheet {format_short(sheet, 'length', 6)} ({series.system}, {series.standard}) instead of {old}"
    return _describe_change(begun, before, after, run)


def _describe_change(begun: str, before: Spec, after: Spec, run: Run) -> str:
    """Return a sentence on a change, and what that does to the force."""
    record = family(after.family)
    means = [mean_effort(record.analyze(entry, run)) for entry in (before, after)]
    if None in means or not means[0]:
        return f"{begun}, and designed again"
    kind = "torque" if after.motion == "angle" else "force"
    was, now = (format_short(float(mean or 0.0), kind) for mean in means)
    share = 100.0 * (float(means[1] or 0.0) / float(means[0]) - 1.0)
    return f"{begun}, and designed again: mean {kind} {now} instead of {was} ({share:+.2g} %)"


def decimals_of(accuracy: ProcessAccuracy) -> int:
    """Return how many decimals of a millimetre a dimension is written with.

    Examples
    --------
    >>> from cfmkit.stock.processes import PROCESSES_BY_NAME
    >>> {name: decimals_of(process) for name, process in PROCESSES_BY_NAME.items()}
    {'laser': 3, 'wire-edm': 4, 'fdm': 3, 'sls': 3, 'mill': 3}
    """
    deviation = min(entry for entry in (accuracy.thickness, accuracy.position, 1e-3) if entry > 0.0)
    return max(0, math.ceil(-math.log10(1e3 * SHARE_OF_DEVIATION * deviation) - 1e-9))


def with_digits_of_process(original: Spec, outcome: Design, finish: Callable[[Spec], Design], run: Run) -> Design:
    """Return a design whose chosen lengths and angles have the digits that its process can hold.

    So has a part to make: one of a stated material or process. A mechanism of lengths and rates alone stays exact.
    Where the rounded design would miss a requirement that it meets unrounded, or warn of something new, its digits are
    refined; so they are where it would leave the tolerance of the design. Where rates of springs are chosen, they are
    chosen again for the rounded lengths: `finish` designs a specification.
    """
    if outcome.spec is None or not _is_part_to_make(outcome.spec):
        return outcome
    stated, written = (
        dict(lengths_and_angles(spec.model_dump(mode="json", exclude_unset=True))) for spec in (original, outcome.spec)
    )
    kept = {*stated.values(), written.get("mechanism.part.sheet")}  # a profile made for stated links has their lengths
    chosen = {path: text for path, text in written.items() if text not in kept}
    decimals, before = decimals_of(accuracy_of(outcome.spec)), None
    for refined in range(FINER_DIGITS):
        rounded = {path: round_to_digits(text, decimals + refined) for path, text in chosen.items()}
        changes = {path: text for path, text in rounded.items() if text != chosen[path]}
        if not changes:
            return outcome
        try:
            spec = outcome.spec.replace(changes)
            if _has_chosen_rates(original, outcome.spec) and (again := finish(spec)).spec is not None:
                spec = again.spec.replace(changes)
        except SpecError:  # values that must agree with others to more digits
            continue
        met, warned = _outcomes(spec, run)
        if before is None and not (all(met) and not warned):
            before = _outcomes(outcome.spec, run)
        was_met, was_warned = before or (met, warned)
        if all(now or not then for now, then in zip(met, was_met, strict=True)) and warned <= was_warned:
            return replace(outcome, spec=spec)
    return outcome


def _is_part_to_make(spec: Spec) -> bool:
    """Return True if a specification says of which material, or by which process, its part is made."""
    mechanism: Any = getattr(spec, "mechanism", None)
    process = process_of_part(spec) or getattr(getattr(spec, "design", None), "process", None)
    return process is not None or getattr(mechanism, "material", None) is not None


def _has_chosen_rates(original: Spec, designed: Spec) -> bool:
    """Return True if a design has changed the rate of a spring."""
    springs = [dict(entry.leaves()) for entry in (original, designed)]
    paths = [path for path in springs[1] if path.startswith("mechanism.springs.") and "wound" not in path]
    return any(springs[0].get(path) != springs[1][path] for path in paths)


def lengths_and_angles(value: Any, blocks: Sequence[str] = ("mechanism",), path: str = "") -> Iterator[tuple[str, str]]:
    """Yield every length and angle of some blocks of a written specification as (dotted path, text as written)."""
    if isinstance(value, dict):
        for key, item in value.items():
            inside = f"{path}.{key}" if path else str(key)
            if inside.split(".")[0] in blocks and key not in NOT_CHOSEN:
                yield from lengths_and_angles(item, blocks, inside)
    elif isinstance(value, list):
        for number, item in enumerate(value):
            yield from lengths_and_angles(item, blocks, f"{path}.{number}")
    elif isinstance(value, str) and value.endswith((" mm", " deg")):
        yield path, value


def round_to_digits(text: str, decimals: int) -> str:
    """Return a length or an angle with so many decimals: 0.001 deg move the end of 57 mm by 0.001 mm.

    >>> round_to_digits("44.41952131863 mm", 3), round_to_digits("6.37937020844 deg", 3), round_to_digits("6 mm", 3)
    ('44.42 mm', '6.379 deg', '6 mm')
    """
    number, unit = text.split()
    short = f"{float(number):.{decimals}f}".rstrip("0").rstrip(".")
    return text if float(short) == 0.0 else f"{short} {unit}"


def _outcomes(spec: Spec, run: Run) -> tuple[list[bool], set[str]]:
    """Return whether a design is solved to its end and meets each requirement on one part; names of its warnings."""
    record = family(spec.family)
    result = record.analyze(spec, run)
    met = (bool(entry.ok) for entry in record.check(result))
    reached = [result.status is Status.COMPLETE, _keeps_tolerance(spec, result), *met]
    return reached, {entry.name for entry in result.warnings}


def _keeps_tolerance(spec: Spec, result: Result) -> bool:
    """Return True if the effort keeps to the target as closely as the design was to, where it says how closely."""
    tolerance = getattr(getattr(spec, "design", None), "tolerance", None)
    if tolerance is None or not result.curves:
        return True
    deviation = evaluate(result, ["deviation_from_target"])["deviation_from_target"].value
    return deviation is None or deviation <= tolerance
