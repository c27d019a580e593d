"""Contents of the files that `export` makes, and notes on the drawing: mass, printing, fastening, tolerances.

Nothing is written here. Three kinds: files of the outlines to cut or print (DXF, SVG, CSV, and bodies), decks of the
elastic parts for a finite-element solver, and the dimensioned drawing of the part on a sheet of paper (png, pdf). In
the code, `outlines` is a `Drawing`: contours with notes and warnings.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cfmkit.errors import CfmError, GeometryError, UsageError
from cfmkit.families import family
from cfmkit.specs.units import format_short

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.figure import Figure

    from cfmkit.export.contours import Drawing
    from cfmkit.families.base import Family
    from cfmkit.results import Finding
    from cfmkit.specs.spec import Spec


def part_on_paper(drawing: Drawing, spec: Spec) -> Figure:
    """Return the dimensioned drawing of a part, with the tolerances that are stated or assumed for it."""
    from cfmkit.plots.workshop_drawing import TitleBlock, drawing_figure
    from cfmkit.store import stable_hash
    from cfmkit.studies.parts.parts import accuracy_of
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
    """Return notes on printing a part: its side on the bed, strands of its leaves; empty if it is cut."""
    from cfmkit.plots.workshop_drawing import thicknesses
    from cfmkit.stock.processes import strands_in_words
    from cfmkit.studies.parts.parts import accuracy_of

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
    """Return notes on where rigid end stops have to stand, which are no part of what is cut."""
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
    """Return notes on how to hold a part that bends and has no holes for screws."""
    part: Any = getattr(getattr(spec, "mechanism", None), "part", None)
    if getattr(part, "screws", None) is not None or not spec.out_of_plane_widths:
        return ()
    return ("no screw holes: clamp or bond what stands, or state 'part.screws'",)


def weight_in_words(drawing: Drawing, spec: Spec) -> str:
    """Return the mass of what is cut, or what is missing to know it."""
    from cfmkit.export.bodies_stl_3mf_step import volume
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
    return tuple(f"{path}: {_tolerance_in_words(stated)}" for path, stated in made.items())


def assumed_tolerances(spec: Spec) -> tuple[str, ...]:
    """Return the usual process of a part and its assumed tolerances, where none are stated."""
    from cfmkit.studies.parts.parts import assume_errors

    assumed = assume_errors(spec)
    if assumed is None:
        return ()
    process = assumed.process
    kinds = [kind for kind in ("thickness", "position") if kind in assumed.kinds.values()]
    held = [f"{kind} +- {1e3 * getattr(process, kind):g} mm (standard deviation)" for kind in kinds]
    kerf = f"kerf {1e3 * process.kerf:g} mm, " if process.kerf else ""
    return (
        f"process: {process.name}, assumed",
        *held,
        f"{kerf}inside corners from {1e3 * process.least_radius:g} mm, walls from {1e3 * process.least_feature:g} mm",
    )


def _tolerance_in_words(stated: Any) -> str:
    """Return a tolerance in words, in the units that it was given in."""
    if isinstance(stated, tuple):
        return " ... ".join(str(value) for value in stated)
    words = stated.model_dump(exclude_none=True)
    return ", ".join(f"{word} {value}" for word, value in words.items())


DECK_FORMAT = "inp"  # format of decks of a finite-element solver, which need more than the outlines: the elastic parts
DRAWING_FORMATS = ("png", "pdf")  # formats of the dimensioned drawing


def export_files(
    spec: Spec,  # the mechanism as it is
    # kerf, tolerance: width of the cut, and largest distance from the exact curves: with a unit, or a number [m]
    kerf: str | float | None = None,
    tolerance: str | float | None = None,
    # of `cfmkit.export.FILE_FORMATS`, `DECK_FORMAT` and `DRAWING_FORMATS`; default: `cfmkit.export.DEFAULT_FORMATS`
    formats: str | Sequence[str] | None = None,
) -> tuple[dict[str, bytes], Drawing, dict[str, CfmError]]:
    """Return the files by name, the outlines with notes and warnings, and errors of formats not made.

    A body, a deck or a dimensioned drawing that cannot be made does not stop the other formats; if there is nothing
    else, its error is raised.

    Raises UsageError if the family has nothing to cut, a length is not above zero, a format is unknown or needs a
    missing library; SolutionError if the mechanism cannot exist as described; GeometryError if it cannot be cut as it
    is, or nothing says how thick it is and a format needs that.
    """
    from cfmkit.export import DEFAULT_FORMATS, files
    from cfmkit.runs.values_with_units import read_length

    wanted = _split_formats(formats, DEFAULT_FORMATS)
    if kerf is not None and "dxf" not in wanted:
        raise UsageError("--kerf makes a second DXF: add dxf to --format")
    kerf_width, max_deviation = read_length(kerf, "--kerf"), read_length(tolerance, "--tolerance")
    outlines = drawing_of(spec, family(spec.family), max_deviation)
    exported = files(outlines, kerf_width, max_deviation, [name for name in wanted if name in DEFAULT_FORMATS])
    failed: dict[str, CfmError] = {}
    for name in (name for name in wanted if name not in DEFAULT_FORMATS):
        try:
            if name in DRAWING_FORMATS:
                exported |= _drawing_on_paper(outlines, spec, name)
            else:
                exported |= _deck_files(spec) if name == DECK_FORMAT else files(outlines, None, max_deviation, [name])
        except CfmError as error:
            failed[name] = error
    if failed and not exported:
        raise next(iter(failed.values()))
    return exported, outlines, failed


def drawing_of(spec: Spec, record: Family, tolerance: float | None = None) -> Drawing:
    """Return the outlines of the parts that can be cut or printed, as `cfmkit.drawing` says."""
    from cfmkit.export.fixing_holes_and_labels import engrave_labels

    if record.outline is None:
        raise UsageError(f"{record.phrase} has no part to draw")
    limits = () if tolerance is None else (tolerance,)
    outlines = record.outline(spec, *limits)
    outlines = replace(outlines, warnings=(*outlines.warnings, *_thin_walls(outlines, spec)))
    return engrave_labels(outlines, spec.name)


MAX_NAMED_WALLS = 3  # most thin walls that a warning names


def _thin_walls(outlines: Drawing, spec: Spec) -> Iterator[Finding]:
    """Yield a warning if walls of a part are thinner than the stated manufacturing process can make."""
    from cfmkit.export.thin_walls import thin_walls
    from cfmkit.results import THIN_WALL, Finding
    from cfmkit.specs.units import format_short

    process = getattr(getattr(getattr(spec, "mechanism", None), "part", None), "process", None)
    if (
        process is None
        or not (least := process.thinnest)
        or not (walls := thin_walls(outlines.contours, least, outlines.tolerance))
    ):
        return
    first, *others = [
        f"{format_short(wall.thickness, 'length', 3)}{{}} at ({', '.join(format_short(x, 'length') for x in wall.at)})"
        for wall in walls[:MAX_NAMED_WALLS]
    ]
    named = "; ".join([first.format(" thick"), *(text.format("") for text in others)])
    more = len(walls) - MAX_NAMED_WALLS
    beyond = f", and thin in {more} other place{'s' if more > 1 else ''}" if more > 0 else ""
    key = "process" if process.least_feature is None else "process.least_feature"
    yield Finding(
        THIN_WALL,
        f"the part is only {named}{beyond}: 'mechanism.part.{key}' makes walls from {format_short(least, 'length')}",
    )


def _drawing_on_paper(outlines: Drawing, spec: Spec, name: str) -> dict[str, bytes]:
    """Return the dimensioned drawing in one format."""
    from cfmkit.plots.figure_options import FigureForm

    form = FigureForm(formats=(name,))
    return dict(form.files({"drawing": lambda: part_on_paper(outlines, spec)}))


def _deck_files(spec: Spec) -> dict[str, bytes]:
    """Return the elastic parts as decks of a finite-element solver: meshed, and as beams."""
    record = family(spec.family)
    if record.elastic is None:
        raise UsageError(f"--format inp: {record.phrase} has no elastic part to be solved")
    from cfmkit.export.beam_deck_for_abaqus import beam_deck
    from cfmkit.solid.mesh_deck_for_abaqus import deck

    parts = record.elastic.solids(spec)
    decks = {f"{piece.name}.inp": deck(f"{spec.name}, {piece.name}", piece) for piece in parts}
    steps = {piece.name: len(piece.stops) for piece in parts}
    for network in record.elastic.beams(spec):
        title = f"{spec.name}, {network.name} as beams"
        decks[f"{network.name}-as-beams.inp"] = beam_deck(title, network, steps[network.name])
    return decks


def _split_formats(stated: str | Sequence[str] | None, usual: Sequence[str]) -> tuple[str, ...]:
    """Return the requested formats, split at commas; the usual ones for None."""
    from cfmkit.export import FILE_FORMATS as OUTLINE_FORMATS

    formats = (*OUTLINE_FORMATS, DECK_FORMAT, *DRAWING_FORMATS)
    words = usual if stated is None else stated.split(",") if isinstance(stated, str) else stated
    names = tuple(dict.fromkeys(word.strip().lower() for word in words))
    for name in names:
        if name not in formats:
            raise UsageError(f"--format: {name!r} is not known; there are {', '.join(formats)}")
    return names
