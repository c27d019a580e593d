"""The function `cfmkit.suggest` for scripts and notebooks: requirements from keywords or a file, ranked proposals."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

from cfmkit.errors import Problem, SpecError
from cfmkit.families.run_control import Run, read_time
from cfmkit.runs.specfile import STDIN_PATH, content, rename_source, standard_input
from cfmkit.runs.suggestion_record import as_json
from cfmkit.specs.yamlio import read_document
from cfmkit.studies.suggest.outcome_of_search import Suggestions
from cfmkit.studies.suggest.spec import SuggestBlock, SuggestFile

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


def suggest(
    request: str | os.PathLike[str] | None = None,
    *,
    seed: int = 0,
    jobs: int = 1,
    time_budget: str | float | None = 180.0,
    force: str | Sequence[str] | None = None,
    torque: str | Sequence[str] | None = None,
    travel: str | None = None,
    angle: str | None = None,
    ripple: str | float | None = None,
    envelope: Sequence[str] | None = None,
    material: str | Sequence[str] | None = None,
    process: str | None = None,
    adjustable: Sequence[str] | None = None,
    hysteresis: str | float | None = None,
    cycles: int | None = None,
    min_yield: str | float | None = None,
    safety: str | float | None = None,
    springs: str | Sequence[str] | None = None,
    overload: str | None = None,
    prefer: Sequence[str] | None = None,
) -> SuggestionsView:
    """Return mechanisms of every family that meet the requirements, ranked, and those not judged in full.

    Parameters
    ----------
    request : path-like, optional
        A YAML file with a block `suggest`.
    seed : int
        Random seed.
    jobs : int
        Processes; 1: only this one, in which a long job cannot be stopped when the time budget ends.
    time_budget : str or float, optional
        A text with its unit (``"20 s"``, ``"2 min"``), or a number [s]; None: no limit.
    force, torque : str or sequence of str, optional
        To keep constant, ``"20 N"``, or a band of them. These and the next ones replace the keys of the file.
    travel, angle : str, optional
        Over which the force, or the torque, is constant.
    ripple : str or float, optional
        Largest (max - min)/max over the travel.
    envelope : sequence of str, optional
        Box that it stays in, ``["80 mm", "60 mm", "6 mm"]``: across the travel, along it, and the depth.
    material : str or sequence of str, optional
        Allowed materials.
    process : str, optional
        How it is made.
    adjustable : sequence of str, optional
        Range over which the constant force must be adjustable, its lowest and its highest value.
    hysteresis : str or float, optional
        Largest energy loss of a cycle, as a share of its work.
    cycles : int, optional
        Required life.
    min_yield : str or float, optional
        Smallest share of manufactured parts that meet all requirements, as 0.95 or ``"95 %"``: the key `yield`.
    safety : str or float, optional
        Smallest safety factor.
    springs : str or sequence of str, optional
        Which springs may be used.
    overload : str, optional
        Force along the travel that a rigid end stop has to bear.
    prefer : sequence of str, optional
        What decides the order: ``size``, ``ripple``, ``parts``, ``stress``, ``depth``.

    Raises
    ------
    cfmkit.errors.SpecError
        If the request contradicts itself, or is malformed.

    Examples
    --------
    >>> import cfmkit
    >>> found = cfmkit.suggest(force="10 kN", travel="10 mm", envelope=["20 mm", "20 mm", "1 mm"], material="pla")
    >>> len(found.proposals), len(found.answers)
    (0, 4)
    """
    given = locals()
    from cfmkit.studies.pool import Pool
    from cfmkit.studies.serial_and_cluster_executors import serial
    from cfmkit.studies.suggest.search import suggest as search_families

    def format_value(value: Any) -> str:
        return "[" + ", ".join(map(format_value, value)) + "]" if isinstance(value, list | tuple) else str(value)

    keys = {key: value for key, value in given.items() if key in SuggestBlock.model_fields and value is not None}
    keys |= {} if min_yield is None else {"yield": min_yield}
    name = None if request is None else os.fspath(request)
    block = read_request(name, {key: format_value(value) for key, value in keys.items()}, mark="")
    run = Run(seed, time_budget=read_time(time_budget), executor=serial if jobs == 1 else Pool(jobs))
    return SuggestionsView.answering(search_families(block.request(), run, block.prefer), block)


OPTIONS_SOURCE = "options"  # name of a request that has no file


def read_request(
    name: str | None,  # the file; ``-`` is standard input
    keys: Mapping[str, str],  # key of the request -> its value as a file would have it
    mark: str = "--",  # what stands before a key in messages; nothing where keys are arguments of a function
) -> SuggestBlock:
    """Return the request of a file, or of none, with keys replaced by what options say.

    Raises SpecError with everything that is wrong with it.
    """
    if name is None:
        document = read_document("cfmkit: 1\nsuggest: {}\n", OPTIONS_SOURCE)
    else:
        document = read_document(standard_input() if name == STDIN_PATH else content(name), name)
    for key, value in keys.items():
        document = document.set(f"suggest.{key}={value}")
    try:
        return document.bind(SuggestFile).suggest
    except SpecError as error:
        reported = error
    for key in keys:
        reported = rename_source(reported, f"--set suggest.{key}", f"{mark}{key}")
    raise reported if name is not None else _name_missing_options(reported, keys, mark)


def _name_missing_options(error: SpecError, keys: Mapping[str, str], mark: str) -> SpecError:
    """Return the error of a request without a file, with all missing keys in one sentence."""
    duty, path = ("torque", "angle") if "torque" in keys else ("force", "travel")
    missing = [mark + key for key in (duty, path, "envelope") if key not in keys]
    if not missing:
        return error
    verb = "are" if missing[1:] else "is"
    sentence = " and ".join(filter(None, (", ".join(missing[:-1]), missing[-1])))
    others = [problem for problem in error.problems if problem.source != OPTIONS_SOURCE]
    return SpecError([Problem("", 0, 0, "", f"{sentence} {verb} missing"), *others])


@dataclass(frozen=True, repr=False)
class SuggestionsView(Suggestions):
    """Proposals with what was requested; a notebook shows their table and the mechanisms to one scale."""

    block: SuggestBlock | None = field(default=None, compare=False)  # always there; it follows fields with defaults

    @classmethod
    def answering(cls, suggestions: Suggestions, block: SuggestBlock) -> SuggestionsView:
        """Return suggestions with the block `suggest` that they answer."""
        return cls(**{item.name: getattr(suggestions, item.name) for item in fields(suggestions)}, block=block)

    def __repr__(self) -> str:
        """Return the proposals in a line: family and variant of the first ten."""
        listed = [f"{proposal.family} {proposal.variant}"[:100] for proposal in self.listed[:10]]
        return f"<Suggestions: {'; '.join([self.message, *listed])}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        from cfmkit.documents.notebook import show_html
        from cfmkit.documents.suggestion_document import document_of
        from cfmkit.studies.suggest.figures import to_one_scale

        assert self.block is not None  # `answering`
        figures = {"proposals": lambda: to_one_scale(self.listed, self.request)} if self.listed else {}
        return show_html(document_of(as_json(self, self.block), self.exit_code), figures)
