"""The functions of ``import cfmkit``: from a specification to curves, designs, metrics and drawings.

Everything is a value: nothing here prints, plots or writes to a disk.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

from cfmkit.errors import UsageError
from cfmkit.families import family
from cfmkit.families.base import Run

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from matplotlib.figure import Figure

    from cfmkit.experiment.reading import Recording
    from cfmkit.experiment.report import MeasureReport
    from cfmkit.geometry import Drawing
    from cfmkit.metrics import Outcome, Window
    from cfmkit.results import Design, Quantity, Result
    from cfmkit.spec import Spec
    from cfmkit.studies.outcome import StudyResult


def load(path: str | os.PathLike[str], changes: Iterable[str] = ()) -> Spec:
    """Return the specification in a YAML file.

    Parameters
    ----------
    path : path-like
        The file; ``-`` is standard input.
    changes : iterable of str
        Values that replace those of the file, as ``--set`` takes them:
        ``["mechanism.roller_radius=10 mm"]``.

    Raises
    ------
    cfmkit.errors.UsageError
        If the file cannot be read.
    cfmkit.errors.SpecError
        With every problem in it.
    """
    from cfmkit.specfile import bind, read_spec

    return bind(read_spec(os.fspath(path), changes))


def loads(text: str | bytes, source: str = "text") -> Spec:
    """Return the specification that YAML text says.

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
    """
    from cfmkit.specfile import bind
    from cfmkit.yamlio import read_document

    return bind(read_document(text, source))


def dumps(spec: Spec, complete: bool = False) -> str:
    """Return a specification as YAML text that `loads` reads back to an equal one.

    Parameters
    ----------
    spec : Spec
        What to write.
    complete : bool
        Write every default too.
    """
    from cfmkit.yamlio import dump

    return dump(spec, complete)


def analyze(spec: Spec, run: Run | None = None) -> Result:
    """Return the curves of a mechanism, its scalar results and what is wrong with it.

    Parameters
    ----------
    spec : Spec
        Of any family.
    run : Run, optional
        Seed, progress report, time budget.

    Examples
    --------
    >>> import cfmkit
    >>> result = cfmkit.analyze(cfmkit.load("configs/cam.yaml"))
    >>> result.status.key, len(result.curve.branches)
    ('complete', 2)
    """
    from cfmkit.metrics import windows_judged

    return windows_judged(family(spec.family).analyze(spec, run or Run()))


def design(spec: Spec, run: Run | None = None) -> Design:
    """Return a complete specification that meets the targets of the `design` block, or why there is none.

    Raises
    ------
    cfmkit.errors.UsageError
        If the family has nothing to design.
    """
    record = family(spec.family)
    if record.design is None:
        raise UsageError(f"a {spec.family} mechanism cannot be designed, only analysed")
    return record.design(spec, run or Run())


def evaluate(result: Result, names: Iterable[str] | None = None, window: Window | None = None) -> dict[str, Quantity]:
    """Return constant-force metrics and the family's own scalar results, by name, in SI.

    Parameters
    ----------
    result : Result
        Of any status.
    names : iterable of str, optional
        Only these; ``[branch]`` picks a branch. Default: all.
    window : Window, optional
        Where to measure; default: ``analysis.window``, else the full travel.

    Raises
    ------
    cfmkit.errors.UsageError
        If one of the names does not exist.
    """
    from cfmkit.metrics import evaluate as measured

    return measured(result, names, window)


def check(result: Result) -> tuple[Outcome, ...]:
    """Return what became of each requirement of the specification."""
    from cfmkit.metrics import check as checked
    from cfmkit.metrics import values_of_family

    values = values_of_family(family(result.spec.family).values)
    return checked(result.spec.requirements, result, values)


def sweep(spec: Spec, jobs: int = 1, **block: Any) -> StudyResult:
    """Return a mechanism in many variants: one row a point, whatever becomes of it.

    Parameters
    ----------
    spec : Spec
        What is varied.
    jobs : int
        Processes.
    **block
        As in the specification's block `sweep`, which they replace: `vary` (path -> ``"start:stop:n"`` or a
        list), `combine`, `samples`, `metrics`, `design`, `curves`; and `seed`. Without them the block counts.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is nothing to vary, too much, or a metric that does not exist.
    cfmkit.errors.SpecError
        If a path or value is wrong.

    Examples
    --------
    >>> import cfmkit
    >>> spec = cfmkit.load("configs/cam.yaml")
    >>> vary = {"mechanism.springs.stiffness": ["0.5 N/mm", "1 N/mm"]}
    >>> cfmkit.sweep(spec, vary=vary, metrics=["theoretical_force"]).table["theoretical_force"].tolist()
    [36.232, 72.464]
    """
    from cfmkit.studies.outcome import swept

    return swept(spec, jobs, block)


def sensitivity(spec: Spec, jobs: int = 1, **block: Any) -> StudyResult:
    """Return which value matters most, or how many made parts will meet the requirements.

    Parameters
    ----------
    spec : Spec
        What is varied.
    jobs : int
        Processes.
    **block
        As in the specification's block `sensitivity`, whose values they replace: `method`, `parameters`,
        `samples`, `metrics`, `on_failure`, `seed`, ...

    Raises
    ------
    cfmkit.errors.UsageError
        If there is nothing to vary, too much, or a metric that does not exist.
    cfmkit.errors.SpecError
        If a path or value is wrong.
    cfmkit.errors.SolutionError
        If the specification itself has no solution.

    Examples
    --------
    >>> import cfmkit
    >>> spec = cfmkit.load("configs/cam.yaml")
    >>> parameters = {"mechanism.springs.stiffness": {"normal": "1 %"}}
    >>> found = cfmkit.sensitivity(spec, method="tolerance", samples=20, parameters=parameters)
    >>> found.summary["yield"]["value"]
    0.8
    """
    from cfmkit.studies.outcome import examined

    return examined(spec, jobs, block)


def measure(
    data: str | os.PathLike[str] | Recording,
    *,
    units: str | None = None,
    window: str | tuple[float, float] | None = None,
    filter: str = "default",
    target: str | float | None = None,
    tare: str | float | None = None,
    zero: str | float | None = None,
    flip: Iterable[str] = (),
    as_recorded: bool = False,
    one_branch: bool = False,
) -> MeasureReport:
    """Return what a measured force curve says: branches, metrics raw and filtered, hysteresis, repeatability.

    Parameters
    ----------
    data : path-like or Recording
        A lab file with displacement and force, or angle and torque, perhaps time; or the arrays themselves.
    units : str, optional
        Units that the header does not name: ``"s=mm,F=N"``.
    window : str or (float, float), optional
        Where to measure: ``"40 mm:210 mm"``, or numbers in m or rad. Default: all that every branch covers.
    filter : str
        Low-pass of each branch: ``"2 Hz"``, ``"0.24 1/mm, order 3"``, ``"2 Hz, corrected"`` or ``"none"``.
    target : str or float, optional
        Force [N] or torque [N m] that it should have.
    tare, zero : str or float, optional
        What the sensors show without load [N or N m] and at the mechanism's zero [m or rad]; ``"start"``: at first.
    flip : iterable of str
        ``"force"``, ``"displacement"``, ``"torque"``, ``"angle"``: what is recorded with the other sign.
    as_recorded : bool
        Leave out neither spikes nor points next to reversals.
    one_branch : bool
        Accept a recording that has no way back.

    Raises
    ------
    cfmkit.errors.UsageError
        If the file cannot be read, or an option is malformed.
    cfmkit.errors.DataError
        If it holds no curve, or the window was not measured.

    Examples
    --------
    >>> import cfmkit
    >>> found = cfmkit.measure("configs/synthetic/cam_loop.csv", window="40 mm:120 mm", filter="2 Hz")
    >>> round(found.numbers.filtered["force_mean[load]"].value, 2)
    50.46
    """
    from cfmkit.experiment.corrections import corrected
    from cfmkit.experiment.filtering import read_filter
    from cfmkit.experiment.measured import LEFT_OUT, measured, require_loop
    from cfmkit.experiment.options import read_target, read_window
    from cfmkit.experiment.reading import Recording, read_recording
    from cfmkit.experiment.report import report_on
    from cfmkit.metrics import Frame

    low_pass = filter if filter == "default" else read_filter(filter)
    recording = data if isinstance(data, Recording) else read_recording(data, units)
    place = read_window(window, recording.kind)
    frame = Frame(target=read_target(target, recording.kind))
    recording = corrected(recording, tare, zero, tuple(flip))
    source = measured(recording, low_pass, () if as_recorded else LEFT_OUT)
    if not one_branch:
        require_loop(source)
    return report_on(source, frame, place)


def resolve(spec: Spec) -> Spec:
    """Return the specification with every derived part written out."""
    record = family(spec.family)
    resolved: Spec = record.resolve(spec) if record.resolve else spec
    return resolved


def drawing(spec: Spec, tolerance: float | None = None) -> Drawing:
    """Return the outlines of the parts that can be cut or printed.

    Parameters
    ----------
    spec : Spec
        What to draw.
    tolerance : float, optional
        Largest distance of the outlines from the exact edges [m]; default: 5 um.

    Raises
    ------
    cfmkit.errors.UsageError
        If the family has nothing to cut.
    cfmkit.errors.SolutionError
        If the mechanism cannot exist as described.
    """
    record = family(spec.family)
    if record.outline is None:
        raise UsageError(f"a {spec.family} mechanism has no part to draw")
    given = () if tolerance is None else (tolerance,)
    drawn: Drawing = import_module(record.outline).drawing(spec, *given)
    return drawn


def figures(result: Result) -> Mapping[str, Callable[[], Figure]]:
    """Return what draws each picture of a result, by name; of a family that draws none, the curve alone."""
    from cfmkit.plots import render

    return render.figures(family(result.spec.family), result)
