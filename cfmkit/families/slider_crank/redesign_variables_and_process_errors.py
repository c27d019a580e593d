"""Values that may vary when a design is changed to raise its yield of good parts, and values with process errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.designing.rounded_and_reported_values import range_about
from cfmkit.families.slider_crank.printed.design import DEFAULT_THICKNESS
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES
from cfmkit.stock.material_and_part_spec import sheet_of

if TYPE_CHECKING:
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


def free(
    spec: SliderCrankSpec,  # with the `design` block
    designed: SliderCrankSpec,  # what came out
) -> dict[str, tuple[float, float]]:
    """Return the values that a redesign may vary, with ranges: thicknesses and width of a strip, or spring rates.

    The width of a strip from a sheet stays.
    """
    wanted, beam = spec.design.beam if spec.design else None, designed.mechanism.beam
    if wanted is None or beam is None:
        return _rates(spec, designed)
    ranges_of_paths: dict[str, tuple[float, float]] = {}
    if isinstance(beam.thickness, tuple):
        ranges = wanted.thicknesses or (wanted.thickness or DEFAULT_THICKNESS,) * len(beam.thickness)
        if len(ranges) == len(beam.thickness):
            ranges_of_paths |= {f"mechanism.beam.thickness.{k}": ends for k, ends in enumerate(ranges)}
    else:
        ranges_of_paths["mechanism.beam.thickness"] = wanted.thickness or DEFAULT_THICKNESS
    if isinstance(wanted.width, tuple) and sheet_of(designed.mechanism.part) is None:
        ranges_of_paths["mechanism.beam.width"] = wanted.width
    return {path: (float(low), float(high)) for path, (low, high) in ranges_of_paths.items() if low < high}


def _rates(spec: SliderCrankSpec, designed: SliderCrankSpec) -> dict[str, tuple[float, float]]:
    """Return the rates that a design chose, up to their limits; those of bought springs stay."""
    design, springs = spec.design, designed.mechanism.springs
    if design is None or design.catalogue or springs.bought:
        return {}
    ranges = {}
    for joint in design.springs:
        rate, most = getattr(springs, joint), getattr(design.max_rates, joint, None)
        if rate > 0:
            ranges[f"mechanism.springs.{joint}"] = range_about(float(rate), high=most)
    return {path: ends for path, ends in ranges.items() if ends[0] < ends[1]}


def errors(spec: SliderCrankSpec) -> dict[str, str]:
    """Return the kind of process error of each value: strip thickness, positions of holes, spring rates, friction."""
    mechanism = spec.mechanism
    if mechanism.beam is not None:
        return {"mechanism.beam.offset": "thickness"} if spec.fidelity == "beam" else {}
    if mechanism.flexures is not None:
        return {}
    rubbing = [name for name in ("pins", "guide") if getattr(mechanism, name) is not None][:1]
    friction = {f"mechanism.{name}.friction": "friction" for name in rubbing}
    lengths = {name: getattr(mechanism, name) for name in ("crank_length", "stretched_position", "offset")}
    errors = {f"mechanism.{name}": "position" for name, value in lengths.items() if isinstance(value, float)}
    rates = zip(JOINT_NAMES, mechanism.springs.rates, strict=True)
    return errors | {f"mechanism.springs.{name}": "rate" for name, rate in rates if rate > 0.0} | friction
