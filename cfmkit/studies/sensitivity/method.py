"""A method of a sensitivity study: how many points it takes, what it does with them, and what is shown of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

from cfmkit.specs.sensitivity_methods import METHOD_NAMES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cfmkit.studies.sensitivity.evaluation import Evaluator


@dataclass(frozen=True)
class Method:
    """Record of a method."""

    run: Callable[[Any, Evaluator], Any]  # from the `Setup`, which has this record, to `Findings`
    count_points: Callable[[int, int, int], int]  # of samples, parameters and groups of them; none is drawn again
    indices: tuple[str, ...]  # on the page; the first that a parameter has says in which order
    # end of a file name -> function of `cfmkit.plots.sensitivity` that draws one metric
    pictures: Mapping[str, str] = field(default_factory=dict)
    draws_parts: bool = False  # whether its samples are manufactured parts
    by_role: bool = False  # whether all points of a role are computed before those of the next


def method_named(name: str) -> Method:
    """Return the method of one of the names in `METHOD_NAMES`: that of the module beside this one with that name."""
    method: Method = import_module(f".{METHOD_NAMES[name].name}", __package__).SENSITIVITY_METHOD
    return method
