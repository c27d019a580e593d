"""The published cam prototype as a specification, and short ways to run it; lengths in mm, forces in N."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import cfmkit
from cfmkit import Run
from cfmkit.families import family
from cfmkit.families.cam import assemble, forces

if TYPE_CHECKING:
    from cfmkit import Design, Result
    from cfmkit.families.cam import CamSpec

MM = 1e-3

PUBLISHED = cfmkit.loads(
    """
cfmkit: 1
family: cam
mechanism:
  brace_length: 200 mm
  rest_half_width: 68 mm
  roller_radius: 16 mm
  springs: {stiffness: 0.6825 N/mm, count: 2}
  rolling_friction: 0
  masses: {slider: 0.068 kg, brace: 0.077 kg, roller: 0.38 kg}
  profile: {force_constant: 9.058 mm, stroke: 240 mm}
analysis: {points: 481}
"""
)
"""Table 1 of the paper with the measured springs 1 and 2 of Table 2 (K = 1.365 N/mm)."""


def cam(**changes: Any) -> CamSpec:
    """Return the published cam with changes: ``profile__friction=0.002`` is ``mechanism.profile.friction``."""
    return PUBLISHED.replace({_path(key): value for key, value in changes.items()}) if changes else PUBLISHED


def _path(key: str) -> str:
    path = key.replace("__", ".")
    return path if path.split(".")[0] in ("analysis", "design", "name") else f"mechanism.{path}"


def fixed(spec: CamSpec, **changes: Any) -> CamSpec:
    """Return the spec with its cam written out as a part, then changed: the same cam, other parts around it."""
    mechanism = spec.mechanism
    part = {
        "profile__brace_length": mechanism.brace_length,
        "profile__rest_half_width": mechanism.rest_half_width,
        "profile__roller_radius": mechanism.roller_radius,
    }
    return spec.replace({_path(key): value for key, value in (part | changes).items()})


def analyze(spec: CamSpec) -> Result:
    return family("cam").analyze(spec, Run())


def design(spec: CamSpec) -> Design:
    found = family("cam").design.make
    assert found is not None
    return found(spec, Run())


@dataclass(frozen=True)
class At:
    """The mechanism at some travels: exact there, with no grid between."""

    assembly: Any
    x: np.ndarray
    y: np.ndarray
    slope: np.ndarray
    force: np.ndarray
    contact: np.ndarray
    brace: np.ndarray
    on_corner: np.ndarray


def at(spec: CamSpec, travel: Any, friction: float | None = None) -> At:
    """Return states and forces at travels [m] on the way up with `friction` (negative: down; default: the spec's)."""
    assembly = assemble(spec)
    states = assembly.track.states(assembly.track.start + np.atleast_1d(np.asarray(travel, dtype=float)))
    mu = spec.mechanism.rolling_friction if friction is None else friction
    found = forces(states, assembly.loads, mu)
    return At(assembly, states.x, states.y, states.slope, found.slider, found.contact, found.brace, states.on_corner)


def names(result: Result) -> list[str]:
    """Return the names of the findings."""
    return [found.name for found in result.warnings]


def message(result: Result, name: str) -> str:
    """Return the message of one finding; there must be exactly one of that name."""
    (found,) = [found for found in result.warnings if found.name == name]
    return found.message


def take_gravity_of_the_note(monkeypatch):
    """Compute with the 9.81 m/s^2 for which the reference note's numbers hold, not with the standard value."""
    for module in ("machine_from_spec", "scalar_results"):
        monkeypatch.setattr(f"cfmkit.families.cam.dynamics.{module}.STANDARD_GRAVITY", 9.81)


def design_exactly(spec):
    """Return the specification that the family designs, before its digits are those of the process."""
    found = family(spec.family).design.make(spec, Run())
    assert found.spec is not None, found.message
    return found.spec
