"""The drawing of a part on a sheet of paper, with what is stated or assumed of its tolerances."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cfmkit.errors import GeometryError
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cfmkit.export.contours import Drawing
    from cfmkit.specs.spec import Spec


def part_on_paper(drawing: Drawing, spec: Spec) -> Figure:
    """Return the dimensioned drawing of a part, with the tolerances that are stated or assumed for it."""
    from cfmkit.plots.workshop_drawing import TitleBlock, drawing_figure
    from cfmkit.store import stable_hash
    from cfmkit.studies.parts.assumed_errors import accuracy_of
    from cfmkit.studies.stock_and_digits import decimals_of

    stated, assumed = stated_tolerances(spec), assumed_tolerances(spec)
    reported = (*assumed[:1], *stated, *assumed[-1:]) if stated else assumed  # stated ones replace those of the process
    reported = (*reported, *how_to_print(drawing, spec))
    drawing = replace(drawing, notes=(*drawing.notes, *list_stops(spec), *how_to_fasten(spec)))
    # a date would make other bytes of the same part; the revision changes with any value of the mechanism
    revision = stable_hash(spec.model_dump(mode="json", include={"family", "mechanism"}))[:8]
    block = TitleBlock(revision, weight_in_words(drawing, spec), decimals_of(accuracy_of(spec)))
    return drawing_figure(drawing, spec.name or f"a {spec.family} mechanism", reported, block)


def how_to_print(drawing: Drawing, spec: Spec) -> tuple[str, ...]:
    """Return how a part lies on the bed of a printer, and of how many strands its leaves are; nothing if it is cut."""
    from cfmkit.plots.workshop_drawing import thicknesses
    from cfmkit.stock.printing import strands_in_words
    from cfmkit.studies.parts.assumed_errors import accuracy_of

    accuracy = accuracy_of(spec)
    if accuracy.name != "fdm":
        return ()
    material = getattr(getattr(spec, "mechanism", None), "material", None)
    sizes = dict.fromkeys(round(section.thickness, 7) for section in thicknesses(drawing))
    if getattr(material, "layers", None) == "across":
        laid = "print standing: layers across the leaves, whose strength is that between layers"
    else:
        laid = "print lying flat: layers in the plane of this sheet" + (", strands along the leaves" if sizes else "")
    return (laid, *(strands_in_words(size, accuracy.least_feature) for size in list(sizes)[:3]))


def list_stops(spec: Spec) -> tuple[str, ...]:
    """Return where rigid end stops have to stand, which are no part of what is cut."""
    stops: Any = getattr(getattr(spec, "mechanism", None), "stops", None) or {}
    if hasattr(stops, "upper"):
        ends = {"lower": stops.lower, "upper": stops.upper}
    else:
        rigid = {name: stop.gap for name, stop in stops.items() if stop.stiffness is None}
        ends = {name: gap[-1] if isinstance(gap, tuple) else gap for name, gap in rigid.items()}
    return tuple(
        f"stop '{name}': {format_short(end, 'length', 6)} along the motion from the unloaded pose; not drawn"
        for name, end in ends.items()
        if end
    )


def how_to_fasten(spec: Spec) -> tuple[str, ...]:
    """Return how a part that bends is held if it has no holes for screws; nothing if it has some."""
    part: Any = getattr(getattr(spec, "mechanism", None), "part", None)
    if getattr(part, "screws", None) is not None or not spec.out_of_plane_widths:
        return ()
    return ("no screw holes: clamp or bond what stands, or state 'part.screws'",)


def weight_in_words(drawing: Drawing, spec: Spec) -> str:
    """Return the mass of what is cut, by the density of its named material, or what is missing to know it."""
    from cfmkit.export.extrusion import volume
    from cfmkit.stock import MATERIALS_BY_NAME

    mechanism: Any = getattr(spec, "mechanism", None)
    material = getattr(mechanism, "material", None) or getattr(getattr(mechanism, "contact", None), "material", None)
    reference = MATERIALS_BY_NAME.get(getattr(material, "name", None) or "")
    if reference is None:
        return "not known: no named material"
    try:
        mass = reference.density * volume(drawing)
    except GeometryError:
        return "not known: no thickness"
    return f"{1e3 * mass:.3g} g, cut part"


def stated_tolerances(spec: Spec) -> tuple[str, ...]:
    """Return a line for each tolerance that the specification's design states."""
    design = getattr(spec, "design", None)
    made = {} if design is None else design.tolerances_of(spec)[0]
    return tuple(f"{path}: {_spread(stated)}" for path, stated in made.items())


def assumed_tolerances(spec: Spec) -> tuple[str, ...]:
    """Return the process by which a part is usually made and what it is assumed to hold, where nothing is stated."""
    from cfmkit.studies.parts.assumed_errors import assume_errors

    found = assume_errors(spec)
    if found is None:
        return ()
    process = found.process
    kinds = [kind for kind in ("thickness", "position") if kind in found.kinds.values()]
    held = [f"{kind} +- {1e3 * getattr(process, kind):g} mm (standard deviation)" for kind in kinds]
    kerf = f"kerf {1e3 * process.kerf:g} mm, " if process.kerf else ""
    return (
        f"process: {process.name}, assumed",
        *held,
        f"{kerf}inside corners from {1e3 * process.least_radius:g} mm, walls from {1e3 * process.least_feature:g} mm",
    )


def _spread(stated: Any) -> str:
    """Return a tolerance in words, in the units that it was given in."""
    if isinstance(stated, tuple):
        return " ... ".join(str(value) for value in stated)
    words = stated.model_dump(exclude_none=True)
    return ", ".join(f"{word} {value}" for word, value in words.items())
