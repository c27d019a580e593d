"""Why there is no mechanism: what a model raises, and what the user gets for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.errors import SolutionError
from cfmkit.results import Result, Status

if TYPE_CHECKING:
    from cfmkit.results import Finding
    from cfmkit.spec import Spec


class CannotBuild(SolutionError):
    """The mechanism cannot exist as described; carries the finding that says why."""

    def __init__(self, found: Finding) -> None:
        """Keep the finding."""
        self.finding = found
        super().__init__(found.message)

    def __reduce__(self) -> tuple[type[CannotBuild], tuple[Finding]]:
        """Return what pickling needs: worker processes hand these errors back."""
        return type(self), (self.finding,)


def no_result(spec: Spec, found: Finding) -> Result:
    """Return the result of a mechanism that cannot exist, with the reason."""
    return Result(spec, Status.NO_EQUILIBRIUM, found.message, warnings=(found,))
