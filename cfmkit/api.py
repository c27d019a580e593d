"""The functions of ``import cfmkit`` on one specification: load, write, check, analyze, design, evaluate, draw, export.

Everything is a value: nothing here prints or plots, and a disk is written to only where a folder is named.
"""

from __future__ import annotations

import os
import warnings
from typing import TYPE_CHECKING, Any

from cfmkit.arrays import Named
from cfmkit.errors import SpecError, UsageError
from cfmkit.families import family, origin
from cfmkit.families.run_control import Run
from cfmkit.specs.further_metrics import names_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from typing import TypeAlias

    from matplotlib.figure import Figure

    from cfmkit.errors import Problem
    from cfmkit.export.contours import Drawing
    from cfmkit.metrics import Window
    from cfmkit.results import Design, Result
    from cfmkit.runs.notebook_result import AnalysisView, Metrics
    from cfmkit.specs.spec import Spec

    AnySpec: TypeAlias = Spec | str | os.PathLike[str]
    Metric: TypeAlias = str | Callable[[Result], float | None]


def load(path: str | os.PathLike[str], changes: Iterable[str] = ()) -> Spec:
    """Return the specification in a YAML file.

    Parameters
    ----------
    path : path-like
        The file; ``-`` is standard input.
    changes : iterable of str
        Values that replace those of the file, as ``--set`` takes them: ``["mechanism.roller_radius=10 mm"]``.

    Raises
    ------
    cfmkit.errors.UsageError
        If the file cannot be read.
    cfmkit.errors.SpecError
        With every problem in it.

    Examples
    --------
    >>> import cfmkit
    >>> spec = cfmkit.load("configs/cam.yaml", ["mechanism.roller_radius=10 mm"])
    >>> spec.family, spec.mechanism.roller_radius
    ('cam', 0.01)
    """
    from cfmkit.runs.specfile import bind, read_spec

    return bind(read_spec(os.fspath(path), _as_changes(changes)))


def loads(text: str | bytes, source: str = "text") -> Spec:
    """Return the specification that a YAML text describes.

    Parameters
    ----------
    text : str or bytes
        The specification.
    source : str
        What messages call it.

    Raises
    ------
    cfmkit.errors.SpecError
        With every problem in it.

    Examples
    --------
    >>> import cfmkit
    >>> cfmkit.loads("cfmkit: 1\\nfamily: cam\\nmechanism: {brace_length: 200}", "mine.yaml")
    Traceback (most recent call last):
        ...
    cfmkit.errors.SpecError: mine.yaml:3:12: mechanism: the key ...
    """
    from cfmkit.runs.specfile import bind
    from cfmkit.specs.yamlio import read_document
    from cfmkit.specs.yamlio.base_file import with_base

    return bind(with_base(read_document(text, source)))


def dumps(spec: Spec, complete: bool = False) -> str:
    """Return a specification as YAML text that `loads` reads back to an equal one.

    Parameters
    ----------
    spec : Spec
        What to write.
    complete : bool
        Write every default too.

    Examples
    --------
    >>> import cfmkit
    >>> spec = cfmkit.load("configs/cam.yaml")
    >>> cfmkit.loads(cfmkit.dumps(spec)) == spec
    True
    """
    from cfmkit.specs.yamlio import dump

    return dump(spec, complete)


def spec_of(spec: AnySpec) -> Spec:
    """Return a specification, or the one in the file of that name.

    Raises
    ------
    cfmkit.errors.UsageError
        If it is neither, or the file cannot be read.
    cfmkit.errors.SpecError
        With every problem in the file.
    """
    from cfmkit.specs.spec import Spec

    return spec if isinstance(spec, Spec) else load(_path_of(spec))


def given_arguments(**keys: Any) -> dict[str, Any]:
    """Return the keyword arguments that were given: those that are not None."""
    return {key: value for key, value in keys.items() if value is not None}


def _result_of(result: Result | AnySpec) -> Result:
    """Return a result, or that of a specification."""
    from cfmkit.results import Result

    return result if isinstance(result, Result) else analyze(result)


def analyze(spec: AnySpec, run: Run | None = None) -> AnalysisView:
    """Return the curves of a mechanism, its scalar results and what is wrong with it.

    Parameters
    ----------
    spec : Spec or path-like
        Of any family, or its file.
    run : Run, optional
        Seed, progress report, time budget.

    Examples
    --------
    >>> import cfmkit
    >>> result = cfmkit.analyze("configs/cam.yaml")
    >>> result.status.key, len(result.curve.branches)
    ('complete', 2)
    >>> round(result.metrics["theoretical_force"].value, 4)
    50.0002
    """
    from cfmkit.metrics import warn_of_uncovered_windows
    from cfmkit.runs.notebook_result import AnalysisView

    spec = spec_of(spec)
    return AnalysisView.from_result(warn_of_uncovered_windows(family(spec.family).analyze(spec, run or Run())))


def design(spec: AnySpec, run: Run | None = None) -> Design:
    """Return a complete specification that meets the targets of the `design` block, or why there is none.

    With `design.yield` it has margins for the errors of its process, with `design.verify` it is corrected by its solid.

    Parameters
    ----------
    spec : Spec or path-like
        With a `design` block, or its file.
    run : Run, optional
        Seed, progress report, time budget. If a yield is requested, the search for the perfect part has half of the
        time, and that for its margins what is left.

    Raises
    ------
    cfmkit.errors.UsageError
        If the family has nothing to design.

    Examples
    --------
    >>> import cfmkit
    >>> found = cfmkit.design("configs/cam.yaml")
    >>> found.status.key, cfmkit.analyze(found.spec).status.key
    ('complete', 'complete')
    """
    spec = spec_of(spec)
    record = family(spec.family)
    if record.design is None:
        raise UsageError(f"{record.phrase} cannot be designed, only analysed")
    from cfmkit.studies.delivered_design import run_design

    return run_design(spec, record.design.make, run or Run())


def evaluate(
    result: Result | AnySpec,
    names: Iterable[Metric] | None = None,
    window: Window | str | tuple[float, float] | None = None,
) -> Metrics:
    """Return constant-force metrics and the family's own scalar results, by name, in SI.

    Parameters
    ----------
    result : Result, Spec or path-like
        Of any status; a specification is analysed.
    names : iterable of str or callable, optional
        Only these; ``[branch]`` picks a branch; functions of a `Result` are metrics, too (see `metric`). Default: all.
    window : Window or str or tuple of float, optional
        Where to measure: ``"40 mm:210 mm"``, or numbers [m or rad]; default: ``analysis.window``, else the full travel.

    Raises
    ------
    cfmkit.errors.UsageError
        If one of the names does not exist, or the window is malformed.

    Examples
    --------
    >>> import cfmkit
    >>> found = cfmkit.evaluate("configs/cam.yaml", ["force_ripple[load]"])
    >>> round(found["force_ripple[load]"].value, 4)
    0.0124
    """
    from cfmkit.families.base import with_own_metrics
    from cfmkit.metrics import evaluate as measured
    from cfmkit.metrics import values_of_family
    from cfmkit.runs.notebook_result import Metrics
    from cfmkit.runs.values_with_units import read_window

    chosen = None if names is None else tuple(names_of(names))  # registers functions, which are values of the result
    measurable = with_own_metrics(_result_of(result))
    over = read_window(window, measurable.curve.kind) if window is not None else None
    if chosen is None:
        return Metrics(measured(measurable, window=over))
    record = family(measurable.spec.family)
    measurable = record.with_envelope(measurable, chosen)
    return Metrics(measured(measurable, chosen, over, values_of_family(record.outputs.values)))


def check(spec: AnySpec, changes: Iterable[str] = ()) -> tuple[Problem, ...]:
    """Return what is wrong with a specification, as ``cfmkit check`` does; nothing is computed, and empty means valid.

    Whether a mechanism meets its requirements is what an analysis says: ``cfmkit.analyze(spec).requirements``.

    Parameters
    ----------
    spec : Spec or path-like
        A specification or its file.
    changes : iterable of str
        Values that replace those of the file, as `load` takes them.

    Raises
    ------
    cfmkit.errors.UsageError
        If the file cannot be read.

    Examples
    --------
    >>> import cfmkit
    >>> cfmkit.check("configs/cam.yaml")
    ()
    >>> [problem.path for problem in cfmkit.check("configs/cam.yaml", ["mechanism.roller_radius=16 kg"])]
    ['mechanism.roller_radius']
    """
    from cfmkit.runs.specfile import apply_options, bind, read_spec
    from cfmkit.specs.spec import Spec
    from cfmkit.specs.yamlio import read_document

    try:
        if isinstance(spec, Spec):
            bind(apply_options(read_document(dumps(spec), spec.name), _as_changes(changes)))
        else:
            bind(read_spec(os.fspath(_path_of(spec)), _as_changes(changes)))
    except SpecError as error:
        return error.problems
    return ()


def _as_changes(changes: Iterable[str]) -> Iterable[str]:
    return (changes,) if isinstance(changes, str) else changes


def _path_of(spec: Any) -> str | os.PathLike[str]:
    """Return the path of a specification's file.

    Raises
    ------
    cfmkit.errors.UsageError
        If it is no path; a result has its requirements with it.
    """
    if isinstance(spec, str | os.PathLike):
        return spec
    from cfmkit.results import Result

    hint = (
        "result.requirements says whether they are met"
        if isinstance(spec, Result)
        else "cfmkit.load reads a file, cfmkit.loads reads text"
    )
    raise UsageError(f"a specification or the path of its YAML file is needed, not {type(spec).__name__}; {hint}")


def export(
    spec: AnySpec,
    out: str | os.PathLike[str] | None = None,
    *,
    kerf: str | float | None = None,
    tolerance: str | float | None = None,
    format: str | Sequence[str] | None = None,
) -> dict[str, bytes]:
    """Return what is to be cut or printed as files, by name: DXF, SVG and CSV, and bodies where they are requested.

    Parameters
    ----------
    spec : Spec or path-like
        The mechanism as it is.
    out : path-like, optional
        A folder to write the files to, with a manifest, as the verb does.
    kerf : str or float, optional
        Width of the cut: a text with its unit, or a number [m]; adds a DXF moved by half of it.
    tolerance : str or float, optional
        Largest distance from the exact curves, likewise; default: 0.005 mm, of beams a 5000th of
        the smallest thickness.
    format : str or sequence of str, optional
        What to write, of dxf, svg, csv, stl, 3mf, step, inp, png and pdf: ``"stl,step"``; default: dxf, svg, csv. The
        last two are the dimensioned drawing that `design` makes, ``figures/drawing.png``.

    Warns
    -----
    UserWarning
        For each format beside dxf, svg and csv that cannot be made while others are.

    Raises
    ------
    cfmkit.errors.UsageError
        If the family has nothing to cut, a length is not above zero, a format is unknown or needs a missing library.
    cfmkit.errors.SolutionError
        If the mechanism cannot exist as described.
    cfmkit.errors.GeometryError
        If nothing says how thick the part is, and a format needs that.
    cfmkit.errors.OutputError
        If the folder cannot be written.

    Examples
    --------
    >>> import cfmkit
    >>> sorted(cfmkit.export("configs/cam.yaml"))[:3]
    ['cam-left.csv', 'cam-right.csv', 'cam.dxf']
    """
    from cfmkit.runs.exported_files import export_files

    spec = spec_of(spec)
    made, _, failed = export_files(spec, kerf, tolerance, format)
    for name, error in failed.items():
        warnings.warn(f"{name} is not made: {error}", stacklevel=2)
    drawn = Named(made)
    if out is not None:
        from cfmkit.store import RunFolder, stable_hash

        with RunFolder(os.fspath(out)) as folder:
            for name, content in drawn.items():
                folder.write(name, content)
            source = {"source": spec.name, "sha256": stable_hash(spec.model_dump(mode="json"))}
            package = {"family": computed} if (computed := origin(spec.family)) else {}
            about = {"command": "export", "arguments": [], "spec": source | package}
            ending = {"status": "partial", "exit_code": 6} if failed else {"status": "complete", "exit_code": 0}
            folder.commit({**about, **ending})
    return drawn


def resolve(spec: AnySpec) -> Spec:
    """Return the specification with every derived part written out."""
    spec = spec_of(spec)
    resolved: Spec = family(spec.family).resolve(spec)
    return resolved


def drawing(spec: AnySpec, tolerance: str | float | None = None) -> Drawing:
    """Return the outlines of the parts that can be cut or printed.

    Parameters
    ----------
    spec : Spec or path-like
        What to draw.
    tolerance : str or float, optional
        Largest distance of the outlines from the exact edges: a text with its unit, or a number [m]; default: 5 um.

    Raises
    ------
    cfmkit.errors.UsageError
        If the family has nothing to cut, or the distance is not above zero.
    cfmkit.errors.SolutionError
        If the mechanism cannot exist as described.

    Examples
    --------
    >>> import cfmkit
    >>> drawing = cfmkit.drawing("configs/cam.yaml")
    >>> drawing.name, len(drawing.contours) > 1
    ('cam', True)
    """
    from cfmkit.runs.exported_files import drawing_of
    from cfmkit.runs.values_with_units import read_length

    spec = spec_of(spec)
    return drawing_of(spec, family(spec.family), read_length(tolerance, "tolerance"))


def figures(result: Result | AnySpec) -> Mapping[str, Callable[[], Figure]]:
    """Return what draws each picture of a result, by name; of a family that draws none, the curve alone.

    Parameters
    ----------
    result : Result, Spec or path-like
        A specification is analysed.

    Examples
    --------
    >>> import cfmkit
    >>> pictures = cfmkit.figures("configs/cam.yaml")
    >>> sorted(pictures)[:2], len(pictures["loop"]().axes)
    (['assembly', 'contact'], 2)
    """
    from cfmkit.plots.figures import figures

    result = _result_of(result)
    return figures(family(result.spec.family), result)
