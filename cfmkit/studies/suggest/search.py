"""Ask every family, make what they name in rounds, and sort what does what is wished.

A round takes the next candidates of every family that has not enough proposals yet; what the next round takes depends
on what came of the ones before, never on what finished first. So the same seed gives the same proposals however many
processes work, unless the time budget ends the search.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from cfmkit.families import family, names
from cfmkit.families.base import Run, function_named
from cfmkit.families.wishes import FamilyOffer
from cfmkit.store.identity import code_stamp, stable_hash
from cfmkit.studies.suggest.proposal import Proposal, ProposalJob, made
from cfmkit.studies.suggest.verification import unverified, verified

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.families.wishes import Candidate, Wish

ENOUGH = 3
"""Proposals of a family after which no more of its candidates are made."""

ROUNDS = (3, 4, 6, 12)
"""Candidates of a family in each round, the last again and again: every round waits for the one before it."""

LONGEST = 15.0
"""Seconds that one design may search."""

RESERVE = 14.0
"""Seconds that figures of a dozen proposals take on two cores."""


@dataclass(frozen=True)
class Answered:
    """What one family had to say: how many candidates it named and how many were made, or why there are none."""

    family: str
    offer: FamilyOffer
    made: int = 0


@dataclass(frozen=True)
class Suggestions:
    """What came of a wish.

    Attributes
    ----------
    wish : Wish
    proposals : tuple of Proposal
        Those that do all that is wished, the best first.
    near : tuple of Proposal
        Those that miss one wish, at most two a family.
    answers : tuple of Answered
        Of every family that was asked.
    failed : mapping of str to tuple of str
        Family -> why nothing came of candidates, each reason once.
    late : bool
        Whether the time budget ended the search.
    reused : int
        Candidates that were found in the journal.
    """

    wish: Wish
    proposals: tuple[Proposal, ...]
    near: tuple[Proposal, ...]
    answers: tuple[Answered, ...]
    failed: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    late: bool = False
    reused: int = 0


def suggest(
    wish: Wish, run: Run, prefer: Sequence[str] = ("size", "ripple", "parts", "stress"), reserve: float = 0.0
) -> Suggestions:
    """Return mechanisms that do what is wished, of every family that has any.

    Parameters
    ----------
    wish : Wish
        What is wanted.
    run : Run
        Seed, progress, time budget, executor and notes.
    prefer : sequence of str
        What decides the order, most important first: ``size``, ``ripple``, ``parts``, ``stress``, ``depth``.
    reserve : float
        Of the time budget, kept for what comes after the search [s].
    """
    begun = time.monotonic()
    deadline = None if run.time_budget is None else begun + max(run.time_budget - reserve, 0.6 * run.time_budget)
    answers = [Answered(name, _asked(name, wish, run)) for name in names()]
    answers = [one for one in answers if one.offer.candidates or one.offer.reason]
    queues = {one.family: list(one.offer.candidates) for one in answers}
    total = sum(map(len, queues.values()))
    done: list[Proposal] = []
    reused = tried = turn = 0

    def late() -> bool:
        return deadline is not None and time.monotonic() > deadline

    while not late() and (batch := list(_next(queues, done, ROUNDS[min(turn, len(ROUNDS) - 1)]))):
        turn += 1
        left = LONGEST if deadline is None else min(LONGEST, max(deadline - time.monotonic(), 0.1))
        jobs = [ProposalJob(name, candidate, wish, run.seed, left) for name, candidate in batch]
        keys = [_key(job) for job in jobs]
        places = [run.notes.find(key) for key in keys]
        known = {
            index: Proposal.of_record(run.notes.read(place, key))
            for index, (place, key) in enumerate(zip(places, keys, strict=True))
            if place >= 0
        }
        reused += len(known)
        open_jobs = [(index, job) for index, job in enumerate(jobs) if index not in known]
        for (index, _job), proposal in run.executor(_indexed, iter(open_jobs), late):
            if isinstance(proposal, Proposal):
                known[index] = proposal
                if not proposal.message.startswith("the time budget"):
                    run.notes.add(keys[index], proposal.as_record())
            tried += 1
            run.progress(min(0.99, (tried + reused) / max(total, 1)), f"{sum(one.good for one in done)} proposals")
        done += [known[index] for index in sorted(known)]
        if len(known) < len(jobs):
            break
    counts = {name: sum(one.family == name for one in done) for name in queues}
    return Suggestions(
        wish,
        tuple(ordered([one for one in done if one.good], wish, prefer)),
        tuple(_near(done, wish)),
        tuple(replace(one, made=counts[one.family]) for one in answers),
        _failures(done),
        late() and bool(list(_next(queues, done, 1))),
        reused,
    )


def with_better_models(found: Suggestions, run: Run, solve: bool) -> Suggestions:
    """Return suggestions whose proposals say what the next better model of their family makes of them.

    Parameters
    ----------
    found : Suggestions
    run : Run
        Its executor does the work.
    solve : bool
        Whether to run those models; else it is said that they were not.
    """
    if not solve:
        return replace(found, proposals=tuple(map(unverified, found.proposals)))
    jobs = list(enumerate(found.proposals))
    done = {index: one for (index, _), one in run.executor(_verified, iter(jobs), lambda: False)}
    kept = [done[index] if isinstance(done[index], Proposal) else unverified(one) for index, one in jobs]
    return replace(found, proposals=tuple(kept))


def _verified(item: tuple[int, Proposal]) -> Proposal:
    return verified(item[1])


def _indexed(item: tuple[int, ProposalJob]) -> Proposal:
    return made(item[1])


def _asked(name: str, wish: Wish, run: Run) -> FamilyOffer:
    record = family(name)
    if record.propose is None:
        return FamilyOffer()
    offer: FamilyOffer = function_named(record.propose)(wish, run)
    return offer


def _next(queues: dict[str, list[Candidate]], done: Sequence[Proposal], most: int) -> Iterator[tuple[str, Candidate]]:
    """Yield the next candidates of every family that has not enough proposals, and take them from the queues."""
    for name, queue in queues.items():
        if sum(one.good for one in done if one.family == name) < ENOUGH:
            for _ in range(min(most, len(queue))):
                yield name, queue.pop(0)


def _key(job: ProposalJob) -> str:
    """Return by what a proposal is found again: all that decides it, the code included, but not the time left."""
    candidate = job.candidate
    content = {
        "family": job.family, "variant": candidate.variant, "design": candidate.design, "finish": candidate.finish,
        "spec": candidate.spec.model_dump(mode="json"), "wish": repr(job.wish), "seed": job.seed, "code": code_stamp(),
    }  # fmt: skip
    return stable_hash(content)[:32]


def ordered(proposals: Sequence[Proposal], wish: Wish, prefer: Sequence[str]) -> list[Proposal]:
    """Return proposals, the best first: each preference counts half as much as the one before it."""
    weights = {name: 0.5**place for place, name in enumerate(dict.fromkeys(prefer))}
    measures = {name: [measure(one, wish, name) for one in proposals] for name in weights}

    def score(index: int) -> float:
        total = 0.0
        for name, weight in weights.items():
            values = measures[name]
            total += weight * sum(value < values[index] for value in values)
        return total

    order = sorted(range(len(proposals)), key=lambda index: (score(index), index))
    return [proposals[index] for index in order]


def measure(proposal: Proposal, wish: Wish, name: str) -> float:
    """Return what is the smaller the better: area in the plane, ripple, parts, stress over the allowable one, depth."""
    numbers = {key: value for key, value in proposal.numbers.items() if value is not None}
    found = {
        "size": numbers.get("across", 1e9) * numbers.get("along", 1e9),
        "ripple": numbers.get("ripple", 1.0),
        "parts": numbers.get("parts", 1e9),
        "stress": 1.0 / numbers["safety_factor"] if numbers.get("safety_factor") else 0.0,
        "depth": numbers.get("depth", 1e9),
    }
    return found[name]


def _near(done: Sequence[Proposal], wish: Wish) -> list[Proposal]:
    """Return those that miss one wish, two of each family at most."""
    found: list[Proposal] = []
    for name in dict.fromkeys(one.family for one in done):
        near = [one for one in done if one.family == name and one.near]
        found += sorted(near, key=lambda one: measure(one, wish, "ripple"))[:2]
    return found


def _failures(done: Sequence[Proposal]) -> dict[str, tuple[str, ...]]:
    """Return why nothing came of candidates, by family."""
    found: dict[str, tuple[str, ...]] = {}
    for one in done:
        if not one.good and not one.near:
            told = one.message or "; ".join(one.missed)
            found[one.family] = tuple(dict.fromkeys((*found.get(one.family, ()), told)))
    return found
