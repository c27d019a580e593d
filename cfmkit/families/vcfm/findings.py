"""Everything a mechanism of snap-through leaves and a preloaded spring can suffer from, by name."""

from __future__ import annotations

from cfmkit.results import Finding
from cfmkit.units import format_short

FINDINGS = {
    "no_negative_stiffness": "the leaves are too thick for their rise: no negative stiffness anywhere",
    "no_linear_region": "the leaves do not buckle: their negative stiffness is nowhere constant",
    "not_flat": "the positive and the negative stiffness do not cancel: the force is not constant",
    "force_reversal": "the force reaches zero within the window: the mechanism would not return",
    "bistable": "without the spring the leaves have a second stable pose; whether the whole returns is said",
    "overload": "the travel goes beyond the linear range, where the force rises steeply",
    "preload_out_of_range": "a preload at which no outward force is left, or nothing holds the shuttle",
    "stroke_unreachable": "the rise is too small for the stroke asked for",
    "asymmetric_buckling": "a shuttle that can turn lets the leaves buckle at half the load",
    "out_of_plane_buckling": "the leaves are so narrow that they would rather buckle out of the plane",
    "yield": "the stress allowed is passed",
    "imperfection": "waviness of the leaves as made spoils the flatness",
    "theory_range": "an angle or a travel beyond what the closed forms are good for",
    "unstable_branch": "the force shown is that of an unstable form, which a real leaf leaves",
    "truss_law": "the paper's law of a bar without bending: force and flatness are not those of the mechanism",
    "measured_contradiction": "the reported force and stiffness cannot both hold for these leaves",
    "too_thin": "the design needs a leaf thinner than can be made",
    "envelope": "the design does not fit into the room given",
    "stress_unreachable": "no leaf length brings the exact stress below the one allowed",
}


def finding(name: str, message: str, *cures: str) -> Finding:
    """Return a finding of this family; the name must be one that `FINDINGS` explains."""
    if name not in FINDINGS:
        raise KeyError(name)
    return Finding(name, message, cures)


def mm(value: float) -> str:
    """Return a length as the user reads it: four significant digits, in mm."""
    return format_short(value, "length")


def newton(value: float) -> str:
    """Return a force as the user reads it."""
    return format_short(value, "force")


def mpa(value: float) -> str:
    """Return a stress as the user reads it."""
    return format_short(value, "stress")


def rate(value: float) -> str:
    """Return a stiffness as the user reads it."""
    return format_short(value, "stiffness")


def percent(value: float) -> str:
    """Return a ratio as the user reads it."""
    return f"{100.0 * value:.3g} %"
