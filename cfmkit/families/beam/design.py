"""Design of a beam mechanism: `optimise` searches its shape (`shaping`), `rescale` its size, section or material.

`rescale` keeps the form of the force curve [Lan, eq. 6 and sec. 2.3]: F L^2 / EI is the same for all mechanisms of one
shape whose beams bend without stretching, at the same displacement per size. Stretching breaks that: it goes with
(thickness / size)^2. The value that is free is therefore found by Eq. 6 and corrected with the model of the
specification until the force is the one wanted.

[Lan] C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism (2010), eq. 6 and sec. 2.3.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.errors import InputError
from cfmkit.families.beam.finding_names import finding
from cfmkit.families.beam.model import solve
from cfmkit.families.beam.network_from_spec import change_at
from cfmkit.families.beam.path_ending import ending_of
from cfmkit.families.beam.scalar_results import force_at_end, number_of
from cfmkit.families.rows import with_values
from cfmkit.results import Design, Status
from cfmkit.specs.units import Place, TravelShare, format_short
from cfmkit.stock.material_and_part_spec import sheet_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.families.beam.mechanism_spec import Mechanism
    from cfmkit.families.beam.network_elements_spec import BeamMaterial, Thickness
    from cfmkit.families.beam.spec import BeamSpec, Rescale
    from cfmkit.families.run_control import Run
    from cfmkit.results import Finding


def design(spec: BeamSpec, run: Run) -> Design:
    """Return a complete specification that does what the `design` block asks for, or why there is none."""
    if spec.design is not None and spec.design.rescale is not None:
        return rescale(spec, spec.design.rescale)
    if spec.design is not None and spec.design.optimise is not None:
        from cfmkit.families.beam.shaping.design import optimise_shape

        return optimise_shape(spec, spec.design.optimise, run)
    return Design(None, Status.INVALID, "this spec has no 'design' block: add 'rescale' or 'optimise'")


FORCE_EXPONENTS = {"width": 1.0, "thickness": 3.0, "size": -2.0}  # how the force goes with what may be free, by Eq. 6.
FORCE_RTOL = 1e-9
MAX_ROUNDS = 12
"""Of corrections, of which `configs/beam_rescaled.yaml` needs two; of travels, each a quarter longer: the last is 14.6
times the first."""
TRAVEL_STEP = 1e-5  # travel that follows from the stress is rounded down to whole hundredths of a millimetre [m]


def rescale(spec: BeamSpec, wanted: Rescale) -> Design:
    """Return the specification with the changes made and the force wanted reached, or why it cannot be."""
    wanted = wanted.model_copy(update={"free": wanted.choose_dimension(sheet_of(spec.mechanism.part))})
    changed = changed_spec(spec, wanted)
    validity = _report_error_of_law(spec, wanted)
    for _ in range(MAX_ROUNDS):
        before = changed
        if wanted.to_allowable_stress:
            ended, why = _to_allowable_stress(changed)
            if ended is None:
                return Design(None, Status.INFEASIBLE, why)
            changed = ended
        force = _force(changed)
        if force is None:
            why = "the mechanism has no force at the end of its window (analysis.window) to scale"
            return Design(None, Status.NO_EQUILIBRIUM, why)
        if wanted.force is None:
            break
        again, reached = _correct_value(changed, wanted, force)
        if reached is None:
            why = f"no mechanism.{wanted.free} gives design.rescale.force = {format_short(wanted.force, 'force')}"
            return Design(None, Status.INFEASIBLE, why)
        changed = again
        if changed == before or not wanted.to_allowable_stress:
            break
    return Design(
        changed, Status.COMPLETE, _report_changes(spec, changed), warnings=(*validity, *_report_overstress(changed))
    )


def _force(spec: BeamSpec) -> float | None:
    """Return the force at the end of the window [N]."""
    solution = solve(spec)
    force = force_at_end(solution) if len(solution.motion) > 1 else None
    return force if force is not None and np.isfinite(force) and force != 0 else None


def _correct_value(spec: BeamSpec, wanted: Rescale, force: float) -> tuple[BeamSpec, float | None]:
    """Return the specification whose free value gives the force wanted, and that force."""
    target = math.copysign(wanted.force or 0.0, force)
    exponent = FORCE_EXPONENTS[wanted.free]
    for _ in range(MAX_ROUNDS):
        if abs(force / target - 1) <= FORCE_RTOL:
            return spec, force
        if not force / target > 0:
            break
        factor = (target / force) ** (1 / exponent)
        spec = _scale(spec, wanted.free, factor)
        again = _force(spec)
        if again is None:
            break
        exponent = _measure_exponent(force, again, factor, exponent)
        force = again
    return spec, None


def _measure_exponent(before: float, after: float, factor: float, expected: float) -> float:
    """Return how the force went with what was scaled: wide beams, stretch and shear bend the law a little."""
    if not after / before > 0 or factor == 1.0:
        return expected
    exponent = math.log(after / before) / math.log(factor)
    return exponent if 0.5 < exponent / expected < 2.0 else expected


def changed_spec(spec: BeamSpec, wanted: Rescale) -> BeamSpec:
    """Return the specification with size, material, thickness and width as wanted."""
    if wanted.material is not None:
        spec = change_at(spec, "mechanism.material", lambda _: wanted.material)
        spec = change_at(spec, "mechanism.beams.*.material", lambda _: None)
    for name, value in _sizes(spec.mechanism).items():
        asked = getattr(wanted, name)
        if asked is not None and abs(asked / value - 1) > FORCE_RTOL:
            spec = _scale(spec, name, asked / value)
    return spec


def _sizes(mechanism: Mechanism) -> dict[str, float]:
    """Return what a rescaling may change, by its key: size, largest thickness and largest width of the beams [m]."""
    return {
        "size": size_of(mechanism),
        "thickness": max(max(mechanism.list_thicknesses(name)) for name in mechanism.beams),
        "width": max(mechanism.collect_beam_values("width").values()),
    }


def _modulus(mechanism: Mechanism) -> float:
    """Return the modulus of the beams, which are of one material [Pa]."""
    material: BeamMaterial = next(iter(mechanism.collect_beam_values("material").values()))
    return material.modulus


def size_of(mechanism: Mechanism) -> float:
    """Return L_x, the distance of the outermost nodes along x; along y where they have one x [m]."""
    spans: list[float] = np.ptp([node.at for node in mechanism.nodes.values()], axis=0).tolist()
    return next(span for span in spans if span > 0)


LENGTHS_IN_PLANE = (
    "mechanism.nodes.*.at",
    *(f"mechanism.beams.*.{key}" for key in ("start_offset", "end_offset", "shape.length", "shape.rise")),
    *(f"mechanism.copies.{key}" for key in ("mirror", "layer_pitch")),
    *(f"mechanism.part.{key}" for key in ("pad", "holes.*.at")),
    *(f"mechanism.part.frame.{key}" for key in ("wall", "shuttle", "ground", "clearance", "inside")),
    *(f"analysis.{key}" for key in ("travel", "window", "reference", "surface.preload")),
    "requirements.*.over",
)
"""Lengths of a mechanism that go with its size; screws, tools and a surface that is followed stay as they are."""


def _scale(spec: BeamSpec, name: str, factor: float) -> BeamSpec:
    """Return the specification with its width, thickness or size times a factor."""
    scale: Callable[[Any, float], Any] = _scale_lengths if name == "size" else _scale_thickness
    paths = LENGTHS_IN_PLANE if name == "size" else (f"mechanism.{name}", f"mechanism.beams.*.{name}")
    for path in paths:
        spec = change_at(spec, path, lambda value: scale(value, factor))
    return spec


def _scale_thickness(thickness: Thickness, factor: float) -> Thickness:
    if isinstance(thickness, tuple):
        return tuple((place, value * factor) for place, value in thickness)
    return thickness * factor


def _scale_lengths(value: Any, factor: float) -> Any:
    """Return a length, or lengths, times a factor; a share of the travel, which is scaled itself, stays."""
    if isinstance(value, tuple):
        return tuple(_scale_lengths(item, factor) for item in value)
    if isinstance(value, TravelShare):
        return value
    return Place(value * factor, value.dimension) if isinstance(value, Place) else value * factor


def _to_allowable_stress(spec: BeamSpec) -> tuple[BeamSpec | None, str]:
    """Return the specification with travel and window up to where the stress reaches the allowable one, or why not."""
    place, why = _reaches_allowable_stress(spec)
    if place is None:
        return (None, why) if why else (spec, "")
    end = _round_down(place)
    ended = _with_travel_and_window(spec, 0.0, end)
    start = number_of("range_start", solve(ended))
    if start is not None and abs(_round_up(start)) < abs(end):
        ended = _with_travel_and_window(ended, _round_up(start), end)
    return ended, ""


def _reaches_allowable_stress(spec: BeamSpec) -> tuple[float | None, str]:
    """Return where the stress first reaches the allowable one, on longer and longer travels [m]; None, and why, if not.

    The window, which is to be replaced and may end beyond the path, plays no part. Nothing is said of a curve that has
    no force to scale either.
    """
    travel, more = spec.extent, ": state a longer 'analysis.travel'"
    for number in range(MAX_ROUNDS + 1):
        try:
            solution = solve(with_values(spec, {"analysis.travel": Place(travel), "analysis.window": None}))
        except InputError:
            if number == 0:
                raise
            more = ", and a longer one would tear beams"
            break
        if (place := number_of("stress_limit_displacement", solution)) is not None:
            return place, ""
        if len(solution.keep) < 2:
            return None, ""
        if abs(solution.motion[-1]) < abs(travel) * (1 - 1e-9):
            why = ending_of(solution).message
            return None, f"the stress does not reach the allowable one before the path ends: {why}"
        looked_at, travel = travel, 1.25 * travel
    allowable = format_short(solution.assembly.allowable_stress or math.nan, "stress")
    where = format_short(looked_at, "length")
    return None, f"the stress does not reach the allowable one, {allowable}, within a travel of {where}{more}"


def _round_down(value: float) -> float:
    """Return a place rounded to a hundredth of a millimetre towards rest, as a short decimal."""
    return math.copysign(round(math.floor(abs(value) / TRAVEL_STEP + 1e-6) * TRAVEL_STEP, 9), value)


def _round_up(value: float) -> float:
    """Return the same rounded away from rest."""
    return math.copysign(round(math.ceil(abs(value) / TRAVEL_STEP - 1e-6) * TRAVEL_STEP, 9), value)


def _with_travel_and_window(spec: BeamSpec, start: float, end: float) -> BeamSpec:
    window = tuple(Place(place) for place in sorted((start, end)))
    return with_values(spec, {"analysis.travel": Place(end), "analysis.window": window})


def _report_error_of_law(spec: BeamSpec, wanted: Rescale) -> list[Finding]:
    """Return by how much Eq. 6 alone is off where beams stretch: at the end of the window as given, times the size."""
    if spec.fidelity == "inextensible" or (force := _force(spec)) is None:
        return []
    changed = changed_spec(spec, wanted)
    predicted = force * _force_ratio(spec.mechanism, changed.mechanism)
    if wanted.force is not None:
        target = math.copysign(wanted.force, predicted)
        changed = _scale(changed, wanted.free, (target / predicted) ** (1 / FORCE_EXPONENTS[wanted.free]))
        predicted = target
    reached = _force(changed)
    if reached is not None and abs(reached / predicted - 1) <= FORCE_RTOL:
        return []
    message = "Eq. 6 is exact only for beams that do not stretch"
    if reached is not None:
        message += f": by it alone the force would be off by {100 * (reached / predicted - 1):+.2g} %"
    return [finding("rescale_approximate", message + ("; corrected" if wanted.force is not None else ""))]


def _force_ratio(old: Mechanism, new: Mechanism) -> float:
    """Return the force of one mechanism over that of another by Eq. 6: E b h^3 / L_x^2."""
    before, after = _sizes(old), _sizes(new)
    sizes = [(after[name] / before[name]) ** FORCE_EXPONENTS[name] for name in ("width", "thickness", "size")]
    return float(_modulus(new) / _modulus(old) * math.prod(sizes))


def _report_overstress(spec: BeamSpec) -> list[Finding]:
    """Return from where on the stress is too large after the change, in words."""
    solution = solve(spec)
    allowable, along = solution.assembly.allowable_stress, solution.along
    stress, place = (number_of(name, solution) for name in ("stress_at_end", "stress_limit_displacement"))
    if stress is None or allowable is None or place is None:
        return []
    if stress <= allowable and along.sense * place >= along.end:
        return []
    limit = f"the allowable stress, {format_short(allowable, 'stress')}, is reached at {format_short(place, 'length')}"
    message = f"the stress at the end of the window is {format_short(stress, 'stress')}; {limit}"
    return [finding("rescale_stress", message, "design.rescale.to_allowable_stress=true")]


def _report_changes(old: BeamSpec, new: BeamSpec) -> str:
    """Return what was changed, in one sentence."""
    changes = []
    now = _sizes(new.mechanism)
    for name, before in _sizes(old.mechanism).items():
        after = now[name]
        if abs(after / before - 1) > FORCE_RTOL:
            changes.append(f"{name} {format_short(before, 'length')} -> {format_short(after, 'length')}")
    before, after = (_modulus(part.mechanism) for part in (old, new))
    if before != after:
        changes.append(f"E {format_short(before, 'stress')} -> {format_short(after, 'stress')}")
    return "rescaled: " + ", ".join(changes) if changes else "nothing to change"
