"""Findings made by name, numbers as users read them, and errors that carry a finding: no mechanism, no design."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import wraps
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from cfmkit.errors import SolutionError, UsageError
from cfmkit.results import Design, Finding, Result, Status
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from cfmkit.specs.spec import Spec


Given = ParamSpec("Given")
Entry = TypeVar("Entry")


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


TOO_SOFT = 0.01  # share of the energy of bending above which wide beams that are solved as narrow ones are reported
MIN_PLANE_STRESS_RATIO = 3.0
"""Width over thickness up to which plane stress is within about 1 % of a solid in three dimensions (docs/solid.md)."""


def join_tables(kind: str, *tables: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return tables by name as one; raises UsageError if one name has two entries, of a kind as "finding"."""
    joined: dict[str, Entry] = {}
    for table in tables:
        if twice := [name for name, entry in table.items() if joined.get(name, entry) != entry]:
            raise UsageError(f"two {kind}s are called {twice[0]!r}: one of them needs another name")
        joined |= table
    return joined


@dataclass(frozen=True)
class Finder:
    """Maker of the findings of one family; `KeyError` for a name that the family does not explain.

    Examples
    --------
    >>> finding = Finder({"too_thin": "a leaf thinner than can be made"})
    >>> finding("too_thin", "0.1 mm: below 0.3 mm").name
    'too_thin'
    """

    meanings: Mapping[str, str]  # by name

    def __call__(self, name: str, message: str, *cures: str | tuple[str, ...], short: str = "") -> Finding:
        """Return a finding of the family."""
        if name not in self.meanings:
            raise KeyError(name)
        return Finding(name, message, cures, short)

    def infeasible(self, name: str, message: str, nearest: Mapping[str, str] | None = None) -> Infeasible:
        """Return the error of targets that nothing meets, with the nearest feasible values by path."""
        return Infeasible(self(name, message), nearest)

    def cannot_build(self, name: str, message: str) -> CannotBuild:
        """Return the error of a mechanism that cannot exist as described."""
        return CannotBuild(self(name, message))


def sharp_inside(
    fillet: float,  # requested radius [m]
    notes: Sequence[str],  # one for each corner that no such fillet fits, with its place
) -> str:
    """Return what is wrong with the inside corners of a part that is solved as a solid; empty if all are round.

    Examples
    --------
    >>> sharp_inside(1e-3, ["no fillet of 1 mm fits the inside corner at (0, 2) mm"] * 3)
    'no fillet of 1 mm fits the inside corner at (0, 2) mm; 2 others are sharp, too: the stress there has no value'
    """
    if fillet == 0.0:
        return "without fillets the stress in inside corners has no value"
    if not notes:
        return ""
    more = len(notes) - 1
    others = f"; {more} other{'s are' if more > 1 else ' is'} sharp, too" if more else ""
    return f"{notes[0]}{others}: the stress there has no value"


def mm(value: float) -> str:
    """Return a length [m] with four significant digits, in mm."""
    return format_short(value, "length")


def deg(value: float) -> str:
    """Return an angle [rad] with four significant digits, in degrees."""
    return format_short(value, "angle")


def newton(value: float) -> str:
    """Return a force with four significant digits, in N."""
    return format_short(value, "force")


def mpa(value: float) -> str:
    """Return a stress [Pa] with four significant digits, in MPa."""
    return format_short(value, "stress")


def rate(value: float) -> str:
    """Return a stiffness [N/m] with four significant digits, in N/mm."""
    return format_short(value, "stiffness")


def percent(value: float) -> str:
    """Return a ratio with three significant digits, in percent."""
    return format_short(value, "ratio", 3)


def describe_wide_beam(share: float, where: str) -> str:
    """Return what the finding `wide_beam` says: by what share of the energy, and where; nothing of a small one."""
    if not share > TOO_SOFT:
        return ""
    return (
        f"the anticlastic bending of beams that are wide for their thickness is suppressed: bending takes about "
        f"{percent(share)} more energy {where}, and the force rises by at least the same share; clamped ends "
        "add to it"
    )


def wide_beam_in_short(share: float) -> str:
    """Return the same in short."""
    return f"force at least {percent(share)} larger: anticlastic bending is suppressed"


def describe_wide_part(width: float, thickness: float, poisson_ratio: float, wide_beams: bool) -> str:
    """Return what the finding `wide_beam` says of a part that is solved in plane stress; nothing of a narrow one.

    Where `wide_beams` is requested, it also says that this changes nothing here.

    Examples
    --------
    >>> describe_wide_part(10e-3, 1e-3, 0.35, False)
    'the force is between plane stress, as solved, and plane strain, 14 % more (10 mm wide, 1 mm thick)'
    """
    if not width > MIN_PLANE_STRESS_RATIO * thickness:
        return ""
    more = percent(1.0 / (1.0 - poisson_ratio**2) - 1.0)
    return (
        f"the force is between plane stress, as solved, and plane strain, {more} more ({mm(width)} wide, "
        f"{mm(thickness)} thick)"
        + ("; mechanism.wide_beams counts in beam models only and changes neither" if wide_beams else "")
    )


def format_at_most(length: float) -> str:
    """Return a length [m] rounded down to four digits: as good as feasible, and feasible."""
    return _round_digits(length, math.floor)


def format_at_least(length: float) -> str:
    """Return a length [m] rounded up to four digits.

    Examples
    --------
    >>> format_at_least(0.0144645), format_at_most(0.1693794)
    ('14.47 mm', '169.3 mm')
    """
    return _round_digits(length, math.ceil)


def _round_digits(length: float, round_to: Callable[[float], int]) -> str:
    if length < 1e-300:
        return "0 mm"
    digits = 3 - math.floor(math.log10(length * 1e3))
    return f"{round_to(length * 1e3 * 10.0**digits) / 10.0**digits:.4g} mm"
