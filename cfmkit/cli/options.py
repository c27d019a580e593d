"""Command-line options: functions that declare one for typer, and the sets of options that several commands share.

An option or argument is a field of the dataclass that a verb's `run` takes: its type, `option`, `flag` or
`argument` with what the help says, and its default.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from cfmkit.cli import shell_completion
from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.plots.figure_options import FigureForm


MAX_INTEGER = 2**63 - 1
"""The largest integer of an option: what a signed integer of 64 bits in files and generators holds."""


def argument(metavar: str, text: str, completed: Callable[[str], list[str]] | None = None) -> Any:
    """Return the declaration of an argument: its name in the help, what it is, and what a shell completes it to."""
    return typer.Argument(metavar=metavar, help=text, show_default=False, autocompletion=completed)


def option(
    *names: str,  # as the user writes it
    # text, metavar: what the help says, and what it calls the value
    text: str,
    metavar: str | None = None,
    shown: bool = False,  # whether the help shows the default
    # the smallest value. It is checked here and not by typer, whose help would show ``[0<=x<=...]``
    low: int | None = None,
    **more: Any,  # what else typer takes
) -> Any:
    """Return the declaration of an option that takes a value."""
    check = None if low is None else _require_at_least(low)
    return typer.Option(*names, metavar=metavar, help=text, show_default=shown, callback=check, **more)


def _require_at_least(low: int) -> Callable[[int | None], int | None]:
    """Return a check that refuses numbers outside `low` ... `MAX_INTEGER`."""

    def check(value: int | None) -> int | None:
        if value is None or low <= value <= MAX_INTEGER:
            return value
        raise typer.BadParameter(
            f"{value} is not allowed: must be {f'>= {low}' if value < low else f'<= {MAX_INTEGER}'}"
        )

    return check


def flag(*names: str, text: str, hidden: bool = False) -> Any:
    """Return the declaration of an option that is there or not; a hidden one is refused with a reason."""
    return typer.Option(*names, help=text, hidden=hidden)


Out = Annotated[str | None, option("-o", "--out", metavar="DIR", text="Output folder; default: cfm-out/SPEC-VERB/.")]
Fidelity = Annotated[
    str | None,
    option("--fidelity", metavar="NAME", text="Model to use; `cfmkit show FAMILY` lists the models under `fidelity`."),
]
Seed = Annotated[int, option("--seed", metavar="N", shown=True, low=0, text="Seed of all random numbers.")]
Quiet = Annotated[bool, flag("-q", "--quiet", text="Print only problems.")]
NoPlots = Annotated[bool, flag("--no-plots", text="Draw no figures.")]
Jobs = Annotated[int | None, option("-j", "--jobs", metavar="N", low=1, text="Processes; default: all cores.")]
Timeout = Annotated[
    float | None, option("--timeout-per-point", metavar="S", text="Stop the computation of a point after S seconds.")
]
NoLock = Annotated[
    bool,
    flag("--no-lock", text="Do not lock the output folder: no other run may use it (for file systems without locks)."),
]
Fresh = Annotated[bool, flag("--fresh", text="Reuse no results of an earlier run.")]
Animate = Annotated[
    Literal["gif", "mp4"] | None,
    option(
        "--animate", text="Write an animation of the mechanism beside its curve, figures/motion.gif; mp4 needs ffmpeg."
    ),
]
WithReport = Annotated[bool, flag("--report", text="Write report.html, too: everything in one file to share.")]


@dataclass(frozen=True, kw_only=True)
class Common:
    """Options of every verb."""

    json: Annotated[bool, flag("--json", text="Print one JSON document instead of text, also on failure.")] = False
    verbose: Annotated[int, option("-v", "--verbose", count=True, text="Print more; -vv: tracebacks, too.")] = 0


@dataclass(frozen=True, kw_only=True)
class SpecOptions(Common):
    """Options of verbs that read specifications."""

    set: Annotated[
        list[str] | None,
        option(
            "--set",
            metavar="A.B=VALUE",
            text="Replace a value of the spec, with its unit, e.g. --set design.force='60 N'. Repeatable. "
            """Put a key that itself has dots in double quotes: 'a."b.c"=1 mm'. """
            "With a family in front it applies only to specs of that family: cam:design.force='60 N'.",
            autocompletion=shell_completion.changes,
        ),
    ] = None

    @property
    def changes(self) -> tuple[str, ...]:
        """Changes by ``--set``, in order."""
        return tuple(self.set or ())


@dataclass(frozen=True, kw_only=True)
class FigureChoice(Common):
    """Options of verbs that draw."""

    no_plots: NoPlots = False
    figures: Annotated[
        str | None, option("--figures", metavar="png,svg,pdf", text="Formats of the figures; default: png.")
    ] = None
    figure_width: Annotated[
        str | None,
        option(
            "--figure-width",
            metavar="84mm",
            text="Printed width of the figures; the text keeps its size. Default: 160mm.",
        ),
    ] = None
    no_titles: Annotated[bool, flag("--no-titles", text="Omit the titles of the figures.")] = False
    plain: Annotated[bool, flag("--plain", text="Figures for journals: no bands, notes, marks or titles.")] = False
    figure_style: Annotated[
        str | None,
        option("--figure-style", metavar="FILE", text="Matplotlib style file (.mplstyle), applied over cfmkit's own."),
    ] = None

    @property
    def form(self) -> FigureForm:
        """Form of the figures.

        Raises UsageError if an option is malformed, or figures are both described and refused.
        """
        from cfmkit.plots.figure_options import form_of

        overlay: str | None = getattr(self, "overlay", None)
        said = {
            "--figures": self.figures,
            "--figure-width": self.figure_width,
            "--figure-style": self.figure_style,
            "--overlay": overlay,
            "--no-titles": self.no_titles or None,
            "--plain": self.plain or None,
        }
        given = [name for name, value in said.items() if value is not None]
        if self.no_plots and given and not getattr(self, "report", False):
            raise UsageError(f"--no-plots draws no figures and cannot be combined with {given[0]}")
        return form_of(self.figures, self.figure_width, not self.no_titles, self.figure_style, self.plain, overlay)


Overlay = Annotated[
    str | None,
    option("--overlay", metavar="DIR", text="Folder of an earlier design or analyze, whose curve is drawn as well."),
]


@dataclass(frozen=True, kw_only=True)
class OneSpec(SpecOptions):
    """Options of verbs that read one specification and write a folder."""

    spec: Annotated[str, argument("SPEC", "YAML file of one mechanism; - reads standard input.")]
    out: Out = None
    no_lock: NoLock = False


@dataclass(frozen=True, kw_only=True)
class ComputeOptions(OneSpec, FigureChoice):
    """Options of verbs that compute."""

    fidelity: Fidelity = None
    seed: Seed = 0
    quiet: Quiet = False


@dataclass(frozen=True, kw_only=True)
class StudyOptions(ComputeOptions):
    """Options of verbs that evaluate many points."""

    report: WithReport = False
    table: Annotated[
        str,
        option(
            "--table",
            metavar="csv,parquet",
            shown=True,
            text="Formats of the table of points; results.csv is always written. Parquet needs cfmkit\\[table].",
        ),
    ] = "csv"
    jobs: Jobs = None
    cluster: Annotated[
        str | None,
        option(
            "--cluster",
            metavar="ADDRESS|local",
            text="Dask scheduler to use, e.g. tcp://host:8786, or a local one. Needs cfmkit\\[cluster].",
        ),
    ] = None
    max_points: Annotated[
        int, option("--max-points", metavar="N", shown=True, low=1, text="Refuse studies with more points.")
    ] = 1_000_000
    timeout_per_point: Timeout = None
    fresh: Fresh = False


@dataclass(frozen=True, kw_only=True)
class MeasurementOptions(Common):
    """Options of verbs that read a measurement."""

    units: Annotated[
        str | None,
        option(
            "--units",
            metavar="s=mm,F=N",
            text="Units by column name or number, if the header states none; also selects columns.",
        ),
    ] = None
    tare: Annotated[
        str | None,
        option(
            "--tare",
            metavar="FORCE",
            text="Subtract this reading of the force sensor without load, e.g. '0.4 N'; 'start': the mean reading "
            "before the machine moves.",
        ),
    ] = None
    zero: Annotated[
        str | None,
        option(
            "--zero",
            metavar="LENGTH",
            text="Subtract this reading of the displacement sensor at the mechanism's zero; 'start': the mean reading "
            "before the machine moves.",
        ),
    ] = None
    flip: Annotated[
        str | None,
        option(
            "--flip",
            metavar="NAMES",
            text="Reverse the sign of force, displacement (or torque, angle), or of both, separated by a comma.",
        ),
    ] = None

    cycles: Annotated[
        str | None,
        option(
            "--cycles",
            metavar="FIRST:LAST",
            text="Cycles to use, e.g. 2:5, or 3 for one; default: the complete ones of full travel.",
        ),
    ] = None
    group: Annotated[
        str | None,
        option(
            "--group",
            metavar="COLUMN",
            text="Column that tells specimens apart; 'Specimen=2' chooses one, 'table=2' one of several tables, 'none' "
            "takes all rows as one specimen.",
        ),
    ] = None

    @property
    def flips(self) -> tuple[str, ...]:
        """Columns that ``--flip`` names."""
        return tuple(word.strip() for word in self.flip.split(",")) if self.flip else ()


def data_record(name: str) -> dict[str, Any]:
    """Return what a manifest says about a data file: where it was, and the hash of its content."""
    from pathlib import Path

    from cfmkit.store import file_hash

    return {"data": {"source": name, "sha256": file_hash(Path(name).resolve())}}


def read_measured(name: str, options: MeasurementOptions) -> MeasuredCurves:
    """Return the measurement in a file, raw."""
    from cfmkit.experiment.curves_and_metrics_of_recording import read_measured as read

    return read(name, options.units, options.tare, options.zero, options.flips, options.cycles, options.group)


def refuse_without_data(options: MeasurementOptions) -> None:
    """Refuse options about a measurement where none is named.

    Raises UsageError naming the first of them.
    """
    for name, _ in given_measurement_options(options):
        raise UsageError(f"{name} applies to a measurement: name its file with --data")


def given_measurement_options(options: MeasurementOptions) -> list[tuple[str, str]]:
    """Return name and value of each option about a measurement that is given."""
    names = ("units", "tare", "zero", "flip", "cycles", "group")
    return [(f"--{name}", value) for name in names if (value := getattr(options, name)) is not None]


def seconds(text: str) -> float:
    """Return a time budget [s].

    Raises UsageError if it is no time above zero.
    """
    from cfmkit.families.run_control import read_time

    value = read_time(text, "--time-budget") or 0.0
    if not 0.0 < value < 1e6:
        raise UsageError(f"--time-budget: {text} is not allowed: must be > 0")
    return value
