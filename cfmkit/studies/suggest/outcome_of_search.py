"""Outcome of a search by `suggest`: proposals, what was not judged, what misses, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from cfmkit.errors import ExitCode
from cfmkit.studies.serial_and_cluster_executors import BUG_PREFIX
from cfmkit.studies.suggest.relaxed_requests import LAST_FACTOR

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.proposals import FamilyOffer, Request
    from cfmkit.studies.suggest.proposal_making_and_judging import Proposal


@dataclass(frozen=True)
class FamilyAnswer:
    """Candidates of one family: how many it named and how many were made, or why there are none.

    Where no family has a mechanism, `nearest` says with which values of a key it would have one.
    """

    family: str
    offer: FamilyOffer
    made: int = 0
    nearest: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Suggestions:
    """Outcome of a request."""

    request: Request
    # those that do all that is required, judged by the finest model of their family, the best first
    proposals: tuple[Proposal, ...]
    near_misses: tuple[Proposal, ...]  # those that miss one request, at most two a family
    answers: tuple[FamilyAnswer, ...]  # of every family that was asked
    # family -> why nothing came of candidates, each reason once
    failed: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    late: bool = False  # whether the time budget ended the search
    reused: int = 0  # candidates that were found in the journal
    bugs: tuple[str, ...] = ()  # the traceback of each family or candidate that a bug ended
    unjudged: tuple[Proposal, ...] = ()  # those that miss nothing of what was judged, but not all was, the best first
    remote: bool = False  # whether it would not help either to relax one requirement up to `LAST_FACTOR`

    @property
    def listed(self) -> tuple[Proposal, ...]:
        """Proposals that have a folder: what meets the request, then what was not judged in full."""
        return (*self.proposals, *self.unjudged)

    @property
    def exit_code(self) -> ExitCode:
        """0 if a proposal does all that is required, 70 if a bug ended all, 6 if not all was judged, else 4."""
        if self.proposals:
            return ExitCode.OK
        reasons = [answer.offer.reason for answer in self.answers if answer.offer.reason]
        reasons += [reason for reasons_of_family in self.failed.values() for reason in reasons_of_family]
        if self.bugs and not self.near_misses and all(reason.startswith(BUG_PREFIX) for reason in reasons):
            return ExitCode.BUG
        return ExitCode.PARTIAL if self.late or self.unjudged else ExitCode.NO_SOLUTION

    @property
    def message(self) -> str:
        """One sentence on the end of the search."""
        if self.proposals:
            late = "; the time budget ended the search before everything was tried" if self.late else ""
            count = len(self.proposals)
            more = f", {len(self.unjudged)} more not judged in full" if self.unjudged else ""
            return f"{count} mechanism{' meets' if count == 1 else 's meet'} the requirements{more}{late}"
        if self.exit_code is ExitCode.BUG:
            return "bugs in cfmkit ended every candidate"
        if self.unjudged:
            count = len(self.unjudged)
            late = "; increase the time budget (--time-budget)" if self.late else ""
            were = "was" if count == 1 else "were"
            return f"no mechanism is known to meet the requirements, {count} {were} not judged in full{late}"
        if self.late:
            return (
                "the time budget ended the search before a mechanism met the requirements; increase it (--time-budget)"
            )
        if self.remote:
            return (
                "no mechanism meets the requirements, and none was found with one of them relaxed up to "
                f"{LAST_FACTOR:g} times"
            )
        return "no mechanism meets the requirements"
