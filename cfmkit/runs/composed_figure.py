"""A figure of several panels from several runs: the file that says so, and what draws each panel."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import TYPE_CHECKING

from cfmkit import api
from cfmkit.errors import SolutionError, SpecError, UsageError, visible
from cfmkit.families.run_control import Run
from cfmkit.runs.specfile import read_spec

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from cfmkit.plots.composed_figure import DrawnPanel
    from cfmkit.specs.composed_figure import ComposedFigure, Panel
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.serial_and_cluster_executors import Executor

    Makers = Mapping[str, Callable[[], Figure]]


def read(name: str, changes: tuple[str, ...] = ()) -> ComposedFigure:
    """Return what a file of a composed figure says.

    Raises
    ------
    cfmkit.errors.UsageError
        If it cannot be read.
    cfmkit.errors.SpecError
        With every problem in it.
    """
    from cfmkit.specs.composed_figure import ComposedFigure

    return read_spec(name, changes).bind(ComposedFigure)


def panels(name: str, found: ComposedFigure, executor: Executor) -> list[DrawnPanel]:
    """Return what draws each panel of a figure; a run that several panels show is computed once.

    Parameters
    ----------
    name : str
        The file, which the runs are relative to.
    found : ComposedFigure
        What it says.
    executor : Executor
        What gets the points of sweeps done.

    Raises
    ------
    cfmkit.errors.CfmError
        If a run cannot be read or has no such picture; the place of the panel in the file is said.
    """
    from cfmkit.plots.composed_figure import DrawnPanel

    document = read_spec(name)
    known: dict[tuple[str, str | None], Makers] = {}
    drawn = []
    for number, panel in enumerate(found.panels):
        key = (panel.run, panel.verb)
        if key not in known:
            try:
                known[key] = makers(Path(name).parent / panel.run, panel, executor)
            except (UsageError, SolutionError) as error:
                raise SpecError([document.problem(f"panels.{number}.run", str(error))]) from None
        if panel.plot not in known[key]:
            reported = _no_such(panel.plot, known[key])
            raise SpecError([document.problem(f"panels.{number}.plot", reported)])
        drawn.append(DrawnPanel(known[key][panel.plot], panel.label))
    return drawn


def _no_such(plot: str, known: Makers) -> str:
    if not known:
        return f"this run has no picture {visible(plot)!r}: it has none at all"
    near = difflib.get_close_matches(plot, known, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else f": there are {', '.join(known)}"
    return f"this run has no picture {visible(plot)!r}{hint}"


def makers(place: Path, panel: Panel, executor: Executor) -> Makers:
    """Return what draws the pictures of a run, by name."""
    if place.is_dir():
        return _of_folder(place, panel)
    spec = api.load(str(place))
    verb = panel.verb or ("sweep" if spec.sweep is not None else "analyze")
    return _swept(spec, executor) if verb == "sweep" else _solved(spec, verb)


def _of_folder(place: Path, panel: Panel) -> Makers:
    """Return the pictures of a run from its folder: a mechanism is analysed again, a sweep drawn from its files."""
    import json

    try:
        command = json.loads((place / "manifest.json").read_bytes())["command"]
    except (OSError, ValueError, KeyError, TypeError):
        raise UsageError(f"{visible(str(place))} is not the folder of a run: it has no manifest.json") from None
    if command == "sweep" and panel.verb in (None, "sweep"):
        from cfmkit.studies.pictures import makers_of

        return makers_of(place, api.load(str(place / "resolved.yaml")))
    if command not in ("analyze", "design", "calibrate") or panel.verb not in (None, "analyze", command):
        raise UsageError(
            f"{visible(str(place))} holds a run of {visible(str(command))!r}; only runs of analyze, design, calibrate "
            "and sweep can be drawn from their folder, and only as the run that they are: name the specification "
            "instead"
        )
    return _solved(api.load(str(place / "resolved.yaml")), "analyze")


def _solved(spec: Spec, verb: str) -> Makers:
    if verb == "design":
        designed = api.design(spec, Run())
        if designed.spec is None:
            raise SolutionError(designed.explanation)
        spec = designed.spec
    return api.figures(api.analyze(spec))


def _swept(spec: Spec, executor: Executor) -> Makers:
    from cfmkit.studies.engine import run
    from cfmkit.studies.pictures import makers
    from cfmkit.studies.sweep_request_and_files import SweepRequest, outputs, prepare, summary_of

    records = run(prepare(spec, SweepRequest(pictures=True)), executor)
    summary = summary_of(records)
    for _name, content in outputs(records, summary):  # the summary is filled while the rows are written
        _ = content if isinstance(content, bytes) else [*content]
    return makers(records, summary)
