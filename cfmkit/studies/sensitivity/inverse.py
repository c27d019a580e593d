"""The tolerances that keep a yield: each alone, all together, and as they cost least."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.specs.units import border_unit, to_border
from cfmkit.studies.parts.allowed_tolerances import LEAST_FACTOR, allowed_tolerances
from cfmkit.studies.parts.uncertain_values import values_at
from cfmkit.studies.sensitivity.method import Method
from cfmkit.studies.sensitivity.result_types import Findings, IndexLine
from cfmkit.studies.sensitivity.result_types import to_stated_value as reported
from cfmkit.studies.sensitivity.tolerance import DRAWN_ROLE, judge_samples, with_shares

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.studies.parts.allowed_tolerances import ToleranceFactors
    from cfmkit.studies.sensitivity.evaluation import Evaluator
    from cfmkit.studies.sensitivity.setup import Setup

DEFAULT_YIELD, N_DRAWN_PARTS = 0.95, 4000
"""What `inverse` keeps where `min_yield` says nothing, and the parts of its estimate of first order."""


def run(setup: Setup, evaluator: Evaluator) -> Findings:
    """State which tolerances keep the yield, and draw parts within those that are allocated."""
    wanted = setup.block.min_yield or DEFAULT_YIELD
    spreads = [parameter.spread for parameter in setup.parameters]
    errors = setup.parts.draw(N_DRAWN_PARTS, [setup.seed, 3]) - setup.values
    costs = np.array([setup.block.costs.get(path, 1.0) for path in setup.paths])
    answer = allowed_tolerances(setup.parts, setup.nominal.result, errors, costs, wanted)
    index_lines = list(_tolerance_lines(setup, answer))
    factors = np.where(np.isfinite(answer.allocated), np.maximum(answer.allocated, LEAST_FACTOR), 1.0)
    tight = [spread.tighten(float(factor)) for spread, factor in zip(spreads, factors, strict=True)]

    points = values_at(tight, setup.parts.unit(setup.samples, setup.seed))[:, None, :]
    outputs = evaluator.outputs(points, [DRAWN_ROLE])
    plain = Findings(setup, evaluator, tuple(index_lines), points=points, outputs=outputs)
    return with_shares(plain, *judge_samples(setup, outputs))


def _tolerance_lines(setup: Setup, answer: ToleranceFactors) -> Iterator[IndexLine]:
    """Yield what each tolerance may be, in its own unit: a standard deviation, or the half width of a range."""
    for k, parameter in enumerate(setup.parameters):
        spread = parameter.spread
        stated_width = spread.deviation if spread.kind == "normal" else 0.5 * (spread.high - spread.low)
        for name in ("alone", "together", "allocated"):
            width = float(getattr(answer, name)[k]) * stated_width
            value = reported(float(to_border(width, parameter.dimension)), "ratio")
            unit = border_unit(parameter.dimension)
            yield IndexLine("yield", parameter.path, f"tolerance_{name}", value, None, None, unit, N_DRAWN_PARTS)


SENSITIVITY_METHOD = Method(
    run,
    lambda samples, _, __: samples,
    ("tolerance_alone", "tolerance_together", "tolerance_allocated"),
    {"": "draw_histogram"},
    draws_parts=True,
)
