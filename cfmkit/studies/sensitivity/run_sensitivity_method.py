"""A sensitivity study by its method: draw, evaluate, analyse, state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.studies.sensitivity.evaluation import Evaluator, Interrupted
from cfmkit.studies.sensitivity.result_types import Findings

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.studies.engine import Records, Work
    from cfmkit.studies.sensitivity.setup import Setup


def carry_out(
    setup: Setup,  # what to do
    compute: Callable[[Work], Records],  # from `Work` to `Records`: serial, in processes, on a cluster
) -> Findings:
    """Return what a study finds."""
    evaluator = Evaluator(setup.study, setup.parameters, compute, by_role=setup.record.by_role)
    try:
        findings: Findings = setup.record.run(setup, evaluator)
    except Interrupted:
        return Findings(setup, evaluator, interrupted=True)
    return findings
