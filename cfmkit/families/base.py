"""Interface of a family of mechanisms (`Family`, a record of functions), and the box in space that one needs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Protocol

from cfmkit.arrays import LazyMapping
from cfmkit.errors import CfmError, UsageError
from cfmkit.families.findings import join_tables
from cfmkit.families.run_control import Run  # noqa: TC001  packages of other families may import it from here
from cfmkit.results import OVERWRITTEN_FINDING, PART_NOT_DRAWN, THIN_WALL, WINDOW_OUTSIDE, Quantity
from cfmkit.specs.further_metrics import own_metrics

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
    from importlib.resources.abc import Traversable

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cfmkit.arrays import FloatArray
    from cfmkit.export.beam_deck_for_abaqus import DrivenNetwork
    from cfmkit.export.contours import Drawing
    from cfmkit.export.posed_part import PosedPart
    from cfmkit.families.papers import Paper
    from cfmkit.families.proposals import FamilyOffer, Request
    from cfmkit.families.rows import SolvedRows
    from cfmkit.metrics import Outcome
    from cfmkit.plots.mechanism_in_motion import Moving
    from cfmkit.results import Design, Result
    from cfmkit.solid.adaptive_solution import DrivenPart
    from cfmkit.specs.further_metrics import OwnMetric
    from cfmkit.specs.spec import Spec


@dataclass(frozen=True)
class Sampled:
    """Effort and stress of one part at p places of its motion."""

    effort: Mapping[str, FloatArray]  # branch -> force [N] or torque [N m]
    # (s, p) stresses of s parts of the mechanism, or the largest alone [Pa]; s = 0 where there is none
    stress: FloatArray
    # dotted path of a value -> exact derivatives of both by it, per SI unit of the value; of values that were asked
    # for, those whose derivatives are known
    slopes: Mapping[str, Sampled] = field(default_factory=dict)


@dataclass(frozen=True)
class MeasuredLoop:
    """Both branches of a measured loop at the same places."""

    places: FloatArray  # (n,) displacement [m] or angle [rad], increasing, where the model exists
    # up, down, (n,): force [N] or torque [N m] on the way up and on the way back, mean of all cycles
    up: FloatArray
    down: FloatArray


INTERFACE_VERSION = 1  # number of this record: changes when a family that was written for it would no longer work


class Analyzer(Protocol):
    """One way to compute a mechanism."""

    def __call__(self, spec: Any, run: Run, /) -> Result:
        """Return the curves of a mechanism, its scalar results and what is wrong with it."""


class Sampler(Protocol):
    """Effort and stress of a part at a few places."""

    def __call__(self, spec: Any, places: FloatArray, paths: Sequence[str] = (), /) -> Sampled | None:
        """Return them at places [m or rad], with slopes by the values at some paths; None if that is not possible."""


class Outliner(Protocol):
    """The drawing of what is cut."""

    def __call__(self, spec: Any, tolerance: float = ..., /) -> Drawing:
        """Return contours; edges that are not `Smooth` lie within the tolerance [m] of the exact ones."""


_VOWEL_SOUND_LETTERS = "aefhilmnorsx"  # letters whose names begin with a vowel


def article(word: str) -> str:
    """Return ``a`` or ``an``, as a word is spoken: one letter or one without vowels is spelt out.

    Examples
    --------
    >>> [article(word) for word in ("cam", "oblique", "vcfm", "s-curve", "u-spring", "unit", "rhs")]
    ['a', 'an', 'a', 'an', 'a', 'a', 'an']
    """
    first = word.lower().partition("-")[0]
    if len(first) == 1 or not set(first) & set("aeiouy"):
        return "an" if first[:1] in tuple(_VOWEL_SOUND_LETTERS) else "a"
    if first.startswith(("uni", "use", "usu", "eu", "one")):
        return "a"
    return "an" if first[0] in "aeiou" else "a"


SHARED_FINDINGS = {
    WINDOW_OUTSIDE: "a window extends beyond the curve: metrics over it have no value",
    PART_NOT_DRAWN: "the designed part cannot be cut as it is: no drawing is written",
    THIN_WALL: "the part as drawn has walls that are thinner than its process can make",
    OVERWRITTEN_FINDING: "the design replaces a stated value with its own",
}
"""Findings that are made of any family's result or design."""


@dataclass(frozen=True)
class BoundingBox:
    """The box that a mechanism stays in over all of its travel, with everything that is drawn of it."""

    # across, along: in the plane, across and along the direction of travel [m]
    across: float
    along: float
    depth: float | None  # out of the plane [m]; None if nothing is known of it
    parts: int  # separate pieces that the mechanism is put together from, bought ones included
    assumed: str  # what of it no value of the specification says, in one clause; empty if all of it does
    corner: tuple[float, float]  # its lower left corner in the drawings of the mechanism [m]
    sideways: bool  # whether the travel is along x in the drawings, or nearly, not along y
    drawn: tuple[float, float]  # width and height of the box along x and y of the drawings [m]
    faults: tuple[str, ...] = ()  # parts that do not bear their loads, or cannot be made, each in a sentence

    @classmethod
    def from_part(cls, part: PosedPart) -> BoundingBox:
        """Return the box around a mechanism over its motion, along its travel and along x and y."""
        from cfmkit.export.posed_part import box

        across, along = (end - start for start, end in box(part.bodies, part.direction).T.tolist())
        low, high = box(part.bodies).tolist()
        sideways = abs(math.cos(part.direction)) > abs(math.sin(part.direction))
        drawn = (high[0] - low[0], high[1] - low[1])
        return cls(across, along, part.depth, part.pieces, part.assumed, (low[0], low[1]), sideways, drawn, part.faults)

    @property
    def sides(self) -> tuple[float, float, float | None]:
        """Sizes along x and y of the drawings, and out of their plane [m]."""
        return *self.drawn, self.depth


ENVELOPE_METRICS = {
    "envelope_x": ("length", "width of the box that everything stays in over the travel, along x of the drawings"),
    "envelope_y": ("length", "height of the same box, along y of the drawings"),
    "envelope_z": ("length", "depth of the same box, out of the plane, springs included"),
}
"""Scalar results of every family that knows its box; computed where a requirement, or a study, names one of them."""


@dataclass(frozen=True)
class ResultNames:
    """Everything that a result of a family may name."""

    # the family's own scalar results beside the metrics of the contract: name -> (dimension, definition)
    values: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    # for values of the dimension ``text``: name -> the words that the value is an index into
    words: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    # what `attribution` says of a measured loop: name -> (dimension, definition)
    causes: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    # every warning or failure name the family can report, with its meaning
    findings: Mapping[str, str] = field(default_factory=dict)
    headline: tuple[str, ...] = ()  # values and metrics that are shown first after a run, in this order
    branches: tuple[str, ...] = ()  # every name that a branch of its curves may have; none where the curve decides


@dataclass(frozen=True)
class DesignMethod:
    """From targets to a specification, with what its search says that no analysis of that specification can have."""

    make: Callable[[Any, Run], Design]  # ``make(spec, run)``: the `spec` of its design is analysed like any other
    levels: tuple[str, ...] = ()  # dotted paths of the forces that the `design` block may ask for
    findings: tuple[str, ...] = ()  # names of findings about the search
    tables: tuple[str, ...] = ()  # names of tables about it, as ``starts.csv``


@dataclass(frozen=True)
class Pictures:
    """Pictures of a result."""

    figures: Callable[[Result], Mapping[str, Callable[[], Figure]]]  # file stem -> what draws it
    moving: Callable[[Result], Moving | None] | None = None  # the mechanism in motion, for films


@dataclass(frozen=True)
class ElasticParts:
    """Parts of a mechanism that bend, for decks of finite-element solvers."""

    solids: Callable[[Any], tuple[DrivenPart, ...]]  # of a specification: the parts as planar solids
    beams: Callable[[Any], tuple[DrivenNetwork, ...]]  # the same parts as networks of beams


def leave_as_it_is(spec: Any) -> Any:
    """Return a specification, of which no part is derived."""
    return spec


def no_values(*_specs: Any) -> dict[str, Any]:
    """Return that no value of a specification is known to move or to err."""
    return {}


@dataclass(frozen=True)
class Family:
    """One family of mechanisms, as the registry knows it.

    Functions of slow modules are imported with `cfmkit.families.deferred_imports`.
    """

    # name, summary: as written in ``family:`` of a spec, and one line on what it is
    name: str
    summary: str
    spec_type: type[Spec]  # what the YAML may say
    # what `analysis.fidelity` may say, the coarsest first and the finest last, and the model that it picks:
    # ``model(spec, run) -> Result``. A family with one model gives it a name, too
    models: Mapping[str, Analyzer]
    outputs: ResultNames = field(default_factory=ResultNames)
    # folder of a package, ``"package/folder"``, with files of fixed names, each optional: `template.yaml`, which
    # ``cfmkit new`` starts from; `references.bib`, the papers; `dimensions.svg`, the mechanism with its dimensions and
    # their keys named, also as PNG and PDF
    folder: str = ""
    resolve: Callable[[Any], Any] = leave_as_it_is  # ``resolve(spec) -> spec`` with every derived part written out
    design: DesignMethod | None = None
    # ``rows(variants) -> iterator of (indices, SolvedRows)``: the mechanisms of closed form, those of one kind together
    # (`cfmkit.families.rows`)
    rows: Callable[[Any], Iterator[tuple[NDArray[Any], SolvedRows[Any]]]] | None = None
    # ``gradient(spec, paths) -> {metric: {path: derivative}}``: exact derivatives [SI] of those metrics (over the
    # window of the analysis) and paths that the family knows; `local` asks for it
    gradient: Callable[[Any, Sequence[str]], Any] | None = None
    # ``sample(spec, places, paths)``: effort and stress at a few places [m or rad], faster than the analysis and equal
    # to it, with exact derivatives where paths are given; None if it cannot. Searches over many parts ask for it
    sample: Sampler | None = None
    # ``free(spec, designed) -> {path: (low, high)}``: which values of a designed specification may move, and in which
    # ranges [SI], as its `design` block says it for the design itself
    free: Callable[[Any, Any], Mapping[str, tuple[float, float]]] = no_values
    # ``errors(spec) -> {path: "thickness", "position", "rate" or "friction"}``: which values of a part err, and in
    # what: by the process that makes it, as the rate of a spring, or as a coefficient of friction
    errors: Callable[[Any], Mapping[str, str]] = no_values
    # ``attribution(result, loop)``: what a measured loop says about the causes of its departure from the model
    attribution: Callable[[Result, MeasuredLoop], Mapping[str, Quantity]] | None = None
    draw: Pictures | None = None
    outline: Outliner | None = None
    elastic: ElasticParts | None = None
    # ``propose(request, run)``: what the family could do with a request, by scaling laws
    propose: Callable[[Request, Run], FamilyOffer] | None = None
    # ``part(result)``: where the material of a solved mechanism is in its poses; its box follows. None where that is
    # not known
    part: Callable[[Result], PosedPart | None] | None = None
    interface: int | None = (
        None  # the `INTERFACE_VERSION` that a family of another package was written for, as a plain number
    )

    def __post_init__(self) -> None:
        """Add the findings that every family has, and the values of those that know their box."""
        size = ENVELOPE_METRICS if self.part else {}
        outputs = self.outputs
        values = join_tables("value", outputs.values, size)
        findings = join_tables("finding", outputs.findings, SHARED_FINDINGS)
        outputs = replace(outputs, values=values, findings=findings)
        object.__setattr__(self, "outputs", outputs)

    def file(self, name: str) -> Traversable | None:
        """Return a file in the family's folder; None if there is none of this name."""
        from importlib.resources import files

        package, _, path = self.folder.partition("/")
        file = files(package).joinpath(path, name) if package else None
        return file if file is not None and file.is_file() else None

    def read(self, name: str) -> str:
        """Return the text of a file in the family's folder; empty if there is none of this name."""
        file = self.file(name)
        return "" if file is None else file.read_text(encoding="utf-8")

    @property
    def bibtex(self) -> str:
        """The papers as BibTeX; empty where there is no file of them."""
        return self.read("references.bib")

    @property
    def papers(self) -> tuple[Paper, ...]:
        """The papers, each with its reference in one line."""
        from cfmkit.families.papers import read_papers

        return read_papers(self.bibtex)

    @property
    def phrase(self) -> str:
        """The mechanism with its article: ``a cam mechanism``."""
        return f"{article(self.name)} {self.name} mechanism"

    def model_of(self, spec: Spec) -> Analyzer:
        """Return the model that a specification picks, or else the only one."""
        (only, *_) = self.models
        return self.models[spec.fidelity or only]

    def analyze(self, spec: Spec, run: Run) -> Result:
        """Return the result of the model that a specification picks, with the user's metrics and, if asked, its box."""
        result = with_own_metrics(self.model_of(spec)(spec, run))
        return self.with_envelope(result, {requirement.metric for requirement in spec.requirements})

    def with_envelope(self, result: Result, names: Collection[str]) -> Result:
        """Return a result with the sizes of its box among its values, if one of some names asks for them."""
        if ENVELOPE_METRICS.keys().isdisjoint(names) or not self.part:
            return result
        return add_size(result, self.envelope(result))

    def check(self, result: Result) -> tuple[Outcome, ...]:
        """Return the outcome of each requirement of its specification on a result, but those on many parts."""
        from cfmkit.metrics import check, values_of_family

        return check(result.spec.part_requirements, result, values_of_family(self.outputs.values))

    def envelope(self, result: Result) -> BoundingBox | None:
        """Return the box that a solved mechanism stays in; None if it is not known."""
        part = self.part(result) if self.part else None
        return None if part is None else BoundingBox.from_part(part)


def with_own_metrics(result: Result) -> Result:
    """Return a result with the metrics of the user among its values, each computed when it is read."""
    metrics = own_metrics()
    if not metrics:
        return result

    def compute(name: str) -> Quantity:
        return _own_quantity(metrics[name], result) if name in metrics else result.values[name]

    return replace(result, values=LazyMapping((*result.values, *metrics), compute))


def _own_quantity(metric: OwnMetric, result: Result) -> Quantity:
    """Return what a function of the user makes of a result.

    Raises UsageError if the function fails, or returns something else than a number.
    """
    about = metric.dimension, metric.definition
    if not result.curves:
        return Quantity(None, *about, reason=result.message)
    try:
        value = metric.function(result)
        number = math.nan if value is None else float(value)
    except CfmError as error:
        return Quantity(None, *about, reason=str(error))
    except Exception as error:
        reported = " ".join(f"{type(error).__name__}: {error}".split())
        raise UsageError(f"the metric {metric.name!r} failed: {reported}") from error
    return Quantity(number, *about) if math.isfinite(number) else Quantity(None, *about, reason="it is not finite")


def add_size(result: Result, space: BoundingBox | None) -> Result:
    """Return a result with the sizes of its box among its values; without a value where the box is not known."""
    sides = (None, None, None) if space is None else space.sides
    reason = (space.assumed if space else "") or "the box is not known"
    quantities = {
        name: Quantity(value, *about, "" if value is not None else reason)
        for (name, about), value in zip(ENVELOPE_METRICS.items(), sides, strict=True)
    }
    return replace(result, values=result.values | quantities)  # type: ignore[operator]
