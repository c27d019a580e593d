"""Record of a search by `suggest`: what metrics.json, ``--json`` and notebooks say of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.errors import ExitCode
from cfmkit.specs.units import to_border

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from cfmkit.studies.suggest.outcome_of_search import Suggestions
    from cfmkit.studies.suggest.proposal_making_and_judging import Proposal
    from cfmkit.studies.suggest.spec import SuggestBlock


RECORD_COLUMNS: Mapping[str, tuple[str, str]] = {
    "mean": ("", ""),
    "ripple": ("ratio", "1"),
    "hysteresis": ("ratio", "1"),
    "safety_factor": ("ratio", "1"),
    "across": ("length", "mm"),
    "along": ("length", "mm"),
    "depth": ("length", "mm"),
    "parts": ("count", ""),
    "life": ("ratio", "1"),
    "yield": ("ratio", "1"),
    "stiffening": ("ratio", "1"),
}
"""What is reported of each proposal: its dimension and the unit of the files."""


def numbers_in_border_units(found: Suggestions, proposal: Proposal) -> dict[str, Any]:
    """Return a proposal's numbers in border units, the mean in N or N*mm, by the name of its column."""
    numbers: dict[str, Any] = {}
    for name, value in proposal.numbers.items():
        dimension = found.request.kind if name == "mean" else RECORD_COLUMNS[name][0]
        numbers[name] = (
            None if value is None else int(value) if dimension == "count" else float(to_border(value, dimension))
        )
    return numbers


STATUS_BY_CODE = {
    ExitCode.OK: "complete",
    ExitCode.PARTIAL: "partial",
    ExitCode.NO_SOLUTION: "infeasible",
    ExitCode.BUG: "crashed",
}
"""What metrics.json says of each end."""


def folder_name(number: int, proposal: Proposal) -> str:
    """Return the folder of a proposal: ``1-vcfm-2-vs``."""
    words = "".join(letter if letter.isalnum() else "-" for letter in proposal.variant.lower())
    return f"{number}-{proposal.family}-" + "-".join(word for word in words.split("-") if word)


def as_json(found: Suggestions, block: SuggestBlock) -> dict[str, Any]:
    """Return what metrics.json and ``--json`` say."""
    return {
        "status": STATUS_BY_CODE[found.exit_code],
        "message": found.message,
        "suggest": block.model_dump(mode="json", exclude_unset=True, by_alias=True),
        "order": list(block.prefer),
        "proposals": [_record(found, one, number) for number, one in enumerate(found.proposals, 1)],
        "unjudged": [
            _record(found, one, number) for number, one in enumerate(found.unjudged, len(found.proposals) + 1)
        ],
        "near_misses": [_record(found, one) for one in found.near],
        "families": [
            {
                "family": one.family,
                "candidates": len(one.offer.candidates),
                "made": one.made,
                "proposals": sum(each.family == one.family for each in found.proposals),
                "reason": _reason(found, one.family, one.offer.reason),
                "nearest": dict(one.nearest),
            }
            for one in found.answers
        ],
        "warnings": list(_warnings(found)),
    }


def _reason(found: Suggestions, name: str, out_of_reach: str) -> str:
    if out_of_reach or any(one.family == name for one in found.listed):
        return out_of_reach
    untried = sum(len(one.offer.candidates) for one in found.answers if one.family == name and not one.made)
    if untried:
        return f"none of its {untried} candidates was tried in the time"
    near = [one.missed[0] for one in found.near if one.family == name]
    return (near or list(found.failed.get(name, ())) or [""])[0]


def _warnings(found: Suggestions) -> Iterator[dict[str, str]]:
    if found.late and found.listed:
        yield {
            "name": "search_cut_short",
            "message": "the time budget ended the search: increase it with --time-budget",
        }


def _record(found: Suggestions, one: Proposal, number: int | None = None) -> dict[str, Any]:
    about = {"family": one.family, "variant": one.variant, **numbers_in_border_units(found, one)}
    place = {} if number is None else {"folder": folder_name(number, one)}
    judged = {
        "verdict": one.verdict, "model": one.model, "unjudged": list(one.open), "warnings": list(one.warnings),
    }  # fmt: skip
    return about | place | judged | {"misses": list(one.missed), "notes": list(one.notes)}
