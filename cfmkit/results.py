"""Outcome of an analysis or a design as values: status, findings, scalars, curves, and protocols of closed forms.

A `Status` says how far the solver came; its value is the sentence the user reads. Whether the mechanism is any good is
not a status: that is what the requirements decide.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from cfmkit.arrays import LazyMapping, LazySequence, Named, Several, ShortRepr
from cfmkit.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.specs.evaluable_target_curve import TargetCurve
    from cfmkit.specs.spec import Spec
    from cfmkit.tables import Table


WINDOW_OUTSIDE = "window_outside"  # name of the finding that nothing was measured over a window
PART_NOT_DRAWN = "part_not_drawn"  # name of the finding that a design has no part that can be cut as it is
THIN_WALL = "thin_wall"  # name of the finding that a part is thinner somewhere than its process can make
OVERWRITTEN_FINDING = "overwritten"  # finding that a design replaces a value that was stated
ROUND_OFF = 1e-12
"""Error of a sum of efforts by formulas, in parts of the sum of their sizes: some thousand roundings, as places and
lengths that they are computed from are differences themselves."""


class Status(Enum):
    """End of a solve."""

    COMPLETE = "solved over the full travel"
    PARTIAL = "solved in part: the curve ends early, or some points failed"
    INFEASIBLE = "no design meets the targets within the stated limits"
    NO_EQUILIBRIUM = "no equilibrium: the mechanism cannot exist as described, or it is not supported"
    INVALID = "a value is invalid"
    TIMEOUT = "the time allowed for this point ran out"
    CRASHED = "the process that worked on this point died"

    @property
    def key(self) -> str:
        """The short name used in metrics.json and tables: ``complete``, ``partial``, ..."""
        return self.name.lower()

    @property
    def usable(self) -> bool:
        """Whether there is a curve to look at."""
        return self in (Status.COMPLETE, Status.PARTIAL)

    @property
    def exit_code(self) -> ExitCode:
        """The exit code of a run that ended so, before requirements are looked at."""
        codes = {
            Status.COMPLETE: ExitCode.OK,
            Status.PARTIAL: ExitCode.PARTIAL,
            Status.INVALID: ExitCode.INVALID,
            # Whether there is a solution is not known: more time may find it.
            Status.TIMEOUT: ExitCode.PARTIAL,
            Status.CRASHED: ExitCode.BUG,
        }
        return codes.get(self, ExitCode.NO_SOLUTION)


@dataclass(frozen=True, repr=False)
class Finding(ShortRepr):
    """Something about the mechanism that the user must know, by name.

    `name` is stable (scripts match it); `message` holds the numbers that decide and, where there is one, the cure.
    `cures` are changes of the specification that cure it, as ``--set`` takes them: ``design.avoid_undercut=true``;
    several that only work together are a tuple.
    """

    name: str
    message: str
    cures: tuple[str | tuple[str, ...], ...] = ()
    short: str = ""  # the consequence with its number, in one clause; empty: the first clauses of the message say it


@dataclass(frozen=True)
class Quantity:
    """A scalar result in SI with its dimension and definition; ``None`` where undefined, with the reason.

    One of the dimension ``text`` is a word: `value` is its index in `words`.
    """

    value: float | None
    dimension: str
    definition: str
    reason: str = ""
    words: tuple[str, ...] = ()

    def __str__(self) -> str:
        from cfmkit.specs.units import format_short

        if self.word is not None:
            return self.word
        return "None" if self.value is None else format_short(self.value, self.dimension)

    @property
    def word(self) -> str | None:
        """The word that the value stands for; None if it stands for none."""
        return None if self.value is None or not self.words else self.words[int(self.value)]


def quantities(definitions: Mapping[str, tuple[str, str]], numbers: Mapping[str, float | None]) -> dict[str, Quantity]:
    """Return scalar results by name, each with its dimension and definition.

    Examples
    --------
    >>> quantities({"rise": ("length", "height at the start")}, {"rise": 0.01})["rise"].definition
    'height at the start'
    """
    return {name: Quantity(value, *definitions[name]) for name, value in numbers.items()}


@dataclass(frozen=True)
class Searched:
    """A number that only a design search knows, with the model and the window that it is of."""

    quantity: Quantity  # its definition says in words of its own what it is: it never poses as a metric
    model: str  # the model that was solved, as ``analysis.fidelity`` names it
    # between which ends of the motion it holds [m or rad]; None if there is no window to it
    window: tuple[float, float] | None = None
    motion: str = "length"  # dimension of the window: "length" or "angle"


class ClosedForm(Protocol):
    """A model that gives the effort at every place, not at the samples of the curve only.

    Metrics that are places (``usable_stroke``, ``band_range_1pct``, ``range_95``) are solved on it, ends of a window
    between two samples are asked of it, and extremes are looked for between the samples next to them.
    """

    @property
    def places(self) -> FloatArray:
        """Increasing places over the motion, (n,), so dense that the effort hides nothing between two [m or rad]."""

    @property
    def peaks(self) -> FloatArray:
        """Places next to which an extreme of the effort may stand that the samples of a curve miss, (m,) [m or rad]."""

    def effort(self, branch: str, places: FloatArray, /) -> FloatArray:
        """Return the effort of a branch at places of any shape [N or N m]; NaN where there is no equilibrium."""

    def stress(self, branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress [Pa] at places of any shape; NaN where it is unbounded."""


@runtime_checkable
class LargestStress(Protocol):
    """A model that may find the largest stress in a window by itself, without the stress at every point."""

    def largest_stress(self, branch: str, low: float, high: float, /) -> float | None:
        """Return the largest stress of a branch between two places [Pa]; None: look for it at the points."""


@runtime_checkable
class OwnStress(Protocol):
    """A model of several load cases, whose `stress` is the largest of all of them: it knows that of the curve, too."""

    def own_stress(self, branch: str, places: FloatArray, /) -> FloatArray:
        """Return the largest stress [Pa] at places of any shape in the load case of the curve."""


class WindingPath(Protocol):
    """A path whose motion turns back, at every place of its way: what `ClosedForm` is of others."""

    @property
    def ways(self) -> FloatArray:
        """Increasing places of the way, (n,): neither motion nor effort nor stress turns between two of them."""

    def states(self, ways: FloatArray, /) -> tuple[FloatArray, FloatArray]:
        """Return motion [m or rad] and effort [N or N m] at places of the way of any shape."""

    def stress(self, ways: FloatArray, /) -> FloatArray:
        """Return the largest stress [Pa] at places of the way of any shape."""


@dataclass(frozen=True)
class Result:
    """The outcome of one analysis."""

    spec: Spec
    """The specification with every default and derived part written out."""
    status: Status
    """How far the solver came."""
    message: str = ""
    """One sentence on the outcome; the status's own sentence if nothing more is known."""
    curves: tuple[Curve, ...] = ()
    """All curves of the run, the nominal one first; empty if nothing was solved."""
    values: Mapping[str, Quantity] = field(default_factory=dict)
    """Scalar results that the family computes itself, by name; a `LazyMapping` computes them when they are read."""
    warnings: Sequence[Finding] = ()
    """What the user must know; warnings never change the exit code. A `LazySequence` composes them when they are
    read.
    """
    travel: tuple[float, float] | None = None
    """Where the motion was to start and to end [m or rad]: shares of the travel are of this. Default: the nominal
    curve, as far as it goes.
    """
    valid: tuple[tuple[float, float], ...] | None = None
    """Intervals of the motion [m or rad] in which the mechanism works as intended (for a cam: the roller runs on
    the flank). ``usable_stroke`` looks there only.
    """
    target: float | None = None
    """Force or torque that the curve should have [N or N m]."""
    target_curve: TargetCurve | None = None
    """What the curve should follow where it is not to be constant; default: the specification's own."""
    reference: float | None = None
    """Motion of the pose that the band ranges are measured around [m or rad]."""
    allowable_stress: float | None = None
    """What the column ``max_stress`` is compared with [Pa]."""
    stress_overrated: float = 0.0
    """By what share the model may overestimate the stress at most: so much above the allowable one is no finding."""
    load_cases: tuple[Curve, ...] = ()
    """Curves of the same mechanism under other loads or settings whose stress counts beside that of the nominal
    one, in ``stress_max``, ``safety_factor`` and ``usable_stroke``.
    """
    closed: ClosedForm | None = None
    """The nominal curve at every place, where the model is so cheap."""
    winding: WindingPath | None = None
    """The nominal curve at every place of its way, where its motion turns back; it has one branch."""
    ends: Curve | None = None
    """Points of the nominal curve beside its own: where windows end between two of these."""
    effort_error: float | None = None
    """Numerical error of the nominal curve's effort [N or N m]: rounding of the sum of what springs and members do
    where that is a formula (`ROUND_OFF`), the accuracy of the solver where it is solved for. Nothing is measured
    relative to an effort that is not above it. Default: 1e-12 of the largest effort.
    """
    part_efforts: Callable[[str, FloatArray], FloatArray] | None = None
    """``part_efforts(branch, places)``, the largest effort of one spring or member of the nominal curve at places
    of its motion, (n,) each [m or rad; N or N m]: that of a part is the derivative of its energy by the motion.
    """
    tables: Mapping[str, Callable[[], Table]] = field(default_factory=dict)
    """More files of a run, by stem: what makes the table of each, ``adjustability`` for adjustability.csv."""
    state: Any = None
    """What the family's drawing functions need; not part of the public interface."""

    def __post_init__(self) -> None:
        if not self.message:
            object.__setattr__(self, "message", self.status.value)
        for name in ("curves", "warnings", "load_cases"):
            if not isinstance(items := getattr(self, name), LazySequence):
                object.__setattr__(self, name, Several(items))
        if not isinstance(self.values, LazyMapping):
            object.__setattr__(self, "values", Named(self.values))

    def __repr__(self) -> str:
        about = f"{self.spec.family} {self.spec.name!r}, {self.status.key}"
        reported = [repr(curve) for curve in self.curves[:1]]
        reported += [f"{len(self.curves) - 1} more curves"] if len(self.curves) > 1 else []
        reported += [f"warnings: {', '.join(finding.name for finding in self.warnings[:10])}"] if self.warnings else []
        return f"<{type(self).__name__} of {'; '.join([about, *reported])}>"

    @property
    def curve(self) -> Curve:
        """The nominal curve.

        Raises
        ------
        cfmkit.errors.SolutionError
            If nothing was solved.
        """
        if not self.curves:
            from cfmkit.errors import SolutionError

            raise SolutionError(f"there is no curve: {self.message}")
        return self.curves[0]

    def to_pandas(self) -> Any:
        """Return the curves as one tidy `pandas.DataFrame` in border units (mm, N, ...)."""
        from cfmkit.tables import curve_table
        from cfmkit.tables.table import library

        return library("pandas", "to_pandas").DataFrame(dict(curve_table(self.curves).as_dict()))

    def to_xarray(self) -> Any:
        """Return the curves as an `xarray.Dataset` over the dimension ``point``, in border units, which it names."""
        import numpy as np

        from cfmkit.tables import curve_table
        from cfmkit.tables.table import library

        table = curve_table(self.curves)
        dataset = library("xarray", "to_xarray").Dataset()
        for column in table.columns:
            attributes = {} if column.unit is None else {"units": column.unit}
            dataset[column.name] = ("point", np.asarray(column.values), attributes)
        return dataset


@dataclass(frozen=True)
class Design:
    """The outcome of a design: a complete new specification, or why there is none.

    A design is never its own judge: its `spec` is analysed like any other.
    """

    spec: Spec | None
    """The new specification; None if there is no design."""
    status: Status
    """How the design ended."""
    message: str = ""
    """One sentence on that."""
    active_bounds: tuple[str, ...] = ()
    """What holds the design where it is."""
    nearest_feasible: Mapping[str, str] = field(default_factory=dict)
    """Where there is no design: path of the specification -> the nearest value for which there would be one."""
    warnings: tuple[Finding, ...] = ()
    """What the user must know."""
    search: Mapping[str, Searched] = field(default_factory=dict)
    """Values that only the search knows, by name: of its starts, of its audit, of parts that it has drawn."""
    notes: tuple[tuple[str, str], ...] = ()
    """Paragraphs of the page: the word that begins each, and the text."""
    tables: Mapping[str, Callable[[], Table]] = field(default_factory=dict)
    """Name of a CSV file without its ending -> what makes it."""
    next_best: tuple[Callable[[], Design], ...] = ()
    """What makes the designs with other bought springs, the best first: for who finds this one lacking."""

    def __post_init__(self) -> None:
        if not self.message:
            object.__setattr__(self, "message", self.status.value)

    def __repr__(self) -> str:
        return f"<Design {self.status.key}: {self.message[:500]}; {self.spec!r}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: how the design ended, what the search found, warnings, and the new file."""
        from html import escape

        reported = [f"<p>{escape(self.explanation)}</p>"]
        reported += [f"<p>{escape(word)}: {escape(text)}</p>" for word, text in self.notes]
        reported += [f"<p>{escape(finding.name)}: {escape(finding.message)}</p>" for finding in self.warnings]
        return "<div>" + "".join(reported) + ("" if self.spec is None else self.spec._repr_html_()) + "</div>"

    @property
    def explanation(self) -> str:
        """The message, with the keys that stand in the way of a design and the nearest values that do not."""
        if self.spec is not None or not self.nearest_feasible:
            return self.message
        nearest = ", ".join(f"{path}: {value}" for path, value in self.nearest_feasible.items())
        return f"{self.message}; nearest feasible: {nearest}"
