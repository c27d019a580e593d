"""Which metrics a study notes: those requested, or all that the mechanism can have."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.families.base import ENVELOPE_METRICS
from cfmkit.metrics import definition_of, definitions, metrics_by_name, values_of_family
from cfmkit.metrics.spread import STATIC_BALANCE
from cfmkit.studies.point_evaluation import Metric, Study

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cfmkit.curves import Curve
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.plan import Plan

NEED_STRESS = ("stress_max", "safety_factor")
"""Metrics of curves that have stresses; others leave these columns out unless asked."""
NEED_FATIGUE = ("fatigue_life",)  # metrics that need fatigue data of the material
NEED_CURVE = ("deviation_from_curve", "rms_to_curve")  # metrics that compare with a target curve
NEED_TIME = ("force_after", "torque_after")
"""Metrics of a time, which their name says: without one there is nothing to note."""


def metrics_of(
    spec: Spec,  # its family knows more metrics
    names: Iterable[str],  # what is requested; none for the default
    sample: Curve | None = None,  # a curve of the study, which says whether it is about forces or torques
) -> tuple[Metric, ...]:
    """Return the metrics with these names; without names, every one that such a curve can have.

    The default has one column per metric, over all branches, and then the family's own
    values. A branch is had by name only: ``force_mean[load]``.

    Raises UsageError if a metric or its branch is not known.
    """
    outputs, kind = family(spec.family).outputs, sample.kind if sample is not None else "force"
    family_values = values_of_family(outputs.values)
    asked = tuple(dict.fromkeys(names))
    if not asked:
        left_out = _left_out(spec, sample)
        listed = (item.name for item in definitions(kind, family_values))
        asked = tuple(name for name in dict.fromkeys(listed) if name not in left_out)
    known = metrics_by_name(kind, family_values)
    meant = [(name, definition_of(name, known, outputs.branches)) for name in asked]
    return tuple(
        Metric(name, definition.dimension, definition.definition, words=outputs.words.get(name, ()))
        for name, definition in meant
    )


def _left_out(spec: Spec, sample: Curve | None) -> frozenset[str]:
    """Return the metrics that no point of such a study can have, or only if named: they cost time."""
    stressed = sample is None or "max_stress" in sample.extra
    lasting = getattr(spec, "durability", None)
    lives = () if lasting is not None and lasting.fatigue is not None else NEED_FATIGUE
    followed = () if getattr(spec, "target_curve", None) is not None else NEED_CURVE
    by_name = (STATIC_BALANCE, *ENVELOPE_METRICS)
    return frozenset((*followed, *(() if stressed else NEED_STRESS), *lives, *NEED_TIME, *by_name))


def sample_curve(spec: Spec, plan: Plan, design: bool) -> Curve | None:
    """Return a curve of the study to see what it is about: of the specification itself, or of a point."""
    probe = Study(spec, plan.paths, (), design)
    for variant in _candidates(probe, plan):
        try:
            outcome = probe.solve(variant)
        except CfmError:
            continue
        if outcome.curves:
            return outcome.curves[0]
    return None


def _candidates(probe: Study, plan: Plan) -> Iterator[Spec]:
    """Yield the specification as it is, then a few variants spread over the study."""
    yield probe.spec
    for index in dict.fromkeys((0, len(plan) - 1, len(plan) // 2)):
        try:
            yield probe.variant(plan.point(index))
        except CfmError:
            continue
