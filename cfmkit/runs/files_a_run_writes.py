"""Files of a run.

`files` yields them, with curve, figures and geometry, by name below the output folder. Nothing here touches a disk, and
nothing depends on the time: the same result gives the same bytes.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cfmkit import api
from cfmkit.errors import GeometryError, SolutionError
from cfmkit.families import family
from cfmkit.plots.figure_options import DEFAULT_FORM, FigureForm
from cfmkit.plots.figures import moving_of
from cfmkit.results import PART_NOT_DRAWN, Finding
from cfmkit.runs.part_on_paper import part_on_paper
from cfmkit.tables.json_writing import json_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.documents.run_document import RunCommand
    from cfmkit.documents.run_outcome import Report
    from cfmkit.export.contours import Drawing
    from cfmkit.specs.spec import Spec


def files(
    report: Report,  # of any status: without a curve only what is known is written
    plots: bool = True,  # whether to draw figures
    page: bool = False,  # whether to write ``report.html``, which has the figures as well
    command: str = "",  # what the page says about how the run was started
    # how figures are written; default: as PNG, as they are drawn. The page has them as SVG
    form: FigureForm = DEFAULT_FORM,
    animate: str | None = None,  # whether to write the mechanism in motion beside its curve, where its family draws it
    started: RunCommand | None = None,  # which commands apply remedies, for the page
) -> Iterator[tuple[str, bytes]]:
    """Yield every file of a run as (name below the folder, content), each when it is needed."""
    result, designed = report.result, report.design.spec if report.design else None
    if designed is not None:
        yield "design.yaml", api.dumps(designed).encode()
    if curves := report.supplement.curves or result.curves:
        from cfmkit.tables import curve_table, to_csv

        yield "curve.csv", to_csv(curve_table(curves))
        for stem, table in result.tables.items():
            yield f"{stem}.csv", to_csv(table())
    yield "metrics.json", json_bytes(report.as_json())
    yield "resolved.yaml", api.dumps(api.resolve(result.spec), complete=True).encode()
    yield from sources(result.spec)
    drawing = part_of(result.spec) if designed is not None and result.status.usable else None
    if drawing is not None:
        yield from geometry(drawing)
    for name, make in report.supplement.files.items():
        yield name, make()
    makers = {**api.figures(result), **report.supplement.figures} if plots or page else {}
    if makers and drawing is not None:
        makers["drawing"] = partial(part_on_paper, drawing, result.spec)
    drawn = {stem: form.draw(make) for stem, make in makers.items()}
    for stem, figure in drawn.items() if plots else ():
        yield from form.write(figure, stem)
    if animate is not None and (moving := moving_of(family(result.spec.family), result)) is not None:
        from cfmkit.plots.animation import animation

        yield f"figures/motion.{animate}", animation(result, moving, animate)
    if page:
        from cfmkit.documents import html_of_run

        heading = "Input" if designed is None else "The design"
        every = ("Input with every default and derived value", api.dumps(api.resolve(result.spec), complete=True))
        texts = [(heading, api.dumps(result.spec)), every]
        yield (
            html_of_run.REPORT_NAME,
            html_of_run.page(report, form.select_page_figures(makers, drawn), command, texts, started),
        )


def sources(spec: Spec) -> Iterator[tuple[str, bytes]]:
    """Yield the data files that a specification names, under the same names: resolved.yaml names them, too."""
    from cfmkit.specs.data_file_paths import list_data_files

    for source in list_data_files(spec.model_dump()):
        yield str(source), source.path.read_bytes()


def part_of(spec: Spec) -> Drawing | None:
    """Return what is to be cut or printed; None if there is no part, or none that can be cut."""
    try:
        return _checked_part(spec)
    except (SolutionError, GeometryError):  # the analysis, or `warnings_of_part`, has a warning that says why
        return None


def warnings_of_part(spec: Spec) -> tuple[Finding, ...]:
    """Return what is wrong with the part as drawn, or why there is none."""
    try:
        drawing = _checked_part(spec)
    except SolutionError:  # the analysis has a warning
        return ()
    except GeometryError as problem:
        return (Finding(PART_NOT_DRAWN, str(problem)),)
    return () if drawing is None else drawing.warnings


def _checked_part(spec: Spec) -> Drawing | None:
    """Return the part of a family that has one; GeometryError where it cannot be cut as it is."""
    from cfmkit.export.arc_outlines import outlines

    if not family(spec.family).outline:
        return None
    drawing = api.drawing(spec)
    outlines(drawing)
    return drawing


def geometry(drawing: Drawing) -> Iterator[tuple[str, bytes]]:
    """Yield the files of what is to be cut or printed, below ``geometry/``."""
    from cfmkit.export import files as drawn

    for name, data in drawn(drawing).items():
        yield f"geometry/{name}", data
