"""``report.html``: a run as one file that can be sent to somebody, made from what the run itself found.

Nothing in it leads outside: figures, film and script stand in the file. Every text is escaped by the template, what a
script reads is JSON in which no tag can end the script, and without scripts all of it can be read.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit import api
from cfmkit.errors import visible
from cfmkit.families import family
from cfmkit.metrics import split_name
from cfmkit.plots.figures import moving_of
from cfmkit.specs.units import format_short, to_border

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from matplotlib.figure import Figure

    from cfmkit.documents.run_outcome import Report
    from cfmkit.results import Quantity, Result

NAME = "report.html"

ENDS = {
    0: ("good", "all requirements are met"),
    4: ("bad", "there is no solution"),
    5: ("bad", "a requirement is missed"),
    6: ("warn", "solved in part"),
}
"""How a run ended, by its exit code: which colour the verdict has, and its words."""


@dataclass(frozen=True)
class MetricRow:
    """One row of the table of metrics, as text."""

    name: str
    branch: str
    value: str
    definition: str


def page(report: Report, drawn: Mapping[str, Figure], command: str = "") -> bytes:
    """Return the page of a run; the same report gives the same bytes.

    Parameters
    ----------
    report : Report
        Of any status.
    drawn : mapping of str to Figure
        The figures of the result, by their names: the first is the curve.
    command : str
        How the run was started, for whoever wants to repeat it.
    """
    from cfmkit.plots.vector_formats import inline, svg

    result = report.result
    record = family(result.spec.family)
    figures = {name: inline(svg(figure), identifier(name)) for name, figure in drawn.items()}
    tone, words = ENDS.get(int(report.exit_code), ("warn", "the run ended early"))
    if tone == "good" and not report.requirements:
        words = "solved; nothing was required"
    text: str = template("report.html.j2").render(
        title=result.spec.name,
        family=record.name,
        summary=record.summary,
        tone=tone,
        verdict=words,
        message=report.message,
        requirements=report.requirements,
        headline=[line for line in _lines(report.metrics) if _leads(report, line)],
        metrics=_lines(report.metrics),
        warnings=report.warnings,
        notes=report.supplement.lines,
        film=_film(result, drawn, figures),
        figures=figures,
        asked=api.dumps(result.spec),
        designed=bool(report.design and report.design.spec),
        resolved=api.dumps(api.resolve(result.spec), complete=True),
        command=command,
        **references_of(record.name),
        style=part("report.css"),
        script=part("report.js"),
    )
    return text.encode()


def template(name: str) -> Any:
    """Return a template of this folder."""
    from jinja2 import Environment

    # escaping is on for every expression; only what is marked safe in the template is markup, and all of it is ours
    plain = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_shown_in_page)
    return plain.from_string(part(name))


def _shown_in_page(value: Any) -> Any:
    """Return a text with its control characters escaped, line feeds and tabs aside; markup and numbers as they are."""
    return "\n".join(map(visible, value.split("\n"))) if type(value) is str else value


def part(name: str) -> str:
    """Return a file of this folder: a template, a style or a script."""
    return files("cfmkit.runs").joinpath(name).read_text(encoding="utf-8")


def identifier(name: str) -> str:
    """Return a name for parts of a page: letters, digits and ``-``."""
    return "".join(char if char.isalnum() and char.isascii() else "-" for char in name)


def _lines(metrics: Mapping[str, Quantity]) -> list[MetricRow]:
    """Return metrics as text; those without a value say why."""
    names = {name: split_name(name) for name in metrics}
    return [
        MetricRow(metric, branch or "", _value(metrics[name]), metrics[name].definition)
        for name, (metric, branch) in names.items()
    ]


def _leads(report: Report, line: MetricRow) -> bool:
    first = line.name in family(report.result.spec.family).leading and not line.branch
    return first and report.metrics[line.name].value is not None


def _value(quantity: Quantity) -> str:
    if quantity.word is not None:
        return quantity.word
    if quantity.value is None:
        return f"none: {quantity.reason}" if quantity.reason else "none"
    return format_short(quantity.value, quantity.dimension, 6)


@dataclass(frozen=True)
class Film:
    """The mechanism in motion beside its curve."""

    drawing: str  # SVG of all poses
    curve: str  # name of the figure that has the cursors
    data: str  # JSON for the script: texts and places of the cursors of each pose
    poses: int  # how many there are
    first: str  # what stands below the slider before it is moved


def _film(result: Result, drawn: Mapping[str, Figure], figures: dict[str, str]) -> Film | None:
    """Return the film of a result; None if its family has none. The figure beside it gets its cursors."""
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
    texts = [_moment(result, float(place)) for place in moving.motion]
    data = escaped_json({"texts": texts, "cursors": [xs for xs, _, _ in spots]})
    drawing = film(moving, f"{result.spec.family} mechanism to scale over its travel")
    return Film(drawing, name, data, len(texts), texts[0])


def _cursors(figure: Figure, motion: Any) -> Iterator[tuple[list[float], float, float]]:
    """Yield, for each panel over the motion: x of the cursor at every pose, and its lower and upper end [pt]."""
    height = figure.bbox.height / figure.dpi * 72.0
    for ax in figure.axes:
        box = ax.get_window_extent()
        scale = 72.0 / figure.dpi
        x = ax.transData.transform(np.column_stack([motion, np.zeros(len(motion))]))[:, 0]
        x = np.clip(x, box.x0, box.x1) * scale
        yield [round(float(one), 2) for one in x], round(height - box.y0 * scale, 2), round(height - box.y1 * scale, 2)


def _moment(result: Result, place: float) -> str:
    """Return the motion and the effort of every branch at one pose, in words."""
    curve = result.curve
    reported = [f"{curve.motion_name} {format_short(place, curve.motion_dimension)}"]
    for name in dict.fromkeys(curve.branches):
        on = curve.branch == name
        effort = _nearest(curve.motion[on], curve.effort[on], place)
        label = f"{curve.kind} on {name}" if len(set(curve.branches)) > 1 else curve.kind
        reported.append(f"{label} {format_short(effort, curve.kind)}" if np.isfinite(effort) else f"{label}: none")
    return ", ".join(reported)


def _nearest(motion: Any, effort: Any, place: float) -> float:
    """Return the effort at a motion, linear between points; NaN beyond them or where the curve folds back."""
    order = np.argsort(motion, kind="stable")
    if len(motion) < 2 or not np.all(np.diff(motion[order]) > 0):
        return float(effort[np.argmin(np.abs(motion - place))]) if len(motion) else np.nan
    return float(np.interp(place, motion[order], effort[order], left=np.nan, right=np.nan))


def references_of(name: str) -> dict[str, Any]:
    """Return what stands at the end of every page: the papers of a family, and the versions that computed."""
    from cfmkit._version import __version__
    from cfmkit.store.manifest import imported_versions

    record = family(name)
    versions = {"cfmkit": __version__, **imported_versions()}
    return {"references": record.references, "bibtex": record.bibtex, "versions": versions}


def escaped_json(data: Any) -> str:
    """Return JSON for a script of a page: no text in it can end the script."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
