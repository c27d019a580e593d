"""Block `design.optimise` of a beam mechanism (what may vary, limits, objective, starts, tolerances); its checks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from cfmkit.families.beam.contact_spec import Fault, RotationStop, list_names, sides_of
from cfmkit.specs.spec import Model, PositiveLength, refuse
from cfmkit.specs.units import Angle, Force, Length, Ratio, Time

if TYPE_CHECKING:
    from collections.abc import Iterator

    from cfmkit.families.beam.mechanism_spec import Mechanism

Range = tuple[Length, Length]


class Box(Model):
    """A rectangle."""

    x: Range = Field(description="[left, right]")
    y: Range = Field(description="[bottom, top]")

    @model_validator(mode="after")
    def _increases(self) -> Self:
        _check_increasing(self.x, self.y)
        return self


class FreeNode(Model):
    """Range of a free node: along x, along y, or both; without either both, within the envelope."""

    x: Range | None = Field(None, description="[left, right]; default: the envelope, if `y` is left out, too")
    y: Range | None = Field(None, description="[bottom, top]; default: the envelope, if `x` is left out, too")

    @model_validator(mode="after")
    def _increases(self) -> Self:
        _check_increasing(self.x, self.y)
        return self


def _check_increasing(x: Range | None, y: Range | None) -> None:
    """Refuse a range that ends before it begins."""
    for name, limits in (("x", x), ("y", y)):
        if limits is not None and not limits[0] < limits[1]:
            raise ValueError(f"{name!r} must be increasing")


class ForceWanted(Model):
    """The mean force over the window, of all copies together; of a `contact` on one copy."""

    min: Annotated[Force, Field(gt=0)] | None = Field(None, description="smallest value")
    target: Annotated[Force, Field(gt=0)] | None = Field(None, description="value to reach, within `tolerance`")
    tolerance: Annotated[Ratio, Field(gt=0, lt=1)] = Field(0.01, description="share of the target")

    @model_validator(mode="after")
    def _can_both_hold(self) -> Self:
        if self.min is not None and self.target is not None and self.target * (1 + self.tolerance) < self.min:
            raise ValueError("'target' is below 'min'")
        return self


class ShapeLimits(Model):
    """Limits of every shape. The stress limit is the mechanism's: yield strength over safety factor."""

    stress: bool = Field(True, description="whether the bending stress is limited, at every pose from rest on")
    envelope: Box | None = Field(None, description="where centre lines must lie before loading")
    deformed_envelope: Box | None = Field(None, description="where centre lines must lie at every pose")
    max_length_ratio: Annotated[Ratio, Field(gt=1)] | None = Field(1.5, description="length over distance of the ends")
    min_slenderness: Annotated[float, Field(gt=0)] | None = Field(10.0, description="length over largest thickness")
    clearance: Annotated[Length, Field(ge=0)] | None = Field(
        None,
        description="gap between the surfaces of beams, before and under load; also the least feature between them",
    )
    joint_opening: Annotated[float, Field(gt=0, lt=1)] = Field(
        0.35, description="near a joint: gap between centre lines over the distance around the joint"
    )
    min_radius: PositiveLength | None = Field(None, description="radius of curvature of centre lines before loading")


class Tolerances(Model):
    """Tolerances of the audit: standard deviations."""

    nodes: Annotated[Length, Field(ge=0)] = Field(1e-4, description="of the coordinates of free nodes")
    coefficients: Annotated[Angle, Field(ge=0)] = Field(0.02, description="of the shape coefficients c1, c2, ...")
    samples: int = Field(40, ge=2, le=10_000, description="random networks to evaluate")


class Optimise(Model):
    """Node positions and beam shapes for a constant force over a window of displacement."""

    window: Range = Field(description="[c, d]: where the force is to be constant; `range` moves c towards rest")
    objective: Literal["range", "ripple", "paper"] = Field(
        "range",
        description="widest window with `half_band`, flattest over the window, or F(a)/F(b) - 1 of Lan, ill-posed",
    )
    contact: str | None = Field(
        None,
        description="stop or obstacle whose force is to be constant, such as the workpiece of a gripper; default: the "
        "force of the drive",
    )
    half_band: Annotated[Ratio, Field(gt=0, lt=1)] = Field(
        0.025,
        description="limit of (max - min)/(max + min), for `range`; 2.5 % keeps the force within 5 % of the maximum",
    )
    compare: tuple[Length, Length] | None = Field(None, description="[a, b] of the objective `paper`")
    free: dict[str, FreeNode] = Field({}, description="nodes that may move: {n3: {}, n2: {y: [0 mm, 40 mm]}}")
    beams: tuple[str, ...] | None = Field(None, description="beams whose shape may change; default: all")
    orders: tuple[Annotated[int, Field(ge=0, le=6)], ...] = Field(
        (1, 2), min_length=1, description="orders of the shape polynomials, from coarse to fine"
    )
    coefficient_limit: Annotated[Angle, Field(gt=0)] = Field(1.5707963267948966, description="of c1, c2, ...")
    limits: ShapeLimits = Field(default_factory=ShapeLimits, description="limits for every shape")
    force: ForceWanted = Field(default_factory=ForceWanted, description="mean force over the window")
    starts: int = Field(20, ge=1, le=10_000, description="random starts")
    drawn: int = Field(60, ge=1, le=100_000, description="random networks examined for each start")
    widened: int = Field(8, ge=1, le=10_000, description="how many of the best are widened, for `range`")
    time_budget: Annotated[Time, Field(gt=0)] | None = Field(None, description="end the search after this time")
    tolerances: Tolerances = Field(default_factory=Tolerances, description="for the audit of what was found")

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        if not 0 < self.window[0] < self.window[1]:
            raise ValueError("'window' must be increasing and begin after rest")
        if list(self.orders) != sorted(set(self.orders)):
            raise ValueError("'orders' must be increasing, e.g. [0, 1, 2]")
        if self.objective == "paper" and self.compare is None:
            raise ValueError("'objective: paper' needs 'compare': the displacements [a, b]")
        if self.compare is not None and not self.compare[0] > self.compare[1] > 0:
            refuse("Optimise", {("compare",): "must be [a, b] with a > b > 0"})
        return self

    def list_ranges(self) -> Iterator[tuple[str, int, Range]]:
        """Yield each coordinate that may vary: its node, 0 for x and 1 for y, and its range [m]."""
        box = self.limits.envelope
        for name, node in self.free.items():
            inside = (box.x, box.y) if node.x is None and node.y is None and box is not None else (node.x, node.y)
            yield from ((name, axis, ends) for axis, ends in enumerate(inside) if ends is not None)


def optimise_faults(wanted: Optimise, mechanism: Mechanism) -> Iterator[Fault]:
    """Yield what keeps the block from making sense with its mechanism, each with its place below the block."""
    if not mechanism.drive.is_displacement:
        yield (), f"needs a drive of kind 'displacement', not {mechanism.drive.kind!r}"
    for name, node in wanted.free.items():
        if name not in mechanism.nodes:
            yield ("free", name), f"there is no node {name!r}; nodes are {list_names(mechanism.nodes)}"
        elif node.x is None and node.y is None and wanted.limits.envelope is None:
            yield ("free", name), "no range is given: give 'x', 'y' or limits.envelope"
    for index, name in enumerate(wanted.beams or ()):
        if name not in mechanism.beams:
            yield ("beams", index), f"there is no beam {name!r}; beams are {list_names(mechanism.beams)}"
    yield from _contact_faults(wanted, mechanism)
    if not wanted.free and (wanted.orders[-1] == 0 or wanted.beams == ()):
        yield (), "leaves nothing to vary: name free nodes, or an order of the shapes above 0"


def _contact_faults(wanted: Optimise, mechanism: Mechanism) -> Iterator[Fault]:
    """Yield what is wrong with the contact whose force is to be constant, and with obstacles of a search."""
    names = [*mechanism.stops, *mechanism.obstacles]
    if wanted.contact is not None and wanted.contact not in names:
        listed = ", ".join(names) or "none"
        yield ("contact",), f"there is no stop or obstacle {wanted.contact!r}; there are: {listed}"
    if isinstance(mechanism.stops.get(wanted.contact or ""), RotationStop):
        yield ("contact",), f"the stop {wanted.contact!r} limits a rotation: its force is a moment"
    for name, contact in (*mechanism.stops.items(), *mechanism.obstacles.items()):
        if getattr(contact, "friction", 0.0):
            yield (), f"shapes are searched without friction: leave out 'friction' of {name!r}"
    for name, obstacle in mechanism.obstacles.items():
        if sides_of(mechanism, obstacle):
            yield (), f"shapes are searched with pads on obstacles only: state 'nodes' alone of 'obstacles.{name}'"
    if mechanism.contacts:
        yield (), "shapes are searched with pads on obstacles only: leave out 'mechanism.contacts'"
