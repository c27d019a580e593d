"""From a candidate to a proposal: designed, written down, read again, analysed and judged, last by the finest model.

A candidate is first judged by the model that its family designs with. What passes is corrected by the finest model of
the family (networks of beams, leaves and strips: the part as drawn, as a planar solid) and judged again by that model,
on all requirements. Until then it was not judged, whatever its beams say.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.designing.run_many_starts import UNLIMITED_CLOCK, Clock
from cfmkit.errors import CfmError
from cfmkit.families import family
from cfmkit.families.base import ENVELOPE_METRICS, add_size
from cfmkit.families.hardware import SAFETY_METRICS
from cfmkit.families.proposals import stiffening
from cfmkit.families.run_control import Run
from cfmkit.metrics import check, evaluate, values_of_family
from cfmkit.results import Status
from cfmkit.specs.yamlio import dump, read_document
from cfmkit.studies.parts.parts import accuracy_of
from cfmkit.studies.stock_and_digits import decimals_of
from cfmkit.studies.suggest.file_of_proposal import (
    add_end_stop,
    add_process_and_materials,
    add_screws,
    block_for_redesign,
    note_end_stop,
    remove_end_stop,
    round_to_process,
)
from cfmkit.studies.suggest.requirements_and_misses import (
    LIFE_METRICS,
    disqualifying,
    largest_force,
    list_misses_within_mesh_error,
    list_requirements,
    list_unjudged,
    raised_out,
    sides_outside,
    too_short,
    too_thin,
    topic_of,
    windows_of,
)
from cfmkit.studies.suggest.yield_of_proposal import (
    GoodParts,
    MovedForYield,
    good_parts,
    move_for_yield,
    with_made_parts,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from cfmkit.families.base import BoundingBox
    from cfmkit.families.proposals import Candidate, Request
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec

MAX_SEARCH_SECONDS = 15.0  # seconds that one design may search
OUT_OF_TIME = "the time budget ended before it was designed and evaluated"
ENDED_EARLY = f"its design was not finished after {MAX_SEARCH_SECONDS:g} s"
MAX_YIELD_TRIES = 3  # how often a higher yield is required than drawn parts had
MOST_ASKED = 0.9975  # for a larger share the drawn parts of the search are too few
RUBBING_BLOCKS = ("pins", "guide", "bearings")  # blocks of a mechanism of rigid parts that may state a friction
MESH_MARGIN = 1.04
"""On the safety factor that corrections by solids aim at: a finer mesh finds about so much more stress in fillets."""
MAX_CORRECTIONS = 2  # how often a part is corrected by its finest model: what is still missed then is missed


@dataclass(frozen=True)
class ProposalJob:
    """A candidate of a family that is to be made and judged against a request before a deadline, in `time.time` [s].

    `earlier`: what came of it before, to be designed again with margins for the yield that is all it misses, or, where
    a finer model is `pending`, to be corrected and judged by that one.
    """

    family: str
    candidate: Candidate
    request: Request
    seed: int
    deadline: float | None = None
    earlier: Proposal | None = None


@dataclass(frozen=True)
class Proposal:
    """Outcome of a candidate: plain values, which a journal can keep."""

    # family, variant: whose it is
    family: str
    variant: str
    # the complete specification with the request as its requirements; empty where nothing came of the candidate
    text: str = ""
    missed: tuple[str, ...] = ()  # one sentence for every hard request that it misses when it is analysed from its file
    fails: tuple[str, ...] = ()  # what these sentences are about, in a word each: ``force``, ``stress``, ``size``
    message: str = ""  # why nothing came of it
    # in SI: ``mean``, ``ripple``, ``hysteresis``, ``safety_factor``, ``across``, ``along``, ``depth``, ``parts``,
    # ``life`` (cycles), ``yield`` (share of manufactured parts that are good, where one is required),
    # ``stiffening`` (by what share wide beams raise the mean that a planar solid has)
    numbers: Mapping[str, float | None] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # what a reader has to know: what was assumed, what no model here says
    movable: bool = False  # whether all that it misses is the yield, and a design with margins might have it
    unjudged: tuple[str, ...] = ()  # what is required and could not be judged, each with the reason
    model: str = ""  # the model that judged it
    pending: str = ""  # the finest model of its family that can run it and did not yet; empty if it did
    warnings: tuple[str, ...] = ()  # names of what its analysis warns of, with the number that counts
    seconds: float = 0.0  # that its analysis took
    design_model: str = ""  # that of its family, where another one judged it: its yield is by that of the design

    @property
    def passes(self) -> bool:
        """Whether it misses nothing that was judged."""
        return bool(self.text) and not self.missed

    @property
    def settled(self) -> bool:
        """Whether it misses nothing, and the finest model says so."""
        return self.passes and not self.pending

    @property
    def good(self) -> bool:
        """Whether it does all that is required, and all of it was judged by the finest model."""
        return self.settled and not self.unjudged

    @property
    def open(self) -> tuple[str, ...]:
        """Requirements that were not judged, each in a few words; empty if all was."""
        not_run = (f"{self.model} model; {self.pending} not run",) if self.pending else ()
        return (*not_run, *self.unjudged)

    @property
    def verdict(self) -> str:
        """``meets``, ``fails: stress, force`` or ``open: life``."""
        if self.missed:
            return f"fails: {', '.join(dict.fromkeys(self.fails))}"
        topics = [text.partition(" not ")[0] for text in self.unjudged]
        topics += [self.pending] if self.pending else []
        return f"open: {', '.join(dict.fromkeys(topics))}" if topics else "meets"

    @property
    def is_near_miss(self) -> bool:
        """Whether it misses exactly one request."""
        return bool(self.text) and len(self.missed) == 1

    @property
    def spec(self) -> Spec:
        """The specification."""
        return spec_of(self.family, self.text)

    def as_record(self) -> dict[str, Any]:
        """Return it as plain lists and mappings."""
        return {
            "family": self.family, "variant": self.variant, "text": self.text, "missed": list(self.missed),
            "fails": list(self.fails), "message": self.message, "numbers": dict(self.numbers),
            "notes": list(self.notes), "movable": self.movable,
            "unjudged": list(self.unjudged), "model": self.model, "pending": self.pending,
            "warnings": list(self.warnings), "seconds": self.seconds, "design_model": self.design_model,
        }  # fmt: skip

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Proposal:
        """Return what a record says."""
        lists = {name: tuple(record[name]) for name in ("missed", "fails", "notes", "unjudged", "warnings")}
        return cls(**{**record, **lists})


def spec_of(name: str, text: str) -> Spec:
    """Return the specification of a family that a text says."""
    return read_document(text, "design.yaml").bind(family(name).spec_type)


def make_proposal(job: ProposalJob) -> Proposal:
    """Return what becomes of a candidate; what its design or model refuses is its message, a bug is raised."""
    candidate, clock = job.candidate, Clock(job.deadline)
    try:
        if job.earlier is not None and job.earlier.pending and job.earlier.passes:
            return _judge_by_finest_model(job, job.earlier, clock)
        if job.earlier is not None:
            return _with_margins(job, job.earlier, clock)
        spec, reported = _design_candidate(job, clock)
        if spec is None:
            return Proposal(job.family, candidate.variant, message=reported)
        return judge_proposal(job.family, candidate.variant, spec, job.request, job.seed, clock)
    except (CfmError, np.linalg.LinAlgError) as problem:  # a shape no solver was made for is no proposal
        return Proposal(job.family, candidate.variant, message=" ".join(str(problem).split())[:300])


def _design_candidate(job: ProposalJob, clock: Clock) -> tuple[Spec | None, str]:
    """Return the candidate's specification, designed and finished; else None with the reason."""
    record, spec = family(job.family), job.candidate.spec
    if clock.late():
        return None, OUT_OF_TIME
    if job.candidate.design and record.design is not None:
        seconds, begun = _seconds(clock), time.time()
        design = record.design.make(spec, Run(job.seed, time_budget=seconds))
        if design.spec is None or design.status is not Status.COMPLETE:
            ended = time.time() - begun >= seconds
            return None, OUT_OF_TIME if clock.late() else ENDED_EARLY if ended else design.message
        spec = design.spec
    if clock.late():
        return None, OUT_OF_TIME
    if job.candidate.finish is not None:
        spec = job.candidate.finish(spec, replace(job.request, reserve=job.candidate.reserve))
    return spec, ""


def finest_of(name: str, spec: Spec) -> str:
    """Return the finest model of a family that can run a specification; its own where there is no finer one."""
    models = list(family(name).models)
    designed_by = spec.fidelity if spec.fidelity in models else models[0]
    for finer in reversed(models[models.index(designed_by) + 1 :]):
        try:
            spec.replace({FIDELITY_KEY: finer})
        except CfmError:  # what that model needs is not there: other parts, a motion in time
            continue
        return finer
    return designed_by


FIDELITY_KEY = "analysis.fidelity"


def use_own_model(proposal: Proposal) -> Spec:
    """Return a proposal's specification with the model of its design: faster, and enough for pictures."""
    spec = proposal.spec
    model = proposal.design_model
    return spec if model in ("", proposal.model) else spec.replace({FIDELITY_KEY: model})


def _judge_by_finest_model(job: ProposalJob, earlier: Proposal, clock: Clock) -> Proposal:
    """Return a proposal corrected and judged by the finest model of its family; the last of those that miss least."""
    spec, best, correct = remove_end_stop(earlier.spec, job.request), None, job.candidate.correct
    aimed = replace(job.request, safety=MESH_MARGIN * job.request.safety)
    for _ in range(MAX_CORRECTIONS if correct else 1):
        if clock.late():
            break
        made = correct(spec, aimed) if correct else spec.replace({FIDELITY_KEY: earlier.pending})
        if clock.late():
            break
        judged = judge_proposal(job.family, earlier.variant, made, job.request, job.seed, clock, earlier)
        if best is None or (judged.text and len(judged.missed) <= len(best.missed)):
            best = judged
        if judged.passes or not judged.text:
            break
        spec = remove_end_stop(use_own_model(judged), job.request)
    return Proposal(job.family, earlier.variant, message=OUT_OF_TIME) if best is None else best


def _with_margins(job: ProposalJob, earlier: Proposal, clock: Clock) -> Proposal:
    """Return a proposal designed again for the required yield, or with what is missing of it."""
    if clock.late():
        return Proposal(job.family, earlier.variant, message=OUT_OF_TIME)

    def judge(spec: Spec) -> Proposal:
        return judge_proposal(job.family, earlier.variant, spec, job.request, job.seed, clock)

    redesigned = redesign_for_yield(
        earlier, job.candidate, job.request, Run(job.seed, time_budget=clock.get_time_left()), judge
    )
    return (
        redesigned
        if redesigned.good or not clock.late()
        else Proposal(job.family, earlier.variant, message=OUT_OF_TIME)
    )


def redesign_for_yield(
    earlier: Proposal,  # which misses the yield alone
    candidate: Candidate,  # what it was made of
    request: Request,  # with a share of good parts
    run: Run,  # seed, and how long it may take
    judge: Callable[[Spec], Proposal],  # analyses and judges a specification, drawn parts included
) -> Proposal:
    """Return a proposal of the required yield, else the best found, with what is missing of it."""
    clock = Clock.from_budgets(run.time_budget)
    wanted = asked = float(request.stated.min_yield or 0.0)
    best, spec, last, obstacle = earlier, earlier.spec, None, ""
    for _ in range(MAX_YIELD_TRIES):
        run = replace(run, time_budget=clock.get_time_left())
        moved = None if clock.late() else move_for_yield(candidate, spec, request, asked, run)
        if moved is None:
            break
        last, judged = moved, judge(moved.spec)
        if judged.good:
            return replace(judged, notes=(_describe_margins(moved), *judged.notes))
        if not judged.movable:
            obstacle = "; ".join(judged.missed) or judged.message
            break
        share = float(judged.numbers["yield"] or 0.0)
        if share > float(best.numbers["yield"] or 0.0):
            best = judged
        if moved.share < asked or asked >= MOST_ASKED:
            break
        asked, spec = min(MOST_ASKED, max(moved.share, asked) + 0.5 * (wanted - share)), judged.spec
    return replace(best, missed=(f"{best.missed[0]}; {_explain_margins(last, obstacle)}",), movable=False)


def _describe_margins(moved: MovedForYield) -> str:
    before, now = (f"{100.0 * share:.3g} %" for share in (moved.began, moved.share))
    return f"designed with margins: yield {before} before, {now} now (linear estimate)"


def _explain_margins(moved: MovedForYield | None, obstacle: str) -> str:
    """Return why margins did not help."""
    if moved is None:
        return "no value of the design may change to improve it"
    reported = f"design margins cannot improve it further; largest contributor: {moved.costliest}"
    return f"{reported}; larger changes make it fail otherwise: {obstacle}" if obstacle else reported


def _seconds(clock: Clock) -> float:
    """Return how long one design may search [s]."""
    left = clock.get_time_left()
    return MAX_SEARCH_SECONDS if left is None else min(MAX_SEARCH_SECONDS, max(left, 0.1))


def judge_proposal(
    # name, variant: the family, and which of its mechanisms
    name: str,
    variant: str,
    spec: Spec,  # with the model that is to judge it
    request: Request,
    seed: int = 0,  # of random parts
    clock: Clock = UNLIMITED_CLOCK,  # late, no more parts are drawn
    # what its family's own model made of it, where another one is to judge it. Its share of good parts is kept: a solid
    # takes too long to be solved a hundred times
    earlier: Proposal | None = None,
) -> Proposal:
    """Return a specification as a proposal: it is written with the request as its requirements, read, analysed, judged.

    Where a share of good parts is required, the file says in its block `sensitivity` how they are made, and parts are
    drawn of what misses nothing else.
    """
    record = family(name)
    called = variant.replace(" ", "-").replace(",", "")
    # read back from its text: what is judged is what stands in the file
    spec = add_process_and_materials(spec, request) if earlier is None else add_screws(record, spec)
    spec = add_end_stop(round_to_process(spec, request, decimals_of(accuracy_of(spec))), request)
    plain = spec_of(name, dump(spec.replace({"design": None, "name": called})))
    begun = time.perf_counter()
    result = record.analyze(spec_of(name, dump(plain.replace({"requirements": windows_of(plain, request)}))), Run())
    seconds = time.perf_counter() - begun
    if result.status is not Status.COMPLETE:
        return Proposal(name, variant, message=result.message)
    space: BoundingBox | None = record.envelope(result)
    result, values = add_size(result, space), values_of_family(record.outputs.values)
    requirements = list_requirements(request, result, space, values)
    blocks: dict[str, Any] = {"requirements": requirements, "design": block_for_redesign(spec, request)}
    blocks |= {"suggest": request.stated} if hasattr(plain, "suggest") else {}
    text = dump(with_made_parts(plain.replace(blocks), request, seed))
    written = spec_of(name, text)
    outcomes = check(written.part_requirements, result, values)
    missed = [outcome for outcome in outcomes if not outcome.ok]
    misses = [
        *((topic_of(outcome.metric), outcome.sentence) for outcome in missed if outcome.metric not in ENVELOPE_METRICS),
        *(("size", text) for text in sides_outside(request, space)),
        *(("stress", text) for text in (space.faults if space else ())),
        *(("stress", text) for text in list_misses_within_mesh_error(request, result, values)),
        *(("travel", text) for text in too_short(request, result)),
        *disqualifying(result),
    ]
    pending = finest_of(name, written)
    pending = "" if pending == model_of(name, written) else pending
    numbers, movable = numbers_of(result, space, request), False
    warnings = {item.name: f"{item.name}: {item.short}" if item.short else item.name for item in result.warnings}
    if "wide_beam" in warnings and not misses:
        coarser = written if earlier is None else written.replace({FIDELITY_KEY: earlier.model})
        numbers["stiffening"] = raised = stiffening(coarser, record.analyze)
        warnings["wide_beam"] = f"wide_beam {100.0 * raised:+.2g} %"
        # what its finest model is still to correct may come down to the lower end of the band
        beyond = raised_out(request, request.low if pending else largest_force(request, result), raised)
        misses += [("force", text) for text in beyond]
    if earlier is not None:
        numbers["yield"] = earlier.numbers.get("yield")
        if request.stated.min_yield is not None:
            warnings["yield"] = f"yield by the {earlier.model} model"
    elif request.stated.min_yield is not None and len(misses) <= 1:
        parts: GoodParts = good_parts(replace(result, spec=written), request, clock, draw=not misses)
        if parts.late:
            return Proposal(name, variant, message=OUT_OF_TIME)
        movable = parts.movable and not misses
        misses += [("yield", parts.missed)] if parts.missed else []
        numbers["yield"] = parts.share
    return Proposal(
        name, variant, text,
        missed=tuple(text for _, text in misses), fails=tuple(topic for topic, _ in misses), numbers=numbers,
        notes=(*note_end_stop(request, result, numbers["depth"]), *too_thin(written), *_notes(space, result)),
        movable=movable, unjudged=tuple(list_unjudged(request, result)),
        model=model_of(name, written), pending=pending, warnings=tuple(warnings.values()), seconds=seconds,
        design_model=earlier.model if earlier else "",
    )  # fmt: skip


def model_of(name: str, spec: Spec) -> str:
    """Return the model that a specification picks, or else the only one of its family."""
    return spec.fidelity or next(iter(family(name).models))


def numbers_of(result: Result, space: BoundingBox | None, request: Request) -> dict[str, float | None]:
    """Return what proposals are compared by, in SI."""
    kind = request.kind
    quantities = evaluate(result)

    def worst(name: str) -> float | None:
        values = [
            quantity.value
            for key, quantity in quantities.items()
            if key.partition("[")[0] == name and quantity.value is not None
        ]
        return max(values) if values else None

    lost, mechanism = worst("hysteresis_area"), result.spec.get_value("mechanism")
    rubs = not hasattr(mechanism, "pins") or any(_friction_of_block(mechanism, name) for name in RUBBING_BLOCKS)
    means = {key: quantity.value for key, quantity in quantities.items() if key.partition("[")[0] == f"{kind}_mean"}
    means_of_branches = [value for key, value in means.items() if value is not None and ("[" in key or len(means) == 1)]
    mean = float(np.mean(means_of_branches)) if means_of_branches else None
    return {
        "mean": mean,
        "ripple": worst(f"{kind}_ripple"),
        "hysteresis": None if lost is None or not mean or not rubs else lost / (mean * request.travel),
        "safety_factor": _least_factor(quantities),
        "across": None if space is None else space.across,
        "along": None if space is None else space.along,
        "depth": None if space is None else space.depth,
        "parts": None if space is None else float(space.parts),
        "life": _life(quantities),
        "yield": None,
        "stiffening": None,
    }


def _least_factor(quantities: Mapping[str, Any]) -> float | None:
    """Return the smallest safety factor: of the part that bends, of links, or of springs."""
    factors = [quantities[name].value for name in SAFETY_METRICS if name in quantities]
    return min((value for value in factors if value is not None), default=None)


def _life(quantities: Mapping[str, Any]) -> float | None:
    """Return the life of what lasts shortest; None if that of the material, or of a bought spring, is not known."""
    lives = [quantities[name].value for name in LIFE_METRICS if name in quantities]
    finite = [life for life in lives if life is not None]
    if len(finite) < len(lives) or ("wire_stress_max" in quantities and "spring_life" not in quantities):
        return None
    return min(finite, default=None)


def _notes(space: BoundingBox | None, result: Result) -> Iterator[str]:
    """Yield what a reader has to know: what was assumed, what rubs, what the analysis warns of."""
    if space is not None and space.assumed:
        yield space.assumed
    mechanism = result.spec.get_value("mechanism")
    rubs = [f"{name} {value:g}" for name in RUBBING_BLOCKS if (value := _friction_of_block(mechanism, name))]
    if rubs:
        yield f"friction assumed: {', '.join(rubs)}"
    elif hasattr(mechanism, "pins"):
        plain = ", of rollers on plain shafts" if hasattr(mechanism, "bearings") else ""
        yield f"friction of pins and guide{plain} is not counted: require 'hysteresis' to have it judged"
    for finding in result.warnings:
        yield f"{finding.name}: {finding.message}"


def _friction_of_block(mechanism: Any, name: str) -> float:
    return float(getattr(getattr(mechanism, name, None), "friction", 0.0) or 0.0)
