"""Values that may vary when a design is changed to raise its yield of good parts, and values with process errors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from cfmkit.designing.rounded_and_reported_values import range_about
from cfmkit.stock.material_and_part_spec import sheet_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.beam.mechanism_spec import Mechanism
    from cfmkit.families.beam.shaping.spec import Optimise
    from cfmkit.families.beam.spec import BeamSpec

_MAX_COEFFICIENT_TURN = 0.4
"""How far a coefficient of a shape may turn from the design [rad]: farther off it is another shape."""


def free(spec: BeamSpec, designed: BeamSpec) -> dict[str, tuple[float, float]]:
    """Return places of nodes and coefficients of shapes that were searched, or width or thickness that was rescaled."""
    design = spec.design
    if design is None:
        return {}
    if design.optimise is not None:
        return dict(_list_shape_ranges(design.optimise, designed))
    name = None if design.rescale is None else design.rescale.choose_dimension(sheet_of(designed.mechanism.part))
    if name is None or name == "size":
        return {}
    values = {path: designed.get_value(path) for path in _stated_paths(designed.mechanism, name)}
    return {path: range_about(value) for path, value in values.items() if isinstance(value, float)}


def _stated_paths(mechanism: Mechanism, key: Literal["thickness", "width"]) -> Iterator[str]:
    """Yield the paths of the values that beams have: the mechanism's, if any has no other, and their own."""
    if any(getattr(beam, key) is None for beam in mechanism.beams.values()):
        yield f"mechanism.{key}"
    for name, beam in mechanism.beams.items():
        if getattr(beam, key) is not None:
            yield f"mechanism.beams.{name}.{key}"


def _list_shape_ranges(wanted: Optimise, designed: BeamSpec) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield what a search of shapes may vary, with the ranges of the search or as far as a shape stays what it is."""
    for name, axis, (low, high) in wanted.list_ranges():
        yield f"mechanism.nodes.{name}.at.{axis}", (float(low), float(high))
    limit, reach = float(wanted.coefficient_limit), _MAX_COEFFICIENT_TURN
    for name in wanted.beams if wanted.beams is not None else designed.mechanism.beams:
        shape = designed.mechanism.beams[name].shape
        for k, value in enumerate(getattr(shape, "coefficients", ())):
            if k:  # the first turns with the chord
                ends = max(-limit, float(value) - reach), min(limit, float(value) + reach)
                yield f"mechanism.beams.{name}.shape.coefficients.{k}", ends


def errors(spec: BeamSpec) -> dict[str, str]:
    """Return which values a process errs in, and whether in thickness or in position: thicknesses and free nodes."""
    paths = _stated_paths(spec.mechanism, "thickness")
    errors = {path: "thickness" for path in paths if isinstance(spec.get_value(path), float)}
    for name, node in spec.mechanism.nodes.items():
        if node.support == "free":
            errors |= {f"mechanism.nodes.{name}.at.{axis}": "position" for axis in (0, 1)}
    return errors
