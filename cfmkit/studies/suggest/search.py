"""Search of `suggest`: collects candidates of every family, makes them in rounds, orders those that meet the request.

A round takes the next candidates of every family that has not enough proposals yet; what the next round takes depends
on what came of the ones before, never on what finished first. So the same seed gives the same proposals however many
processes work, unless the time budget ends the search.

The time is looked at before each design and between its steps; what still runs in a process of a pool when the time is
up is given up with it, be it the compilation of the beam engine. What was found so far is kept.
"""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.run_many_starts import Clock
from cfmkit.families import Unusable, family, names
from cfmkit.families.proposals import FamilyOffer
from cfmkit.families.run_control import Run
from cfmkit.results import Status
from cfmkit.specs.yamlio import dump
from cfmkit.store.content_hashes_and_versions import code_stamp, stable_hash
from cfmkit.studies.pool import give_up_at
from cfmkit.studies.serial_and_cluster_executors import Lost, do_or_lose, lose_to_bug
from cfmkit.studies.suggest.file_of_proposal import NO_END_STOP
from cfmkit.studies.suggest.outcome_of_search import FamilyAnswer, Suggestions
from cfmkit.studies.suggest.proposal_making_and_judging import (
    ENDED_EARLY,
    OUT_OF_TIME,
    Proposal,
    ProposalJob,
    make_proposal,
)
from cfmkit.studies.suggest.relaxed_requests import MAX_NAMED_KEYS, confirm, edges

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

    from cfmkit.families.base import Family
    from cfmkit.families.proposals import Candidate, Request
    from cfmkit.studies.serial_and_cluster_executors import Executor, Stopping, Work

ENOUGH_PROPOSALS, ENOUGH_WITH_PARTS = 3, 2
"""Proposals of a family after which no more of its candidates are made; fewer where parts of each are drawn."""
ROUND_SIZES = (3, 4, 6, 12)
"""Candidates of a family in each round, the last again and again: every round waits for the one before it."""
ASKING_SHARE, LAST_SHARE = 0.5, 0.05
"""Shares of the time budget in which families answer, and which are left where nothing is found."""
RESERVE_FOR_FILLETS = 0.8
"""Share of the strength that beams may use first: fillets of solids had 1.05 to 1.35 times the stress of their
beams."""
UNANSWERED_MESSAGE = "the time budget ended before it had answered"
FIGURE_SECONDS = 14.0  # seconds that figures of a dozen proposals take on two cores
RESERVE_OF_FEW = 6.0
"""The same of the one or two that turn up after nothing was found for most of the budget, and of the overview."""


@dataclass(frozen=True)
class _Times:
    """When what ends, in `time.time` [s]; None: never."""

    # families that have not answered by then, because the beam engine is compiled, are left out
    asking: float | None = None
    # with_proposals, without: the search, with and without anything found; what runs at the second is given up
    with_proposals: float | None = None
    without: float | None = None

    @classmethod
    def from_budget(cls, budget: float | None, reserve: float) -> _Times:
        """Return the times of a budget that begins now, of which a reserve is for what comes afterwards [s]."""
        if budget is None:
            return cls()
        now = time.time()
        left = max(LAST_SHARE * budget, min(reserve, RESERVE_OF_FEW))
        ends = (max(budget - kept, 0.5 * budget) for kept in (reserve, left))
        return cls(now + ASKING_SHARE * budget, *(now + end for end in ends))


def suggest(
    request: Request,
    run: Run,
    prefer: Sequence[str] = ("size", "ripple", "parts", "stress"),
    reserve: float = 0.0,
) -> Suggestions:
    """Return mechanisms that do what is required, of every family that has any.

    Parameters
    ----------
    request : Request
        What is wanted.
    run : Run
        Seed, progress, time budget, executor and notes.
    prefer : sequence of str
        What decides the order, most important first: ``size``, ``ripple``, ``parts``, ``stress``, ``depth``.
    reserve : float
        Of the time budget, kept for what comes after the search [s]; as long as nothing is found there is nothing to
        come, and the search goes on.
    """
    times, bugs = _Times.from_budget(run.time_budget, reserve), list[str]()
    answers, unasked = _answers(request, run, times.asking, bugs)
    queues = {answer.family: list(answer.offer.candidates) for answer in answers}
    making = _MadeCandidates(run, times, sum(map(len, queues.values())), bugs)
    turn, cut, enough = 0, unasked, ENOUGH_PROPOSALS if request.stated.min_yield is None else ENOUGH_WITH_PARTS
    while not making.late() and (
        batch := list(_next(queues, making.done, ROUND_SIZES[min(turn, len(ROUND_SIZES) - 1)], enough))
    ):
        turn += 1
        jobs = [ProposalJob(name, candidate, request, run.seed, times.without) for name, candidate in batch]
        rest = (making.with_margins, making.select_for_finest)
        if not (making.all_of(jobs) and all(making.all_of(again(enough)) for again in rest)):
            cut = True
            break
    done = making.done
    counts, remote = {name: sum(proposal.family == name for proposal in done) for name in queues}, False
    if not cut and not any(proposal.passes for proposal in done):
        answers, complete = _with_nearest(answers, request, run, times.without, bugs)
        remote = complete and not any(answer.nearest for answer in answers)
    passing = name_apart([proposal for proposal in done if proposal.passes])
    return Suggestions(
        request,
        tuple(order_proposals([proposal for proposal in passing if proposal.good], prefer)),
        tuple(_list_near_misses(done, request)),
        tuple(replace(proposal, made=counts[proposal.family]) for proposal in answers),
        _list_failures(done),
        cut or (making.late() and bool(list(_next(queues, done, 1, enough)))),
        making.reused,
        tuple(bugs),
        tuple(order_proposals([proposal for proposal in passing if not proposal.good], prefer)),
        remote,
    )


def surviving_until(run: Run, deadline: float | None, bugs: list[str]) -> Executor:
    """Return an executor until a deadline, in `time.time` [s], in which a bug costs its own job only.

    The processes of a pool behave like that by themselves, this process does not. Tracebacks are added to `bugs`.
    """
    executor = give_up_at(run.executor, deadline)

    def collect_bugs(work: Work, jobs: Iterator[Any], stopping: Stopping) -> Iterator[tuple[Any, Any]]:
        for job, outcome in executor(partial(do_or_lose, work), jobs, stopping):
            if isinstance(outcome, Lost) and outcome.bug:
                bugs.append(outcome.bug)
            yield job, outcome

    return collect_bugs


class _MadeCandidates:
    """The candidates that were made, in the order in which they were requested."""

    def __init__(self, run: Run, times: _Times, total: int, bugs: list[str]) -> None:
        self._run, self._times, self._total, self._tried, self._bugs = run, times, total, 0, bugs
        self._known: dict[int, Proposal] = {}
        self._jobs: list[ProposalJob] = []
        self.done: list[Proposal] = []  # what became of them; in a round that the time ended, of some of them
        self.reused = 0  # those that stood in the journal

    def late(self) -> bool:
        """Return True if the time is up, of which there is more as long as nothing is found."""
        has_proposal = any(proposal.good for proposal in (*self.done, *self._known.values()))
        end = self._times.with_proposals if has_proposal else self._times.without
        return end is not None and time.time() > end

    def all_of(self, jobs: Sequence[ProposalJob]) -> bool:
        """Make candidates, or find them in the journal; return whether the time sufficed for all."""
        run, notes = self._run, self._run.notes
        keys = [_key(job) for job in jobs]
        records = {index: notes.find(key) for index, key in enumerate(keys)}
        self._known = {index: Proposal.from_record(record) for index, record in records.items() if record is not None}
        self.reused += len(self._known)
        left = [index for index in range(len(jobs)) if index not in self._known]
        work = partial(_make_job, tuple(jobs))
        executor = surviving_until(run, self._times.without, self._bugs)
        for index, outcome in executor(work, iter(left), self.late):
            proposal = _proposal_or_loss(jobs[index], outcome)
            if proposal.message != OUT_OF_TIME:
                self._known[index] = proposal
                # What ended early, crashed, or lost its process is not kept: it may succeed next time.
                if not isinstance(outcome, Lost) and proposal.message != ENDED_EARLY:
                    notes.add(keys[index], proposal.as_record())
            self._tried += jobs[index].earlier is None
            made = (self._tried + self.reused) / max(self._total, 1)
            count = sum(proposal.good for proposal in self.done)
            run.progress(min(0.99, made), f"{count} proposal{'s' * (count != 1)}")
        for index in sorted(self._known):
            self._take(jobs[index], self._known[index])
        complete = len(self._known) == len(jobs)
        self._known = {}
        return complete

    def _take(self, job: ProposalJob, proposal: Proposal) -> None:
        """Keep what became of a candidate, in place of the near miss that it was designed again for."""
        if job.earlier is None:
            self.done.append(proposal)
            self._jobs.append(job)
            return
        at = next(k for k, proposal in enumerate(self.done) if proposal is job.earlier)
        failed = replace(job.earlier, movable=False)
        if job.earlier.passes and proposal.message:  # of its finest model, which cannot follow it
            failed = replace(failed, text="", message=f"{job.earlier.pending} model: {proposal.message}")
        self.done[at] = proposal if proposal.text else failed

    def select_for_finest(self, enough: int) -> list[ProposalJob]:
        """Return what is to be judged by the finest model, of each family that lacks proposals, by turns."""
        rows = []
        for name in dict.fromkeys(job.family for job in self._jobs):
            mine = [(job, proposal) for job, proposal in zip(self._jobs, self.done, strict=True) if job.family == name]
            lacking = enough - sum(proposal.settled for _, proposal in mine)
            waiting = [replace(job, earlier=proposal) for job, proposal in mine if proposal.passes and proposal.pending]
            rows.append(waiting[: max(lacking, 0)])
        longest = max(map(len, rows), default=0)
        return [row[k] for k in range(longest) for row in rows if k < len(row)]

    def with_margins(self, enough: int) -> list[ProposalJob]:
        """Return what is worth a design with margins: of families that lack proposals those with the largest yield."""
        jobs = []
        for name in dict.fromkeys(job.family for job in self._jobs):
            mine = [(job, proposal) for job, proposal in zip(self._jobs, self.done, strict=True) if job.family == name]
            lacking = enough - sum(proposal.passes for _, proposal in mine)
            movable = [(job, proposal) for job, proposal in mine if proposal.movable]
            movable.sort(key=lambda pair: -float(pair[1].numbers["yield"] or 0.0))
            jobs += [replace(job, earlier=proposal) for job, proposal in movable[: max(lacking, 0)]]
        return jobs


def _with_nearest(
    answers: list[FamilyAnswer], request: Request, run: Run, deadline: float | None, bugs: list[str]
) -> tuple[list[FamilyAnswer], bool]:
    """Return answers with the nearest requests that a family could meet, and whether the time sufficed for all."""
    families = tuple(answer.family for answer in answers)
    key = stable_hash({"nearest": repr(request), "of": families, "seed": run.seed, "code": code_stamp()})[:32]
    record = run.notes.find(key)
    named: dict[str, dict[str, str]] = {} if record is None else dict(record)
    complete = True
    if record is None:
        clock, keys = Clock(deadline), set[str]()
        waiting = (edge for edge in edges(request, families, run.seed, clock) if edge.key not in keys)
        executor = surviving_until(run, deadline, bugs)
        work = partial(confirm, request, run.seed, clock)
        try:
            for edge, outcome in executor(work, waiting, lambda: clock.late() or len(keys) >= MAX_NAMED_KEYS):
                if isinstance(outcome, str):
                    keys.add(edge.key)
                    named.setdefault(edge.family, {}).setdefault(edge.key, outcome)
        except Exception as error:  # the laws of a family have a bug: what was found is kept
            bugs.append(lose_to_bug(error).bug)
        if clock.late():
            complete = False
        else:
            run.notes.add(key, named)
    return [replace(answer, nearest=named.get(answer.family, {})) for answer in answers], complete


def _make_job(jobs: Sequence[ProposalJob], index: int) -> Proposal:
    return make_proposal(jobs[index])


def _proposal_or_loss(job: ProposalJob, outcome: Proposal | Lost) -> Proposal:
    """Return a proposal, or what is said of one whose process died or was given up."""
    if isinstance(outcome, Proposal):
        return outcome
    return Proposal(
        job.family, job.candidate.variant, message=OUT_OF_TIME if outcome.status is Status.TIMEOUT else outcome.message
    )


def _answers(request: Request, run: Run, deadline: float | None, bugs: list[str]) -> tuple[list[FamilyAnswer], bool]:
    """Return what the families have to say, in their order, and whether the time was up before all had."""
    asked = list(names())
    plain = Run(run.seed)
    executor = surviving_until(run, deadline, bugs)
    outcomes = dict(executor(partial(_ask_family, request, plain), iter(asked), lambda: False))
    answers, late = [], False
    for name in asked:
        outcome: FamilyOffer | Lost = outcomes.get(name) or Lost(Status.TIMEOUT, UNANSWERED_MESSAGE)
        if not isinstance(outcome, FamilyOffer):
            timed_out = outcome.status is Status.TIMEOUT
            late |= timed_out
            outcome = FamilyOffer(reason=UNANSWERED_MESSAGE if timed_out else outcome.message)
        answers.append(FamilyAnswer(name, outcome))
    return [answer for answer in answers if answer.offer.candidates or answer.offer.reason], late


def _ask_family(request: Request, run: Run, name: str) -> FamilyOffer:
    try:
        record = family(name)
    except Unusable:  # of another package; `families.list_skipped` says why
        return FamilyOffer()
    return offer_of(record, request, run)


OTHER_SPRINGS = {"catalogue": "custom", "custom": "catalogue"}
"""The springs that are not allowed where only the first ones are."""


def offer_of(record: Family, request: Request, run: Run) -> FamilyOffer:
    """Return what a family could do with a request; elastic parts with a reserve of strength come first.

    Beams do not know the stress in fillets. Most parts that use all of their strength by beams use too much of it as
    solids; those with a reserve are tried first. Where the strength of a material is not known, parts of a small strain
    come before those of a larger one.
    """
    if record.propose is None:
        return FamilyOffer()
    reserves = (1.0,) if record.elastic is None else (RESERVE_FOR_FILLETS, 1.0)
    candidates: dict[tuple[str, str], Candidate] = {}
    for requested, reserve in product(request.with_strengths, reserves):
        offer = record.propose(replace(requested, reserve=reserve), run)
        for candidate in offer.candidates:
            if request.allows(candidate):
                candidates.setdefault((candidate.variant, dump(candidate.spec)), replace(candidate, reserve=reserve))
    springs = request.stated.springs
    reason = f"it needs {OTHER_SPRINGS[springs]} springs" if offer.candidates and springs else ""
    reason = NO_END_STOP if offer.candidates and request.stated.overload is not None else reason
    likely_first = tuple(sorted(candidates.values(), key=lambda candidate: candidate.doubtful))
    return FamilyOffer(likely_first, offer.reason if candidates else offer.reason or reason)


def _next(
    queues: dict[str, list[Candidate]], done: Sequence[Proposal], most: int, enough: int
) -> Iterator[tuple[str, Candidate]]:
    """Yield the next candidates of every family that has not enough proposals, by turns; they leave the queues."""
    short = [name for name in queues if sum(proposal.settled for proposal in done if proposal.family == name) < enough]
    for _ in range(most):
        for name in short:
            if queues[name]:
                yield name, queues[name].pop(0)


def _key(job: ProposalJob) -> str:
    """Return by what a proposal is found again: all that decides it, the code included, but not the time left."""
    candidate = job.candidate
    content = {
        "family": job.family, "variant": candidate.variant, "design": candidate.design,
        "finish": _name_refinement(candidate.finish), "correct": _name_refinement(candidate.correct),
        "spec": candidate.spec.model_dump(mode="json"), "suggest": repr(job.request), "seed": job.seed,
        "stated": job.request.stated.as_written(),
        "code": code_stamp(),
        "again": job.earlier and job.earlier.text, "reserve": candidate.reserve,
    }  # fmt: skip
    return stable_hash(content)[:32]


def _name_refinement(function: Any) -> str:
    """Return the name of a function, with the arguments that are bound to it."""
    if isinstance(function, partial):
        return f"{_name_refinement(function.func)}{function.args}"
    return f"{function.__module__}.{function.__qualname__}" if function else ""


def name_apart(proposals: Sequence[Proposal]) -> list[Proposal]:
    """Return proposals whose names tell them apart: equal ones get their size in the plane, then a number.

    Examples
    --------
    >>> from cfmkit.studies.suggest.proposal_making_and_judging import Proposal
    >>> sizes = ({"across": 0.034, "along": 0.051}, {"across": 0.069, "along": 0.023})
    >>> [one.variant for one in name_apart([Proposal("cam", "2 springs", numbers=size) for size in sizes])]
    ['2 springs, 34 x 51 mm', '2 springs, 69 x 23 mm']
    """
    count = Counter((proposal.family, proposal.variant) for proposal in proposals)
    sized = [
        _add_size_to_name(proposal) if count[proposal.family, proposal.variant] > 1 else proposal
        for proposal in proposals
    ]
    count, seen = Counter((proposal.family, proposal.variant) for proposal in sized), Counter[tuple[str, str]]()
    renamed = []
    for proposal in sized:
        seen[key := (proposal.family, proposal.variant)] += 1
        renamed.append(replace(proposal, variant=f"{proposal.variant} ({seen[key]})") if count[key] > 1 else proposal)
    return renamed


def _add_size_to_name(proposal: Proposal) -> Proposal:
    across, along = (1e3 * float(proposal.numbers.get(side) or 0.0) for side in ("across", "along"))
    return replace(proposal, variant=f"{proposal.variant}, {across:.3g} x {along:.3g} mm")


EQUAL_RTOL = 1e-3
"""Numbers that differ by less than this share are equal: searches leave as much in them, and nobody sees it."""


def order_proposals(proposals: Sequence[Proposal], prefer: Sequence[str]) -> list[Proposal]:
    """Return proposals, the best first: each preference counts half as much as the one before it.

    Of equal ones, as two sizes of one shape are in their ripple, the one that was made first is the first.
    """
    weights = {name: 0.5**place for place, name in enumerate(dict.fromkeys(prefer))}
    measures = {name: [measure(proposal, name) for proposal in proposals] for name in weights}

    def score(index: int) -> float:
        total = 0.0
        for name, weight in weights.items():
            values = measures[name]
            total += weight * sum(value < (1.0 - EQUAL_RTOL) * values[index] for value in values)
        return total

    order = sorted(range(len(proposals)), key=lambda index: (score(index), index))
    return [proposals[index] for index in order]


def measure(proposal: Proposal, name: str) -> float:
    """Return what is the smaller the better: area in the plane, ripple, parts, stress over the allowable one, depth.

    What is unknown is the worst: whether a mechanism bears its load is not known without a model of its stress, or
    without the strength of its material.
    """
    numbers = {key: value for key, value in proposal.numbers.items() if value is not None}
    if name == "size":
        return numbers.get("across", np.inf) * numbers.get("along", np.inf)
    if name == "stress":
        return 1.0 / numbers["safety_factor"] if numbers.get("safety_factor") else np.inf
    return numbers.get(name, np.inf)


MAX_OVERSIZE = 1.5  # sides over those of the envelope up to which a mechanism is an alternative


def _list_near_misses(done: Sequence[Proposal], request: Request) -> list[Proposal]:
    """Return those that miss one requirement, and no side of the envelope by far; two of each family at most."""
    near_misses: list[Proposal] = []
    for name in dict.fromkeys(proposal.family for proposal in done):
        family_misses = [
            proposal
            for proposal in done
            if proposal.family == name and proposal.is_near_miss and _nearly_fits(proposal, request)
        ]
        near_misses += sorted(family_misses, key=lambda proposal: measure(proposal, "ripple"))[:2]
    return near_misses


def _nearly_fits(proposal: Proposal, request: Request) -> bool:
    sides = [float(proposal.numbers.get(name) or 0.0) for name in ("across", "along", "depth")]
    allowed_sides = [*request.envelope, np.inf][:3]
    if request.kind == "torque":  # what turns may lie either way in the plane
        sides[:2], allowed_sides[:2] = sorted(sides[:2]), sorted(allowed_sides[:2])
    return all(side <= MAX_OVERSIZE * most for side, most in zip(sides, allowed_sides, strict=True))


def _list_failures(done: Sequence[Proposal]) -> dict[str, tuple[str, ...]]:
    """Return why nothing came of candidates, by family."""
    reasons: dict[str, tuple[str, ...]] = {}
    for proposal in done:
        if not proposal.passes and not proposal.is_near_miss:
            reported = proposal.message or "; ".join(proposal.missed)
            reasons[proposal.family] = tuple(dict.fromkeys((*reasons.get(proposal.family, ()), reported)))
    return reasons
