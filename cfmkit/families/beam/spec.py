"""YAML specification of a beam mechanism: its keys with types, bounds and descriptions, and cross-checks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from cfmkit.families.beam.contact_spec import Fault, contacts_of
from cfmkit.families.beam.mechanism_spec import Mechanism
from cfmkit.families.beam.network_elements_spec import DisplacementDrive, Drive, LoadsDrive, MaterialField
from cfmkit.families.beam.shaping.spec import Optimise, optimise_faults
from cfmkit.families.end_stops_spec import contact_requirement_faults, travel_up_to_stop
from cfmkit.families.request_spec import ProposedSpec
from cfmkit.metrics.fatigue_and_relaxation import Durability
from cfmkit.specs.data_file_paths import DataSource
from cfmkit.specs.formula_of_x import formula
from cfmkit.specs.spec import (
    Analysis,
    DesignBlock,
    Displacement,
    Model,
    PositiveLength,
    SolidAnalysis,
    is_made,
    refuse,
)
from cfmkit.specs.target_curve import Target
from cfmkit.specs.units import DIMENSIONS_BY_NAME, Factor, Force, Length, Ratio, Torque, format_short
from cfmkit.specs.units.fields import MAX_QUANTITY
from cfmkit.stock.material_and_part_spec import sheet_faults, sheet_of, stated_sheet
from cfmkit.stock.stock_series import stock_faults

Fidelity = Literal["inextensible", "extensible", "reissner", "solid"]
EXTENT_KEYS = tuple(dict.fromkeys(kind.extent for kind in Drive.__subclasses__()))


class FileProfile(Model):
    """Heights of a surface from a file."""

    kind: Literal["file"]
    file: str = Field(description="a CSV beside the specification: x [mm], y [mm]")
    between: Literal["smooth", "straight"] = Field(
        "smooth", description="how it runs between its points: a cubic spline, or straight lines with corners"
    )

    @field_validator("file", mode="wrap")
    @classmethod
    def _resolve_file(cls, value: Any, handler: Any, info: ValidationInfo) -> Any:
        folder = getattr(value, "folder", None) or (info.context or {}).get("folder") or "."
        return DataSource(handler(value), folder)


class FormulaProfile(Model):
    """Heights of a surface by a formula."""

    kind: Literal["formula"]
    height: str = Field(description="in mm, of x in mm: 1.75*(1 - cos(pi*x/12.3))")
    length: PositiveLength = Field(description="travel of the tip along the surface")
    points: int = Field(201, ge=3, le=100_000, description="places at which it is taken")

    @field_validator("height")
    @classmethod
    def _readable(cls, text: str) -> str:
        formula(text)
        return text

    @model_validator(mode="after")
    def _has_a_height_everywhere(self) -> Self:
        x = np.linspace(0.0, self.length, self.points) * 1e3
        heights = formula(self.height)(x)
        bad = ~(np.abs(heights) <= MAX_QUANTITY * 1e3)
        if bad.any():
            place = x[int(bad.argmax())]
            reported = f"has no height at x = {place:.6g} mm: a finite number of mm is needed everywhere on the surface"
            refuse("FormulaProfile", {("height",): reported})
        return self


class Surface(Model):
    """A surface that the driven node follows while the mechanism is carried along it [Lan, Fig. 14]."""

    profile: FileProfile | FormulaProfile = Field(
        discriminator="kind", description="heights: of `kind` file or formula"
    )
    preload: Length = Field(description="displacement of the mechanism where the height is 0")
    friction: Annotated[Ratio, Field(ge=0, lt=2)] = Field(0.0, description="of the tip on the surface")


class Rescale(Model):
    """Another size, section or material for a force curve of the same form, by Eq. 6 of Lan."""

    force: Annotated[Force, Field(gt=0)] | None = Field(
        None, description="target force at the end of the window; default: the one that results from the changes"
    )
    free: Literal["width", "thickness", "size"] = Field(
        "width",
        description="value that is adjusted to reach the force; for a part from a sheet the thickness instead of the "
        "width",
    )
    size: PositiveLength | None = Field(None, description="distance of the outermost nodes along x (L_x of Lan)")
    material: MaterialField | None = Field(None, description="another material")
    thickness: PositiveLength | None = Field(None, description="another (largest) thickness in the plane")
    width: PositiveLength | None = Field(None, description="another (largest) width out of the plane")
    to_allowable_stress: bool = Field(
        False, description="let travel and window end where the stress reaches the allowable one, and start at c"
    )

    @model_validator(mode="after")
    def _free_is_not_given(self) -> Self:
        if self.force is not None and getattr(self, self.free) is not None:
            raise ValueError(f"{self.free!r} is given and cannot follow from the force: change 'free'")
        return self

    def choose_dimension(self, sheet: float | None) -> Literal["width", "thickness", "size"]:
        """Return the value that is adapted: the width of what is cut from a sheet [m] stays."""
        return "thickness" if sheet is not None and self.free == "width" else self.free

    def sheet_fault(self, sheet: float | None) -> dict[tuple[str | int, ...], str]:
        """Return what contradicts a sheet that everything is cut from [m], by its key; else nothing."""
        if sheet is None:
            return {}
        said = format_short(sheet, "length")
        if self.width is not None and abs(self.width / sheet - 1.0) > 1e-9:
            return {("design", "rescale", "width"): f"the sheet is {said} ('mechanism.part.sheet'): make them equal"}
        if self.force is not None and self.thickness is not None and self.free == "width":
            reported = f"the sheet ({said}) keeps the width, so the thickness follows from the force: leave it out"
            return {("design", "rescale", "thickness"): f"{reported}, or 'free: size'"}
        return {}


LEAST_SHARE = 0.05
"""Of its largest force a target curve must have everywhere: the search compares by the force that is wanted."""


class BeamDesign(DesignBlock):
    """Tasks of `cfmkit design`."""

    rescale: Rescale | None = Field(None, description="another size, section or material for the same curve")
    optimise: Optimise | None = Field(None, description="node positions and beam shapes for a constant force")

    target: Target | None = Field(
        None, description="a curve over the window of 'optimise' instead of a constant force, with 'objective: ripple'"
    )

    @model_validator(mode="after")
    def _target_in_its_window(self) -> Self:
        if self.target is None:
            return self
        if self.optimise is None or self.optimise.objective != "ripple":
            raise ValueError("a 'target' needs 'optimise' with 'objective: ripple': it looks for the nearest force")
        if self.optimise.force.target is not None or self.optimise.force.min is not None:
            raise ValueError("'target' says the force: remove 'optimise.force'")
        if self.optimise.contact is not None:
            raise ValueError("'target' is a curve of the drive's force: remove it, or 'optimise.contact'")
        curve, window = self.target.curve(), self.optimise.window
        if not curve.covers(*window):
            raise ValueError("'optimise.window' is beyond the points of 'target'")
        low, high = curve.extremes(*window)
        if low < LEAST_SHARE * high or high <= 0:
            raise ValueError(f"'target' must stay above {LEAST_SHARE:.0%} of its largest force in 'optimise.window'")
        return self

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.rescale and self.optimise) or not (self.rescale or self.optimise or self.free):
            raise ValueError("give either 'rescale' or 'optimise', or 'free' alone, whose values meet the requirements")
        return self


class Outputs(Model):
    """Further columns of the curve."""

    nodes: tuple[str, ...] = Field((), max_length=100, description="nodes whose motion is reported: [tip]")
    reactions: tuple[str, ...] = Field(
        (),
        max_length=100,
        description="nodes whose reactions are reported, those of support and of a drive by a motion: [root]",
    )
    cross_stiffness: bool = Field(False, description="column with the stiffness of the driven node across the drive")


class BeamAnalysis(Analysis):
    """Analysis of a beam mechanism."""

    points: int = Field(181, ge=5, le=1_000_000, description="points of the curve, even over the travel or the load")
    travel: Displacement | None = Field(None, description="final displacement or angle, for a drive by motion")
    force: Force | None = Field(None, description="final force of all copies together, for a drive by a force")
    moment: Torque | None = Field(None, description="final moment, for a drive by a moment")
    factor: Factor | None = Field(None, description="final multiple of the stated loads, for a drive by loads")
    reference: Displacement | None = Field(None, description="pose of the band ranges; default: centre of the window")
    fidelity: Fidelity | None = Field(
        None,
        description="model: bending only, with stretching, with stretching and shear, or the part as a planar "
        "solid; default: as in the mechanism, or 'reissner' for a search of shapes",
    )
    solid: SolidAnalysis = Field(SolidAnalysis(), description="settings of fidelity 'solid'")
    stress: Literal["bending", "total"] | None = Field(
        None, description="which stress is used; default: bending for inextensible beams, otherwise with the axial part"
    )
    tolerance: Annotated[Ratio, Field(ge=1e-12, le=0.01)] = Field(
        1e-7, description="error of forces and positions, relative to the largest of the path"
    )
    through_folds: bool = Field(False, description="follow the path through limit points, by its arc length")
    branch: Literal["stable", "primary"] = Field(
        "stable", description="path beyond a bifurcation: a stable branch, or the primary one"
    )
    other_side: bool = Field(False, description="take the other one of two mirror-image branches")
    loads_first: bool = Field(
        True,
        description="constant loads are applied before the drive moves, with its node held; false: they grow with "
        "the drive and are complete at its end",
    )
    outputs: Outputs = Field(Outputs(), description="motions and reactions of nodes as columns of the curve")
    modes: int = Field(
        0,
        ge=0,
        le=50,
        description="number of natural frequencies about each pose, as columns, with the drive held and free; needs "
        "the density of every material",
    )
    surface: Surface | None = Field(None, description="a surface to follow: adds the contact force along it")
    imperfection: Length = Field(
        0.0, description="amplitude of the first buckling mode by which the unloaded beams are bent; 0: perfect"
    )


class BeamSpec(ProposedSpec):
    """A mechanism of slender beams."""

    family: Literal["beam"]
    mechanism: Mechanism
    design: BeamDesign | None = Field(None, description="what `cfmkit design` is to reach")
    analysis: BeamAnalysis = Field(description="how it is run")

    @model_validator(mode="after")
    def _keys_agree(self, info: ValidationInfo) -> Self:
        for faults in _list_faults(self, is_made(info)):
            refuse("BeamSpec", dict(faults))
        return self

    @property
    def out_of_plane_widths(self) -> Mapping[str, float | None]:
        """Of all beams, and of those that have their own; None if one has none."""
        widths = {f"beams.{name}.width": beam.width for name, beam in self.mechanism.beams.items()}
        return {"width": self.mechanism.width} | widths

    @property
    def fidelity(self) -> Fidelity:
        """The model that the analysis uses."""
        if self.analysis.fidelity is not None:
            return self.analysis.fidelity
        if self.mechanism.shear:
            return "reissner"
        return "extensible" if self.mechanism.axial else "inextensible"

    @property
    def stress(self) -> Literal["bending", "total"]:
        """Kind of stress."""
        return self.analysis.stress or ("bending" if self.fidelity == "inextensible" else "total")

    @property
    def durability(self) -> Durability | None:
        """Of all beams; None if they are not of one material."""
        kinds = {*self.mechanism.collect_beam_values("material").values()}
        return kinds.pop().durability if len(kinds) == 1 else None

    @property
    def motion(self) -> Literal["length", "angle"]:
        """Abscissa of the curve: the displacement or the angle of the driven node."""
        return self.mechanism.drive.motion_dimension

    def end_stop_changes(self, end: float) -> Mapping[str, Any]:
        """Return what puts a rigid stop at a motion of the driven node [m], just behind the end; not in stages."""
        drive = self.mechanism.drive
        if not isinstance(drive, DisplacementDrive) or self.mechanism.layers > 1:
            return {}
        stop = {"node": drive.node, "direction": drive.direction, "gap": end}
        return {"mechanism.stops": {"end": stop}, "analysis.travel": travel_up_to_stop(end)}

    @property
    def extent(self) -> float:
        """End of the drive: the travel [m or rad], the force [N] or the moment [N m]."""
        value: float = getattr(self.analysis, self.mechanism.drive.extent)
        return float(value)


def _list_faults(spec: BeamSpec, as_made: bool) -> Iterator[Iterable[Fault]]:
    """Yield what is wrong group by group: one is computed only where nothing was wrong in those before it."""
    mechanism, part = spec.mechanism, spec.mechanism.part
    yield _extent_faults(spec)
    if part is not None and not as_made:
        yield stock_faults(part.stock, stated_sheet(part), mechanism.material.name).items()
    yield sheet_faults(part, spec.out_of_plane_widths).items()
    if spec.design is not None and (rescale := spec.design.rescale) is not None:
        yield rescale.sheet_fault(sheet_of(part)).items()
        yield _rescale_faults(spec, rescale)
    if spec.design is not None and (optimise := spec.design.optimise) is not None:
        yield _optimise_faults(spec, optimise)
    yield _contact_faults(spec)
    yield _output_faults(spec)
    yield _vibration_faults(spec)
    yield _solid_faults(spec)


def _optimise_faults(spec: BeamSpec, wanted: Optimise) -> Iterator[Fault]:
    for place, text in optimise_faults(wanted, spec.mechanism):
        yield ("design", "optimise", *place), text
    if spec.mechanism.loads and not spec.analysis.loads_first:
        yield ("design", "optimise"), "shapes are searched with constant loads applied first: drop analysis.loads_first"


def _extent_faults(spec: BeamSpec) -> Iterator[Fault]:
    """Yield what is wrong with how far the drive is to go."""
    drive, analysis = spec.mechanism.drive, spec.analysis
    kind, wanted = drive.kind, drive.extent
    others = [name for name in EXTENT_KEYS if name != wanted and getattr(analysis, name) is not None]
    for name in others:
        yield ("analysis", name), f"does not go with a drive of kind {kind!r}: give {wanted!r}"
    value = getattr(analysis, wanted)
    if value is None and not others:
        yield ("analysis",), f"the key {wanted!r} is missing: how far a drive of kind {kind!r} goes"
    if value == 0:
        yield ("analysis", wanted), "must not be 0: the drive has to do something"
    if analysis.surface is not None and not drive.is_displacement:
        yield ("analysis", "surface"), "a surface needs a drive of kind 'displacement'"
    if value is not None and drive.by_motion and value.dimension != drive.dimension:
        phrase = DIMENSIONS_BY_NAME[drive.dimension].phrase
        yield ("analysis", wanted), f"must be {phrase} for a drive of kind {kind!r}"


def _output_faults(spec: BeamSpec) -> Iterator[Fault]:
    """Yield what is wrong with the nodes that are to be reported."""
    mechanism, outputs, drive = spec.mechanism, spec.analysis.outputs, spec.mechanism.drive
    moved = {link.node: link.master for link in mechanism.links}
    for group in ("nodes", "reactions"):
        for number, name in enumerate(getattr(outputs, group)):
            place = ("analysis", "outputs", group, number)
            if name not in mechanism.nodes:
                node_names = ", ".join(repr(node) for node in list(mechanism.nodes)[:20])
                yield place, f"there is no node {name!r}; nodes: {node_names}"
            elif group == "reactions" and name in moved:
                yield place, f"a link moves {name!r}: what is held is its master, {moved[name]!r}"
            elif group == "reactions" and mechanism.nodes[name].support == "free" and name != drive.node:
                yield place, f"nothing holds {name!r}: it has no support and is not driven"
    if outputs.cross_stiffness and drive.turns:
        text = f"a drive of kind {drive.kind!r} has no direction, and so no stiffness across it"
        yield ("analysis", "outputs", "cross_stiffness"), text
    for beam in mechanism.beams:
        if (name := f"{beam}_force") in outputs.nodes:
            text = f"the columns of {name!r} would have the names of those of the beam {beam!r}"
            yield ("analysis", "outputs", "nodes"), text


def _contact_faults(spec: BeamSpec) -> Iterator[Fault]:
    """Yield what cannot be done with contacts, and requirements on those that are not there."""
    contacts = dict.fromkeys(contact.name for contact in contacts_of(spec.mechanism))
    yield from contact_requirement_faults(contacts, "a stop, an obstacle or a contact", spec.requirements)
    if spec.mechanism.has_contacts and spec.analysis.modes:
        yield ("analysis", "modes"), "natural frequencies are not known with contacts: leave it out"


def _solid_faults(spec: BeamSpec) -> Iterator[Fault]:
    """Yield that the model of the part as a solid cannot do what is asked of it: each key, and why."""
    verified = spec.design is not None and spec.design.verify == "solid"
    unsupported = list(_list_unsupported(spec)) if spec.analysis.fidelity == "solid" or verified else []
    if unsupported:
        # no word in quotes: long lists between two would be shortened like a long quotation
        limits = "; ".join(unsupported)
        message = f"the model solid has limits: {limits}; leave these keys out, or use the beam model: reissner"
        yield ("design", "verify") if verified else ("analysis", "fidelity"), message


def _list_unsupported(spec: BeamSpec) -> Iterator[str]:
    """Yield the keys that are not supported by the model of the part as a solid, and why."""
    mechanism, analysis, beams = spec.mechanism, spec.analysis, spec.mechanism.beams
    by_load = mechanism.drive.by_load
    moved = [f"mechanism.nodes.{name}.moved" for name, node in mechanism.nodes.items() if node.moved is not None]
    pins = [
        f"mechanism.beams.{name}.{joint}"
        for name, beam in beams.items()
        for joint in ("start_joint", "end_joint")
        if getattr(beam, joint) == "pin"
    ]
    by_loads = isinstance(mechanism.drive, LoadsDrive)
    unusual_loads = any(load.acts_on != "node" or getattr(load, "follows", False) for load in mechanism.loads)
    verified_loads = mechanism.loads and spec.design is not None and spec.design.verify == "solid"
    things: tuple[tuple[str, object, str], ...] = (
        ("mechanism.drive", by_loads, "one node is moved or loaded, and no path of loads followed"),
        ("mechanism.drive.follows", getattr(mechanism.drive, "follows", False), "its loads keep their direction"),
        ("mechanism.loads", mechanism.loads and by_load, "they act on a part whose motion is given"),
        ("mechanism.loads", unusual_loads, "constant loads act on nodes, and keep their direction"),
        ("mechanism.loads", verified_loads, "with constant loads the force is not proportional to the width"),
        ("analysis.loads_first", mechanism.loads and not analysis.loads_first, "constant loads act from the start"),
        ("mechanism.stops", not mechanism.ends_before_stops(analysis.travel), "contact is not modelled"),
        ("mechanism.obstacles", mechanism.obstacles, "contact is not modelled"),
        ("mechanism.contacts", mechanism.contacts, "contact is not modelled"),
        ("mechanism.springs", mechanism.springs, "only the part that is cut is meshed, and springs are not part of it"),
        (", ".join(moved), moved, "the part is solved as drawn, and supports stay where they are"),
        (", ".join(pins), pins, "the outline is one piece at every node"),
        ("mechanism.closure", mechanism.closure == "raw", "beams forced into place are drawn as if they fitted"),
        ("analysis.modes", analysis.modes, "it has no masses"),
        ("analysis.imperfection", analysis.imperfection, "the part is meshed as drawn"),
        ("analysis.outputs.cross_stiffness", analysis.outputs.cross_stiffness, "the driven piece is held across"),
        ("analysis.through_folds", analysis.through_folds and not by_load, "a motion is followed to its first fold"),
        ("mechanism.beams", _several(spec, "material"), "all beams must be of one material"),
        ("mechanism.beams", _several(spec, "width"), "all beams must have one width"),
    )
    for key, value, reason in things:
        if value:
            yield f"{key} is not supported: {reason}"


def _several(spec: BeamSpec, key: Literal["material", "width"]) -> bool:
    """Return True if beams differ in a value that they may take from the mechanism."""
    return len({*spec.mechanism.collect_beam_values(key).values()}) > 1


def _vibration_faults(spec: BeamSpec) -> Iterator[Fault]:
    """Yield what is missing for natural frequencies, if they are requested."""
    mechanism, place = spec.mechanism, ("analysis", "modes")
    if spec.analysis.modes and mechanism.wide_beams:
        yield place, "natural frequencies are known of narrow beams only: drop mechanism.wide_beams"
    elif spec.analysis.modes:
        keys = dict.fromkeys(
            "mechanism.material.density" if beam.material is None else f"mechanism.beams.{name}.material.density"
            for name, beam in mechanism.beams.items()
            if (beam.material or mechanism.material).density is None
        )
        if keys:
            listed = ", ".join([*keys][:5])
            yield place, f"natural frequencies need a density: give {listed}, such as 1410 kg/m^3"


def _rescale_faults(spec: BeamSpec, wanted: Rescale) -> Iterator[Fault]:
    """Yield why Eq. 6 does not hold for a mechanism, in one line; else that no stress is allowable."""
    mechanism, reasons = spec.mechanism, list[str]()
    if not mechanism.drive.is_displacement:
        reasons.append("needs a drive of kind 'displacement': the force at the end of its window is scaled")
    moved = any(node.moved is not None for node in mechanism.nodes.values())
    if mechanism.springs or mechanism.loads or moved or spec.analysis.imperfection or mechanism.has_contacts:
        extras = "springs, loads, contacts, moved supports and imperfections"
        reasons.append(f"Eq. 6 is about beams alone: {extras} do not scale with them")
    if _several(spec, "material"):
        reasons.append("Eq. 6 is about beams of one material")
    materials = [wanted.material] if wanted.material else mechanism.collect_beam_values("material").values()
    if reasons:
        yield ("design", "rescale"), "; ".join(reasons)
    elif wanted.to_allowable_stress and any(
        material.allowable(mechanism.safety_factor) is None for material in materials
    ):
        text = "no stress is allowable without a strength: give the material a 'yield_strength'"
        yield ("design", "rescale", "to_allowable_stress"), text
