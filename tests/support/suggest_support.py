"""A small request for `suggest`, what families offer for it, and their proposals, judged."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit import Run
from cfmkit.families import Request, family
from cfmkit.runs import read_request
from cfmkit.studies.suggest import ProposalJob, make_proposal

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from cfmkit.studies.suggest import Proposal

POM = {  # 10 N of POM over 3 mm
    "safety": "1",
    "force": "10 N",
    "travel": "3 mm",
    "ripple": "3 %",
    "envelope": "[80 mm, 60 mm, 12 mm]",
    "material": "pom",
}


def block(keys: Mapping[str, Any] = {}, file: Path | None = None) -> Any:
    """Return the block `suggest` of options, or of a file in which they replace keys."""
    return read_request(None if file is None else str(file), keys)


def small_block(**keys: Any) -> Any:
    """Return the block of the small request with other keys."""
    return block(POM | keys)


def request(**keys: Any) -> Any:
    """Return the small request with other keys."""
    return Request.from_block(small_block(**keys))


def request_of(keys: Mapping[str, Any] = {}, file: Path | None = None) -> Any:
    """Return the request of these keys alone, or of a file."""
    return Request.from_block(block(keys, file))


def propose(name: str, asked: Any) -> Any:
    """Return what a family offers for a request."""
    return family(name).propose(asked, Run())


def offered(name: str, **keys: Any) -> tuple[Any, Any]:
    """Return the small request with other keys, and the candidates of a family for it."""
    asked = request(**keys)
    return asked, propose(name, asked).candidates


def candidate_named(candidates: Iterable[Any], variant: str) -> Any:
    """Return the first candidate of a variant."""
    return next(each for each in candidates if each.variant == variant)


def proposal_of(name: str, candidate: Any, asked: Any, seed: int = 0, **more: Any) -> Proposal:
    """Return the proposal that a candidate becomes."""
    return make_proposal(ProposalJob(name, candidate, asked, seed, **more))
