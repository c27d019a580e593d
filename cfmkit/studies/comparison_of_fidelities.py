"""One mechanism by every model that its family has: the curves, and how far each is from the finest one.

The models are those of the family's record, which `analysis.fidelity` names, the coarsest first and the finest last. A
choice that the specification has no data for is left out; a curve that fails keeps its status.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from cfmkit.errors import CfmError, Problem, SpecError, UsageError
from cfmkit.families import family
from cfmkit.metrics import warn_of_uncovered_windows, window_of
from cfmkit.metrics.branches import span_text
from cfmkit.metrics.compare import N_COMPARED_PLACES, ComparedSide, largest, mean, rms
from cfmkit.metrics.compare import compare as compare_sides
from cfmkit.results import Finding, Status

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.curves import Curve, Kind
    from cfmkit.families.run_control import Run
    from cfmkit.metrics.compare import Differences, Measure
    from cfmkit.results import Quantity, Result
    from cfmkit.specs.spec import Spec

FIDELITY_KEY = "analysis.fidelity"
FIDELITY_OPTION = "--compare-fidelity"


@dataclass(frozen=True)
class Choices:
    """The models that a specification can be run by."""

    names: tuple[str, ...]  # all of the family, the finest last
    specs: Mapping[str, Spec]  # the specification for each of those that can run
    obstacles: Mapping[str, str]  # why each of the others cannot


@dataclass(frozen=True)
class Variant:
    """The outcome of one model, by the name of its fidelity."""

    name: str
    result: Result

    @property
    def curves(self) -> tuple[Curve, ...]:
        """Its curves, each labelled with the fidelity."""
        named = {"fidelity": (self.name, "text")}
        return tuple(replace(curve, label=named | dict(curve.label)) for curve in self.result.curves)


@dataclass(frozen=True)
class FidelityComparison:
    """The outcomes of several models of one mechanism."""

    variants: tuple[Variant, ...]  # the nominal one first, then the others from coarse to fine
    finest: str  # what the others are compared with
    left_out: Mapping[str, str]  # fidelities that the specification has no data for, and why

    @property
    def reference(self) -> Variant:
        """The variant that the others are compared with."""
        return next(item for item in self.variants if item.name == self.finest)

    @property
    def compared(self) -> tuple[Variant, ...]:
        """All others."""
        return tuple(item for item in self.variants if item.name != self.finest)

    @property
    def curves(self) -> tuple[Curve, ...]:
        """All curves, the nominal one first, each labelled with its fidelity."""
        return tuple(curve for item in self.variants for curve in item.curves)

    @property
    def shortfall(self) -> str:
        """Missing parts of the curves beside the nominal one, in one sentence; empty if nothing is."""
        failed = [item for item in self.variants[1:] if item.result.status is not Status.COMPLETE]
        return "; ".join(f"fidelity {item.name}: {item.result.message}" for item in failed)

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """A finding for each model left out, and the warnings of the others that the nominal one does not have."""
        reported = {item.name for item in self.variants[0].result.warnings}
        gone = [Finding("fidelity_left_out", f"{name!r} cannot run here: {why}") for name, why in self.left_out.items()]
        more = [
            replace(warning, message=f"with fidelity {item.name}: {warning.message}")
            for item in self.variants[1:]
            for warning in item.result.warnings
            if warning.name not in reported and warning.message != item.result.message
        ]
        return (*gone, *more)

    @cached_property
    def _differences(self) -> Mapping[str, Differences]:
        """Differences of each of the others from the finest, inside `analysis.window`."""
        reference, over = _comparison_side(self.reference), window_of(self.variants[0].result)
        return {item.name: compare_sides(reference, _comparison_side(item), over) for item in self.compared}

    def differences(self, item: Variant) -> Differences:
        """Return what the nominal curve of a variant has more than that of the finest, by branch of the finest."""
        return self._differences[item.name]

    def metrics(self) -> dict[str, Quantity]:
        """Return root mean square, largest and mean difference of each fidelity, by name, SI."""
        quantities: dict[str, Quantity] = {}
        for item in self.compared:
            quantities |= self.differences(item).summarize(self._measures(item), self.kind, item.name)
        return quantities

    @property
    def kind(self) -> Kind:
        """Kind of the curves; of a mechanism without any it does not matter."""
        return self.curves[0].kind if self.curves else "force"

    def _measures(self, item: Variant) -> Mapping[str, Measure]:
        window = self.differences(item).window
        over = f" over {span_text(window.lo, window.hi, self.kind)}" if window else ""
        what = f"({item.name} - {self.finest}) {{}}, at {N_COMPARED_PLACES} even places{over}"
        return {
            "fidelity_rms": (rms, f"root mean square of {what}"),
            "fidelity_max": (largest, f"value largest in magnitude of {what}"),
            "fidelity_mean": (mean, f"mean of {what}"),
        }


def _comparison_side(item: Variant) -> ComparedSide:
    return ComparedSide(item.name, item.result.curve if item.result.curves else None)


def choices_of(spec: Spec) -> Choices:
    """Return the models that a specification can be run by.

    Raises UsageError if the family has one model only; SpecError if the specification has data for one of them only.
    """
    record = family(spec.family)
    names = tuple(record.models)
    if len(names) < 2:
        raise UsageError(f"{FIDELITY_OPTION}: {record.phrase} has only one model: there is nothing to compare")
    specs, obstacles = {}, {}
    for name in names:
        try:
            specs[name] = spec.replace({FIDELITY_KEY: name})
        except SpecError as error:
            obstacles[name] = "; ".join(problem.message for problem in error.problems)
    if len(specs) < 2:
        reported = "; ".join(f"{name!r} cannot run here: {why}" for name, why in obstacles.items())
        raise SpecError([Problem(FIDELITY_OPTION, 0, 0, "", f"needs two models; {reported}")])
    return Choices(names, specs, obstacles)


def compare(
    nominal: Result,  # of the specification as it is
    choices: Choices,  # of the same specification
    run: Run,  # for the other models
) -> FidelityComparison:
    """Return a result beside those of all other models that can run."""
    own_fidelity = fidelity_of(nominal)
    analyze = family(nominal.spec.family).analyze
    others = (
        Variant(name, warn_of_uncovered_windows(analyze(spec, run)))
        for name, spec in choices.specs.items()
        if name != own_fidelity
    )
    return FidelityComparison((Variant(own_fidelity, nominal), *others), list(choices.specs)[-1], choices.obstacles)


def fidelity_of(result: Result) -> str:
    """Return the fidelity of the model that a result comes from.

    Raises CfmError if the family does not write it into the specification of its results.
    """
    # A result that failed early has the specification as it was given: there the family's own rule applies.
    name = result.spec.get_value(FIDELITY_KEY) or getattr(result.spec, "fidelity", None)
    if not isinstance(name, str):
        raise CfmError(f"a result of the family {result.spec.family} does not say its {FIDELITY_KEY}")
    return name


def data_of(comparison: FidelityComparison) -> dict[str, object]:
    """Return what metrics.json says besides the differences, which are metrics."""
    return {"fidelity": {"reference": comparison.finest, "curves": list(_list_records(comparison))}}


def _list_records(comparison: FidelityComparison) -> Iterator[dict[str, object]]:
    for item in comparison.variants:
        points = sum(map(len, item.result.curves))
        about = {"fidelity": item.name, "status": item.result.status.key, "message": item.result.message}
        yield about | {"points": points}


def lines_of(comparison: FidelityComparison) -> tuple[tuple[str, str], ...]:
    """Return the paragraphs that a page shows: one for each curve and branch."""
    return tuple(("fidelity", line) for item in comparison.compared for line in _describe_differences(comparison, item))


def _describe_differences(comparison: FidelityComparison, item: Variant) -> Iterator[str]:
    from cfmkit.specs.units import format_short

    metrics, differences = comparison.metrics(), comparison.differences(item)
    window = differences.window
    for branch in differences.curves:
        tag = f"[{item.name},{branch}]" if len(differences.curves) > 1 else f"[{item.name}]"
        values = [metrics[f"fidelity_{name}{tag}"] for name in ("rms", "mean", "max")]
        title = f"{item.name} - {comparison.finest}" + (f" on {branch}" if branch else "")
        if window is None or values[0].value is None:
            yield f"{title}: undefined: {values[0].reason}"
            continue
        reported = [format_short(value.value or 0.0, value.dimension) for value in values]
        over = span_text(window.lo, window.hi, comparison.kind)
        yield f"{title}: rms {reported[0]}, mean {reported[1]}, largest {reported[2]} over {over}"
