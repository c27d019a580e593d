"""Command-line options: functions that declare them, sets that commands share, completion, and what values mean.

An option or argument is a field of the dataclass that a verb's `run` takes, called as the field unless it states names.
A shell completes verbs, options and files by itself; here are names of families, topics, and keys.
"""

from __future__ import annotations

from dataclasses import MISSING, dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import typer

from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.plots.figure_options import FigureForm


LARGEST_HEAD = 20_000
"""Characters of a file in which its family is looked for; a completion that reads more would be felt."""


def families(incomplete: str) -> list[str]:
    """Return the names of families that begin with the text typed so far."""
    from cfmkit.families import names

    return [name for name in names() if name.startswith(incomplete)]


def topics(incomplete: str) -> list[str]:
    """Return what `cfmkit show` explains and begins so: topics, families, and everything else that has a name."""
    from cfmkit.cli.show_topics import TOPIC_HEADINGS, names

    topics = [*TOPIC_HEADINGS, *families("")]
    # names by the hundred only once somebody has begun one
    every = [*topics, *names()] if incomplete else topics
    return list(dict.fromkeys(name for name in every if name.startswith(incomplete)))


def changes(ctx: Any, incomplete: str) -> list[str]:
    """Return what ``--set`` may begin with: keys of the family of the specification that was named, or of all.

    Items of lists are completed with the number of the first.
    """
    from cfmkit import families
    from cfmkit.specs.keys_and_schema import keys

    path, equals, _ = incomplete.partition("=")
    records = [families.family(name) for name in _families_named(ctx)]
    keys_by_path = {key.path.replace("[]", ".0"): key for record in records for key in keys(record.spec_type)}
    if equals:
        words = (
            keys_by_path[path].kind.split(" | ") if path in keys_by_path and " | " in keys_by_path[path].kind else []
        )
        return [f"{path}={word}" for word in words if f"{path}={word}".startswith(incomplete)]
    paths = [path for path in keys_by_path if path.startswith(incomplete) and keys_by_path[path].kind != "block"]
    # one level at a time would save no key press: names below a block are few
    return [f"{path}=" for path in paths]


def _families_named(ctx: Any) -> list[str]:
    """Return the family of the specification on the command line; all of them where there is none to be read."""
    from cfmkit import families

    named = [ctx.params.get("spec"), *(ctx.params.get("specs") or ())]
    choices = []
    for name in filter(None, named):
        try:
            with open(name, encoding="utf-8") as file:
                lines = file.read(LARGEST_HEAD).splitlines()
        except (OSError, UnicodeDecodeError):
            continue
        choices += [line.partition(":")[2].split("#")[0].strip() for line in lines if line.startswith("family:")]
    names = families.names()
    return [name for name in choices if name in names] or list(names)


MAX_INTEGER = 2**63 - 1
"""The largest integer of an option: what a signed integer of 64 bits in files and generators holds."""


def argument(
    metavar: str,  # its name in the help
    text: str,  # what it is
    complete: Callable[[str], list[str]] | None = None,  # what a shell completes it to
    default: Any = MISSING,  # without one it is required
) -> Any:
    """Return the field of an argument."""
    declare = partial(typer.Argument, metavar=metavar, help=text, show_default=False, autocompletion=complete)
    return field(default=default, metadata={"declare": declare})


def option(
    metavar: str | None,  # what the help calls the value
    text: str,  # what the help says
    *names: str,  # as the user writes it; default: ``--`` and the name of the field
    default: Any = None,  # `MISSING`: it is required
    shown: bool = False,  # whether the help shows the default
    # the smallest value. It is checked here and not by typer, whose help would show ``[0<=x<=...]``
    low: int | None = None,
    **more: Any,  # what else typer takes
) -> Any:
    """Return the field of an option that takes a value."""
    check = None if low is None else _require_at_least(low)
    declare = partial(typer.Option, metavar=metavar, help=text, show_default=shown, callback=check, **more)
    return field(default=default, metadata={"declare": declare, "names": names})


def flag(text: str, *names: str, default: bool | None = False) -> Any:
    """Return the field of an option that is there or not."""
    return field(default=default, metadata={"declare": partial(typer.Option, help=text), "names": names})


def _require_at_least(low: int) -> Callable[[int | None], int | None]:
    """Return a check that refuses numbers outside `low` ... `MAX_INTEGER`."""

    def check(value: int | None) -> int | None:
        if value is None or low <= value <= MAX_INTEGER:
            return value
        limit = f">= {low}" if value < low else f"<= {MAX_INTEGER}"
        raise typer.BadParameter(f"{value} is not allowed: must be {limit}")

    return check


OUT_OPTION = partial(option, "DIR", "Output folder; default: cfm-out/SPEC-VERB/.", "-o", "--out")
FIDELITY_OPTION = partial(option, "NAME", "Model to use; `cfmkit show FAMILY` lists the models under `fidelity`.")
SEED_OPTION = partial(option, "N", "Seed of all random numbers.", default=0, shown=True, low=0)
QUIET_FLAG = partial(flag, "Print only problems.", "-q", "--quiet")
NO_PLOTS_FLAG = partial(flag, "Draw no figures.")
JOBS_OPTION = partial(option, "N", "Processes; default: all cores.", "-j", "--jobs", low=1)
TIMEOUT_OPTION = partial(option, "S", "Stop the computation of a point after S seconds.")
NO_LOCK_FLAG = partial(flag, "Do not lock the output folder: no other run may use it (for file systems without locks).")
FRESH_FLAG = partial(flag, "Reuse no results of an earlier run.")
REPORT_FLAG = partial(flag, "Write report.html, too: everything in one file to share.")


@dataclass(frozen=True, kw_only=True)
class Common:
    """Options of every verb."""

    json: bool = flag("Print one JSON document instead of text, also on failure.")
    verbose: int = option(None, "Print more; -vv: tracebacks, too.", "-v", "--verbose", count=True, default=0)


@dataclass(frozen=True, kw_only=True)
class SpecOptions(Common):
    """Options of verbs that read specifications."""

    set: list[str] | None = option(
        "A.B=VALUE",
        "Replace a value of the spec, with its unit, e.g. --set design.force='60 N'. Repeatable. "
        """Put a key that itself has dots in double quotes: 'a."b.c"=1 mm'. """
        "With a family in front it applies only to specs of that family: cam:design.force='60 N'.",
        autocompletion=changes,
    )

    @property
    def changes(self) -> tuple[str, ...]:
        """Changes by ``--set``, in order."""
        return tuple(self.set or ())


@dataclass(frozen=True, kw_only=True)
class FigureChoice(Common):
    """Options of verbs that draw."""

    no_plots: bool = NO_PLOTS_FLAG()
    figures: str | None = option("png,svg,pdf", "Formats of the figures; default: png.")
    figure_width: str | None = option("84mm", "Printed width of the figures; the text keeps its size. Default: 160mm.")
    no_titles: bool = flag("Omit the titles of the figures.")
    plain: bool = flag("Figures for journals: no bands, notes, marks or titles.")
    figure_style: str | None = option("FILE", "Matplotlib style file (.mplstyle), applied over cfmkit's own.")

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
        stated = [name for name, value in said.items() if value is not None]
        if self.no_plots and stated and not getattr(self, "report", False):
            raise UsageError(f"--no-plots draws no figures and cannot be combined with {stated[0]}")
        return form_of(self.figures, self.figure_width, not self.no_titles, self.figure_style, self.plain, overlay)


@dataclass(frozen=True, kw_only=True)
class RunPictures(Common):
    """Options of verbs that draw one mechanism."""

    animate: Literal["gif", "mp4"] | None = option(
        None, "Write an animation of the mechanism beside its curve, figures/motion.gif; mp4 needs ffmpeg."
    )
    overlay: str | None = option("DIR", "Folder of an earlier design or analyze, whose curve is drawn as well.")


@dataclass(frozen=True, kw_only=True)
class OneSpec(SpecOptions):
    """Options of verbs that read one specification and write a folder."""

    spec: str = argument("SPEC", "YAML file of one mechanism; - reads standard input.")
    out: str | None = OUT_OPTION()
    no_lock: bool = NO_LOCK_FLAG()


@dataclass(frozen=True, kw_only=True)
class ComputeOptions(OneSpec, FigureChoice):
    """Options of verbs that compute."""

    fidelity: str | None = FIDELITY_OPTION()
    seed: int = SEED_OPTION()
    quiet: bool = QUIET_FLAG()


@dataclass(frozen=True, kw_only=True)
class StudyOptions(ComputeOptions):
    """Options of verbs that evaluate many points."""

    report: bool = REPORT_FLAG()
    table: str = option(
        "csv,parquet",
        "Formats of the table of points; results.csv is always written. Parquet needs cfmkit\\[table].",
        shown=True,
        default="csv",
    )
    jobs: int | None = JOBS_OPTION()
    cluster: str | None = option(
        "ADDRESS|local", "Dask scheduler to use, e.g. tcp://host:8786, or a local one. Needs cfmkit\\[cluster]."
    )
    max_points: int = option("N", "Refuse studies with more points.", shown=True, low=1, default=1_000_000)
    timeout_per_point: float | None = TIMEOUT_OPTION()
    fresh: bool = FRESH_FLAG()


@dataclass(frozen=True, kw_only=True)
class MeasurementOptions(Common):
    """Options of verbs that read a measurement."""

    units: str | None = option(
        "s=mm,F=N", "Units by column name or number, if the header states none; also selects columns."
    )
    tare: str | None = option(
        "FORCE",
        "Subtract this reading of the force sensor without load, e.g. '0.4 N'; 'start': the mean reading "
        "before the machine moves.",
    )
    zero: str | None = option(
        "LENGTH",
        "Subtract this reading of the displacement sensor at the mechanism's zero; 'start': the mean reading "
        "before the machine moves.",
    )
    flip: str | None = option(
        "NAMES", "Reverse the sign of force, displacement (or torque, angle), or of both, separated by a comma."
    )

    cycles: str | None = option(
        "FIRST:LAST", "Cycles to use, e.g. 2:5, or 3 for one; default: the complete ones of full travel."
    )
    group: str | None = option(
        "COLUMN",
        "Column that tells specimens apart; 'Specimen=2' chooses one, 'table=2' one of several tables, 'none' "
        "takes all rows as one specimen.",
    )

    @property
    def flips(self) -> tuple[str, ...]:
        """Columns that ``--flip`` names."""
        return tuple(word.strip() for word in self.flip.split(",")) if self.flip else ()


def folder_of(out: str | None, source: str, verb: str) -> str:
    """Return the folder that ``--out`` names, by default ``cfm-out/SOURCE-VERB``.

    UsageError if the name is empty, or the source is standard input and none is given.
    """
    from cfmkit.runs.specfile import STDIN_PATH

    if out is not None:
        if not out.strip():
            raise UsageError("--out is empty; give a folder")
        return out
    if source == STDIN_PATH:
        raise UsageError("standard input has no name; give the output folder with --out")
    return str(Path("cfm-out") / f"{Path(source).stem}-{verb}")


def data_record(name: str) -> dict[str, Any]:
    """Return what a manifest says about a data file: where it was, and the hash of its content."""
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
