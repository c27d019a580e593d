"""The document that `cfmkit sweep` prints: how many points meet the requirements, the best one, ranges of results."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.documents.document import (
    MAX_WARNING_LENGTH,
    Document,
    GridColumn,
    Note,
    PageTable,
    ValueRow,
    WarningEntry,
    Written,
    format_bounds,
    name_in_words,
    shortened_to_clause,
)
from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.specs.spec import Spec

MAX_RANGES = 6  # results whose range a short page shows
NO_INFLUENCE = 1e-9
"""Share of a value by which it may change and still counts as the same: rounding of sums leaves as much."""


def document_of(
    spec: Spec,  # what was varied
    summary: Mapping[str, Any],  # what metrics.json says of it
    dimensions: Mapping[str, str],  # of its metrics, by name
    code: ExitCode,  # of the process
    files: Written | None = None,  # what was written
    reused: int = 0,  # points that came from the journal
) -> Document:
    """Return the document of a sweep."""
    counts = summary["points"]
    ends = ", ".join(f"{count} {name_in_words(name)}" for name, count in counts.items() if name != "total")
    again = f" ({reused} from the journal)" if reused else ""
    return Document(
        exit_code=code,
        title=" ".join(spec.name.split()),
        summary=f"{counts['total']} points: {ends}{again}" if counts["total"] else "no point was finished",
        verdict=_verdict(summary, code),
        headline=(
            *(
                ValueRow(
                    _describe_label(one["metric"]),
                    f"met at {one['met']} of {one['of']}",
                    format_bounds(one),
                    bool(one["ok"]),
                )
                for one in summary["requirements"]
            ),
            *_best(summary, dimensions),
        ),
        tables=tuple(_ranges(summary, dimensions)),
        notes=tuple(_settings(summary)),
        warnings=tuple(
            WarningEntry(
                one["name"],
                shortened_to_clause(one["message"], MAX_WARNING_LENGTH - len(one["name"]) - 2),
                one["message"],
            )
            for one in summary["warnings"]
        ),
        files=files,
    )


def _verdict(summary: Mapping[str, Any], code: ExitCode) -> str:
    if code is ExitCode.REQUIREMENT_MISSED:
        return "no point meets every requirement"
    if code is not ExitCode.OK:
        return name_in_words(str(summary["status"] if code is not ExitCode.INTERRUPTED else "interrupted"))
    return "requirements can be met" if summary["requirements"] else "complete"


def _settings(summary: Mapping[str, Any]) -> Iterator[Note]:
    """Yield what was varied, at the best point, as options that can be pasted."""
    if summary["best"]:
        values = summary["best"]["values"].items()
        settings = [f"{path}={''.join(str(value).split())}" for path, value in values]
        yield Note("best", " ".join(f"--set {setting}" for setting in settings), whole=True, is_command=True)


def _best(summary: Mapping[str, Any], dimensions: Mapping[str, str]) -> Iterator[ValueRow]:
    best = summary["best"]
    if not best:
        return
    metric = summary["metrics"][best["by"]]
    value = _quantity(metric["value"], metric["unit"], dimensions.get(best["by"], ""))
    tie = f" ({best['ties']} tie)" if best["ties"] > 1 else ""
    yield ValueRow(f"{best['sense']} {_describe_label(best['by'])}", f"{value}, point {best['point']}{tie}")


def _ranges(summary: Mapping[str, Any], dimensions: Mapping[str, str]) -> Iterator[PageTable]:
    """Yield the range of every result, beside its value at the best point; what does not change comes last."""
    leading: list[tuple[str, ...]] = []
    rows: list[tuple[str, ...]] = []
    constant: list[tuple[str, ...]] = []
    first = [summary["best"]["by"]] if summary["best"] else []
    asked = [one["metric"] for one in summary["requirements"]]
    names = [name for name in dict.fromkeys((*first, *asked, *summary["range"])) if name in summary["range"]]
    for name in names:
        one, dimension = summary["range"][name], dimensions.get(name, "")
        low, high = (_quantity(one[end], one["unit"], dimension) for end in ("min", "max"))
        at_best = summary["metrics"].get(name, {}).get("value")
        shown = "" if at_best is None else _quantity(at_best, one["unit"], dimension)
        if one["max"] - one["min"] <= NO_INFLUENCE * max(abs(one["min"]), abs(one["max"])):
            row, others = (_describe_label(name), low, "no influence", shown), constant
        else:
            row, others = (_describe_label(name), low, high, shown), rows
        (leading if name in (*first, *asked) else others).append(row)
    if leading or rows:
        heads = ("from", "to", *(("best point",) if summary["best"] else ()))
        columns = (GridColumn("range of"), *(GridColumn(head, wraps=False) for head in heads))
        yield PageTable("", columns, tuple(row[: len(columns)] for row in (*leading, *rows)), MAX_RANGES)
    if constant:
        columns = (GridColumn("no influence on"), GridColumn("value", wraps=False))
        yield PageTable("Results without influence", columns, tuple(row[:2] for row in constant), 0)


def _describe_label(label: str) -> str:
    """Return the label of a result as people write it, with its branch and window.

    Examples
    --------
    >>> _describe_label("force_mean[load] over 5 ... 235 mm")
    'force mean on load over 5 to 235 mm'
    """
    return name_in_words(label).replace("[", " on ").replace("]", "").replace(" ... ", " to ")


def _quantity(value: float | str, unit: str, dimension: str) -> str:
    """Return a value in its border unit; of what has none, shares are percentages, counts and factors are not."""
    if isinstance(value, str):
        return value
    if dimension == "ratio":
        return f"{100 * value:.4g} %"
    return f"{value:.5g}" if unit == "1" else f"{value:.5g} {unit}"
