"""A proposal by the next better model of its family: how far its mean is from that of the model that judged it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.families.base import Run

if TYPE_CHECKING:
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.suggest.proposal import Proposal

AGREES = 0.05
"""Difference of the means up to which two models say the same."""


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


def verified(proposal: Proposal) -> Proposal:
    """Return a proposal that says how far a better model is from it; as it is where there is none."""
    found = better(proposal)
    if found is None:
        return proposal
    name, spec = found
    record = family(proposal.family)
    try:
        means = [_mean(record.analyze(one, Run())) for one in (proposal.spec, spec)]
    except (CfmError, ValueError, ArithmeticError) as problem:
        return _noted(proposal, f"{name}: {' '.join(str(problem).split())[:200]}", None)
    if None in means or not means[0]:
        return _noted(proposal, f"{name}: its curve ends before the travel does", None)
    deviation = float(means[1] or 0.0) / means[0] - 1.0
    verdict = "agrees" if abs(deviation) <= AGREES else "does not agree"
    return _noted(
        proposal, f"{name} {verdict}: the mean over the travel differs by {100 * deviation:+.2g} %", deviation
    )


def unverified(proposal: Proposal) -> Proposal:
    """Return a proposal that says which better model was not run."""
    found = better(proposal)
    return proposal if found is None else _noted(proposal, f"not compared with the model {found[0]!r}: --verify", None)


def _noted(proposal: Proposal, note: str, deviation: float | None) -> Proposal:
    numbers = {**proposal.numbers, "finer_deviation": deviation}
    return replace(proposal, notes=(note, *proposal.notes), numbers=numbers)


def _mean(result: Result) -> float | None:
    """Return the mean over the window of the analysis; None where the nominal curve does not cover it."""
    window = result.spec.at("analysis.window")
    if not result.curves or window is None:
        return None
    low, high = (float(end) for end in window)
    curve = result.curve
    order = np.argsort(curve.motion, kind="stable")
    motion, effort = curve.motion[order], curve.effort[order]
    if motion[0] > low + 1e-9 or motion[-1] < high * (1.0 - 1e-6):
        return None
    mean = float(np.interp(np.linspace(low, high, 201), motion, effort).mean())
    return mean if np.isfinite(mean) else None
