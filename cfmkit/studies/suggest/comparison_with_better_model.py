"""What the finest model of its family makes of a proposal: its mean over the travel, compared."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.designing.run_many_starts import Clock
from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.families.run_control import Run
from cfmkit.metrics import evaluate, left_of, window_of
from cfmkit.results import Status
from cfmkit.studies.suggest.proposal_making_and_judging import Proposal
from cfmkit.studies.suggest.search import surviving_until

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.serial_and_cluster_executors import Lost
    from cfmkit.studies.suggest.search import Suggestions

AGREES = 0.05
"""Difference of the means up to which two models say the same."""

NOT_COMPARED = "it was not finished when the time budget ended"
"""Why a proposal has no comparison if the time did not suffice."""


def with_better_models(found: Suggestions, run: Run, solve: bool) -> Suggestions:
    """Return suggestions whose proposals say what the finest model of their family makes of them.

    Parameters
    ----------
    found : Suggestions
        With their proposals judged by their own models.
    run : Run
        Its executor does the work, its time budget ends it: what was not compared then says so.
    solve : bool
        Whether to run those models; else it is said that they were not.
    """
    if not solve:
        return replace(found, proposals=tuple(map(not_compared, found.proposals)))
    clock, bugs = Clock.of(run.time_budget), list(found.bugs)
    executor = surviving_until(run, clock.deadline, bugs)
    done = dict(executor(partial(_compared_at, found.proposals), iter(range(len(found.proposals))), clock.late))
    kept = [_judged(old, done.get(index)) for index, old in enumerate(found.proposals)]
    return replace(found, proposals=tuple(kept), bugs=tuple(bugs))


def _judged(old: Proposal, outcome: Proposal | Lost | None) -> Proposal:
    """Return a proposal with what came of the comparison."""
    if isinstance(outcome, Proposal):
        return outcome
    if outcome is not None and outcome.status is Status.CRASHED:
        return not_compared(old, outcome.message)
    return not_compared(old, NOT_COMPARED)


def _compared_at(proposals: Sequence[Proposal], index: int) -> Proposal:
    return compared(proposals[index])


def better(proposal: Proposal) -> tuple[str, Spec] | None:
    """Return the finest model of the family that can run a proposal, if it is finer than its own; else None."""
    spec = proposal.spec
    names = list(family(proposal.family).models)
    own = names.index(spec.fidelity) if spec.fidelity in names else 0
    for name in reversed(names[own + 1 :]):
        try:
            return name, spec.replace({"analysis.fidelity": name})
        except CfmError:  # what that model needs is not there: other parts, a motion in time
            continue
    return None


def compared(proposal: Proposal) -> Proposal:
    """Return a proposal that says how far a finer model is from it; as it is where there is none."""
    found = better(proposal)
    if found is None:
        return proposal
    name, spec = found
    record = family(proposal.family)
    try:
        means = [_mean(record.analyze(one, Run())) for one in (proposal.spec, spec)]
    except (CfmError, np.linalg.LinAlgError) as problem:
        return _noted(proposal, f"{name}: {' '.join(str(problem).split())[:200]}", None)
    if None in means or not means[0]:
        return _noted(proposal, f"{name}: its curve ends before the travel does", None)
    deviation = float(means[1] or 0.0) / means[0] - 1.0
    verdict = "agrees" if abs(deviation) <= AGREES else "does not agree"
    return _noted(
        proposal, f"{name} {verdict}: the mean over the travel differs by {100 * deviation:+.2g} %", deviation
    )


def not_compared(proposal: Proposal, why: str = "--verify") -> Proposal:
    """Return a proposal that says which finer model was not run, and why or how it is."""
    found = better(proposal)
    return proposal if found is None else _noted(proposal, f"not compared with the model {found[0]!r}: {why}", None)


def _noted(proposal: Proposal, note: str, deviation: float | None) -> Proposal:
    numbers = {**proposal.numbers, "finer_deviation": deviation}
    return replace(proposal, notes=(note, *proposal.notes), numbers=numbers)


def _mean(result: Result) -> float | None:
    """Return the mean of all branches over the window of the analysis; None where the nominal curve does not cover it.

    As metrics have it: a curve that turns back is not put in the order of its motion.
    """
    window = window_of(result) if result.curves else None
    if window is None or left_of(window, result) != window:
        return None
    name, branches = f"{result.curve.kind}_mean", result.curve.branches
    names_of_means = [f"{name}[{branch}]" for branch in branches] if len(branches) > 1 else [name]
    means = [one.value for one in evaluate(result, names_of_means, window).values()]
    known = [mean for mean in means if mean is not None]
    return float(np.mean(known)) if len(known) == len(means) else None
