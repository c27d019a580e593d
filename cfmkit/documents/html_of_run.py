"""``report.html`` of one run, a page to share: its document, figures, a slider that moves the mechanism, metrics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.documents import html
from cfmkit.documents.html import REPORT_NAME, escaped_json, part, references_of
from cfmkit.documents.run_document import document_of, metrics_table
from cfmkit.families import family
from cfmkit.plots.figures import moving_of
from cfmkit.specs.units import format_short, to_border

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.figure import Figure

    from cfmkit.documents.run_document import RunCommand
    from cfmkit.documents.run_outcome import Report
    from cfmkit.results import Result


def page(
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
    from cfmkit.plots.poses_in_one_svg import film

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
        yield [round(float(one), 2) for one in x], round(height - box.y0 * scale, 2), round(height - box.y1 * scale, 2)


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


__all__ = ["REPORT_NAME", "PoseSlider", "page"]
