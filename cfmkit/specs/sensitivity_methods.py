"""Methods of a sensitivity study by name, for specifications, commands and messages: what each is and counts.

What a method does is `SENSITIVITY_METHOD` in the module of its name, which studies look up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal


@dataclass(frozen=True)
class MethodName:
    """A method as users name it."""

    name: str  # in `sensitivity.method` and `--method`
    phrase: str  # what it is, in a few words
    samples: str  # what `sensitivity.samples` is the number of; empty: it chooses its own steps
    default_samples: int
    # one of `SAMPLE_KINDS`, or "random": how it draws unless `sensitivity.sampling` says; empty: its points are its own
    sampling: str = ""


METHOD_NAMES: dict[str, MethodName] = {
    method.name: method
    for method in (
        MethodName("oat", "one at a time", "points per parameter", 11),
        MethodName("local", "gradients", "", 2),
        MethodName("morris", "screening", "trajectories", 20),
        MethodName("sobol", "indices of variance", "base samples", 256, "sobol"),
        MethodName("tolerance", "Monte Carlo over tolerances: the yield", "parts", 1000, "random"),
        MethodName("inverse", "the tolerances that a yield needs", "parts", 200, "random"),
    )
}
"""Every method, in the order of the documentation. A new one is its module and its line here."""

if TYPE_CHECKING:
    MethodWord = str
else:
    MethodWord = Literal[tuple(METHOD_NAMES)]


def describe_methods() -> str:
    """Return the methods, each with what it is."""
    *others, last = (f"{method.name} ({method.phrase})" for method in METHOD_NAMES.values())
    return f"{', '.join(others)} or {last}"


def describe_samples() -> str:
    """Return what the number of samples counts, method by method."""
    return "; ".join(f"{method.name}: {method.samples}" for method in METHOD_NAMES.values() if method.samples)
