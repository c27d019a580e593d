"""A mechanism that cannot exist, and targets that no mechanism meets: with the finding that says why."""

from __future__ import annotations

from functools import wraps
from typing import TYPE_CHECKING, ParamSpec

from cfmkit.errors import SolutionError
from cfmkit.results import Design, Finding, Result, Status

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cfmkit.specs.spec import Spec

Given = ParamSpec("Given")


class CannotBuild(SolutionError):
    """The mechanism cannot exist as described; carries the finding that says why."""

    def __init__(self, reason: Finding) -> None:
        self.finding = reason
        super().__init__(reason.message)

    def __reduce__(self) -> tuple[type[CannotBuild], tuple[Finding]]:
        """Return what pickling needs: worker processes hand these errors back."""
        return type(self), (self.finding,)


class Infeasible(Exception):
    """Nothing meets the targets of a design; carries the finding that says why, and what would be feasible."""

    def __init__(self, reason: Finding, nearest: Mapping[str, str] | None = None) -> None:
        """Keep the reason and the nearest feasible values by path."""
        self.finding, self.nearest = reason, dict(nearest or {})
        super().__init__(reason.message)


def refusals_answered(design: Callable[Given, Design]) -> Callable[Given, Design]:
    """Return a design function whose answer is the reason where it raises `Infeasible` or `CannotBuild`."""

    @wraps(design)
    def answer(*arguments: Given.args, **options: Given.kwargs) -> Design:
        try:
            return design(*arguments, **options)
        except Infeasible as problem:
            return no_design(problem.finding, problem.nearest)
        except CannotBuild as problem:
            return no_design(problem.finding)

    return answer


def no_result(spec: Spec, reason: Finding) -> Result:
    """Return the result of a mechanism that cannot exist, with the reason."""
    return Result(spec, Status.NO_EQUILIBRIUM, reason.message, warnings=(reason,))


def no_design(reason: Finding, nearest: Mapping[str, str] | None = None) -> Design:
    """Return the outcome of targets that cannot be met, with the reason and the nearest feasible values by path."""
    return Design(None, Status.INFEASIBLE, reason.message, nearest_feasible=dict(nearest or {}), warnings=(reason,))
