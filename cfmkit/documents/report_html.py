"""``report.html``, a page to share: of one run, or of a sweep or a sensitivity study.

That of a run has its document, figures, a slider that moves the mechanism, and metrics. That of a study has what its
document says, then a slider for each varied value, its points as a table that sorts and filters, and its curves. It is
made from the study's own files, so it says what they say. A file has at most 500 curves and 4 MB of points: a study
with more columns keeps those that were varied and those that its page shows first, and says so.
"""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cfmkit.documents import html
from cfmkit.documents.document import GridColumn
from cfmkit.documents.html import REPORT_NAME, escaped_json, part, references_of
from cfmkit.documents.run_document import document_of, metrics_table
from cfmkit.families import family
from cfmkit.plots.figures import moving_of
from cfmkit.specs.units import format_short, to_border

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.figure import Figure

    from cfmkit.documents.document import Document
    from cfmkit.documents.run_document import RunCommand
    from cfmkit.documents.run_outcome import Report
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec


def run_page(
    report: Report,  # of any status
    drawn: Mapping[str, Figure],  # the figures of the result, by their names: the first is the curve
    command: str = "",  # how the run was started, for whoever wants to repeat it
    texts: Sequence[tuple[str, str]] = (),  # the specification, under its heading
    # the command that was run; the commands that apply a remedy of a finding are built from it
    run: RunCommand | None = None,
) -> bytes:
    """Return the page of a run; the same report gives the same bytes."""
    record = family(report.result.spec.family)
    figures = {name: html.drawing(figure, name) for name, figure in drawn.items()}
    slider = _pose_slider(report.result, drawn, figures)
    return html.page(
        document_of(report, run),
        figures,
        subject=f"{record.name}: {record.summary}",
        command=command,
        texts=texts,
        metrics=metrics_table(report.metrics) if report.metrics else None,
        film=slider,
        script=part("report.js") if slider else "",
        **references_of(record.name),
    )


@dataclass(frozen=True)
class PoseSlider:
    """Drawing of all poses with a slider that chooses one, beside the curve with a cursor."""

    drawing: str  # SVG of all poses
    curve: str  # name of the figure that has the cursors
    data: str  # JSON for the script: texts and places of the cursors of each pose
    poses: int  # how many there are
    first: str  # what stands below the slider before it is moved


def _pose_slider(result: Result, drawn: Mapping[str, Figure], figures: dict[str, str]) -> PoseSlider | None:
    """Return the poses of a result; None if its family draws none. The first figure gets a cursor for each pose."""
    moving = moving_of(family(result.spec.family), result)
    if moving is None or not drawn:
        return None
    from cfmkit.plots.mechanism_in_motion import film

    name = next(iter(drawn))
    spots = list(_cursors(drawn[name], to_border(moving.motion, result.curve.motion_dimension)))
    lines = "".join(
        f'<line class="cursor" x1="{xs[0]}" x2="{xs[0]}" y1="{low}" y2="{high}"/>' for xs, low, high in spots
    )
    figures[name] = figures[name].replace("</svg>", f"{lines}</svg>")
    texts = [_pose_caption(result, float(place)) for place in moving.motion]
    data = escaped_json({"texts": texts, "cursors": [xs for xs, _, _ in spots]})
    drawing = film(moving, f"{result.spec.family} mechanism to scale over its travel")
    return PoseSlider(drawing, name, data, len(texts), texts[0])


def _cursors(figure: Figure, motion: Any) -> Iterator[tuple[list[float], float, float]]:
    """Yield, for each panel over the motion: x of the cursor at every pose, and its lower and upper end [pt]."""
    height = figure.bbox.height / figure.dpi * 72.0
    for ax in figure.axes:
        box = ax.get_window_extent()
        scale = 72.0 / figure.dpi
        x = ax.transData.transform(np.column_stack([motion, np.zeros(len(motion))]))[:, 0]
        x = np.clip(x, box.x0, box.x1) * scale
        yield (
            [round(float(value), 2) for value in x],
            round(height - box.y0 * scale, 2),
            round(height - box.y1 * scale, 2),
        )


def _pose_caption(result: Result, place: float) -> str:
    """Return the text below the slider: the motion and the effort of every branch at one pose."""
    curve = result.curve
    texts = [f"{curve.motion_name} {format_short(place, curve.motion_dimension)}"]
    for name in dict.fromkeys(curve.branches):
        on = curve.branch == name
        effort = _nearest(curve.motion[on], curve.effort[on], place)
        label = f"{curve.kind} on {name}" if len(set(curve.branches)) > 1 else curve.kind
        texts.append(f"{label} {format_short(effort, curve.kind)}" if np.isfinite(effort) else f"{label}: none")
    return ", ".join(texts)


def _nearest(motion: Any, effort: Any, place: float) -> float:
    """Return the effort at a motion, linear between points; NaN beyond them or where the curve folds back."""
    order = np.argsort(motion, kind="stable")
    if len(motion) < 2 or not np.all(np.diff(motion[order]) > 0):
        return float(effort[np.argmin(np.abs(motion - place))]) if len(motion) else np.nan
    return float(np.interp(place, motion[order], effort[order], left=np.nan, right=np.nan))


MOST_CURVES = 500  # curves in one file: a point further down the table shows the command that makes its curve
MOST_POINTS = 20_000  # points in one file: more take a browser seconds for every move of a slider
MOST_BYTES = 4_000_000  # of JSON for the points: beyond it a browser needs seconds to begin
MAX_STATIC_ROWS = 50  # rows that stand in the page itself, for readers without scripts
TEXT_COLUMNS = ("requirements_met", "status", "warnings", "message")  # the columns behind the metrics
PAGE_DIGITS = 6  # of a number in the page: more are in results.csv


class StudyPoints(NamedTuple):
    """The points of a study as the page has them."""

    columns: tuple[GridColumn, ...]
    rows: tuple[tuple[str, ...], ...]  # the first of them, for readers without scripts
    total: int
    left_out: tuple[str, ...]  # what is only in results.csv
    data: str  # JSON for the script
    heading: str = "points"


def study_page(
    document: Document,  # what the study found
    spec: Spec,  # what was varied
    varied: Sequence[str],  # paths of what was varied
    files: Mapping[str, bytes],  # name -> content of the study's files: results.csv and metrics.json at least
    command: str,  # how the study was started
    drawn: Mapping[str, Figure] = MappingProxyType({}),  # the pictures of the study, by their names
    point: str = "cfmkit analyze SPEC",  # the command that computes one point as the study did, but for what was varied
) -> bytes:
    """Return the page of a study."""
    summary = json.loads(files["metrics.json"])
    head, *points = csv.reader(io.StringIO(files["results.csv"].decode()))
    rows = points[:MOST_POINTS]
    paths = [name for name in head if name.partition(" [")[0] in varied]
    kept = _fitting(head, rows, paths, list(summary.get("metrics", {})))
    columns = [[row[head.index(name)] for row in rows] for name in kept]
    data = {
        "command": point,
        "head": kept,
        "varied": [kept.index(name) for name in paths],
        "columns": [_numbers(column, exact=name in paths) for name, column in zip(kept, columns, strict=True)],
        "curves": _curves(files.get("curves.csv"), paths, [[row[head.index(path)] for row in rows] for path in paths]),
    }
    more = ((len(points) - len(rows), "points"), (len(head) - len(kept), "columns"))
    shown = StudyPoints(
        tuple(map(GridColumn, kept)),
        tuple(tuple(_short(column[at]) for column in columns) for at in range(min(MAX_STATIC_ROWS, len(rows)))),
        len(points),
        tuple(f"{count} more {things} are in results.csv." for count, things in more if count),
        escaped_json(data),
    )
    return html.page(
        document,
        drawn,
        subject=f"{spec.family}: {'a sensitivity study' if 'indices.csv' in files else 'a sweep'}",
        command=command,
        points=shown,
        script=part("study.js"),
        **references_of(spec.family),
    )


def _fitting(
    head: Sequence[str], rows: Sequence[Sequence[str]], paths: Sequence[str], shown: Sequence[str]
) -> list[str]:
    """Return the columns that the page has room for, in the order of the file."""
    size = {
        name: sum(len(row[at] if name in paths else _short(row[at])) + 3 for row in rows)
        for at, name in enumerate(head)
    }
    first = [name for name in head if name in paths or name in TEXT_COLUMNS or name.partition(" [")[0] in shown]
    kept, used = set(), 0
    for name in dict.fromkeys((*paths, "status", *first, *head)):
        if name in size and used + size[name] <= MOST_BYTES:
            kept.add(name)
            used += size[name]
    return [name for name in head if name in kept]


def _short(text: str) -> str:
    """Return the text of a cell with its number rounded to `PAGE_DIGITS`."""
    try:
        value = float(text)
    except ValueError:
        return text
    return f"{value:.{PAGE_DIGITS}g}" if math.isfinite(value) else text


def _numbers(column: Sequence[str], exact: bool) -> list[Any]:
    """Return a column for the script: numbers where there are any, else texts; None if nothing stands.

    What was varied keeps every digit: the command of a point is made of it.
    """
    cells: list[Any] = []
    for text in column:
        try:
            value = float(text if exact else _short(text))
        except ValueError:
            cells.append(text or None)
        else:
            cells.append(value if math.isfinite(value) else text)
    return cells


def _curves(content: bytes | None, paths: Sequence[str], cells: Sequence[Sequence[str]]) -> dict[str, Any]:
    """Return the first curves of curves.csv: names of the axes, and by number of the row the branches with x and y.

    A curve belongs to the row with the same varied values: both files write them alike.
    """
    if content is None or not cells:
        return {}
    head, *rows = csv.reader(io.StringIO(content.decode()))
    numbers = {key: at for at, key in reversed(list(enumerate(zip(*cells, strict=True))))}
    varied, branch = [head.index(path) for path in paths], head.index("branch") if "branch" in head else None
    x, y = (next((at for at, name in enumerate(head) if name.startswith(names)), None) for names in _AXIS_PREFIXES)
    points: dict[int, dict[str, list[list[float]]]] = {}
    for row in rows:
        number = numbers.get(tuple(row[at] for at in varied))
        if number is None or x is None or y is None or (number not in points and len(points) >= MOST_CURVES):
            continue
        line = points.setdefault(number, {}).setdefault("" if branch is None else row[branch], [[], []])
        if row[x] and row[y]:
            line[0].append(float(row[x]))
            line[1].append(float(row[y]))
    if not points or x is None or y is None:
        return {}
    drawn = {number: {name: _simplify_branch(line) for name, line in lines.items()} for number, lines in points.items()}
    return {"x": head[x], "y": head[y], "points": drawn}


def _simplify_branch(line: list[list[float]]) -> list[list[float]]:
    """Return a branch without the points that its drawing does not need: no line moves by more than `MAX_SHIFT`."""
    from shapely import LineString

    places = np.array(line).T
    if len(places) > 2:
        span = np.ptp(np.vstack([places, [places[0, 0], 0.0]]), axis=0)
        scale = _DIAGRAM_PIXELS / np.where(span > 0, span, 1.0)
        pixels = LineString(places * scale).simplify(MAX_SHIFT, preserve_topology=False)
        places = np.array(pixels.coords) / scale
    return [[float(f"{value:.5g}") for value in along] for along in places.T]


MAX_SHIFT = 0.2  # of a line by the points that are left out [pixels]
_DIAGRAM_PIXELS = np.array([564.0, 264.0])  # width and height of the diagram that study.js draws, without its margins
_AXIS_PREFIXES = (("displacement [", "angle ["), ("force [", "torque ["))
"""How the columns of a curve begin that are drawn: over which, and which."""


__all__ = ["REPORT_NAME", "PoseSlider", "StudyPoints", "run_page", "study_page"]
