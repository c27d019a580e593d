"""Specifications as frozen, strict models: the blocks of all families, and values read, listed, replaced by path.

A family subclasses `Spec` with its own `mechanism`, `design` and `analysis` blocks. Numbers are SI floats inside; text
with units exists only at the border (`cfmkit.specs.yamlio`, `cfmkit.specs.units`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import BaseModel, Field, ValidationError, ValidationInfo, create_model, field_validator, model_validator

from cfmkit.specs.block import STUDY_BLOCKS, Model, NonNegativeLength, PositiveForce, PositiveLength, keys_of
from cfmkit.specs.further_metrics import OF_MANY_PARTS, name_of
from cfmkit.specs.study_spec import Correlated, Sensitivity, Sweep, Tolerance
from cfmkit.specs.target_curve import Target
from cfmkit.specs.units import (
    DIMENSIONS_BY_NAME,
    SHARE_DIMENSION,
    Displacement,
    Ends,
    Length,
    MetricValue,
    Ratio,
    dimension_of_end,
    ends_increase,
)
from cfmkit.specs.yamlio.paths import with_value


class Requirement(Model):
    """One condition that a finished run is checked against."""

    metric: str = Field(description="name of a metric, as `show metrics` lists them; `[branch]` picks a branch")
    min: MetricValue | None = Field(None, description="smallest value allowed, with its unit")
    max: MetricValue | None = Field(None, description="largest value allowed, with its unit")
    over: Ends | None = Field(
        None,
        description="window, e.g. [2 mm, 240 mm], or shares of the travel: [1 %, 100 %]; default: analysis.window",
    )

    @field_validator("metric", mode="before")
    @classmethod
    def _name_metric(cls, metric: Any) -> Any:
        return name_of(metric)

    @field_validator("metric")
    @classmethod
    def _require_form(cls, text: str) -> str:
        if not re.fullmatch(r"[a-z_0-9]+(\[([a-z_0-9-]+|[0-9.eE+-]+ ?[A-Za-z]+)\])?", text):
            raise ValueError(
                "must be a metric's name, optionally with a branch in brackets: 'force_mean[load]', or a time: "
                "'force_after[1000 h]'"
            )
        return text

    @model_validator(mode="after")
    def _require_bounds(self) -> Self:
        if self.min is None and self.max is None:
            raise ValueError("needs 'min', 'max' or both")
        if self.over is not None and not ends_increase(self.over):
            raise ValueError("'over' must be increasing")
        return self


class Analysis(Model):
    """Common part of every family's `analysis` block; families add their own keys."""

    points: int = Field(481, ge=5, le=1_000_000, description="points per branch of the curve")
    window: Ends | None = Field(
        None,
        description="where the metrics are evaluated, e.g. [2 mm, 240 mm] or, in shares of the travel, [1 %, 100 %]; "
        "default: the full travel",
    )
    band: Annotated[Ratio, Field(gt=0, lt=1)] = Field(
        0.05, description="half width of the force band of `usable_stroke`"
    )
    target: Target | None = Field(
        None,
        description="curve that metrics compare with (`deviation_from_curve`, ...); default: `design.target`",
    )

    @model_validator(mode="after")
    def _require_increasing_window(self) -> Self:
        if self.window is not None and not ends_increase(self.window):
            raise ValueError("'window' must be increasing")
        return self


class SolidAnalysis(Model):
    """Solution of the part as a planar solid."""

    removed_keys: ClassVar[dict[str, str]] = {
        "mesh": "write 'error', the error allowed in the force: the mesh is refined to it (default: 5e-4)"
    }
    poses: int = Field(
        21, ge=3, le=2000, description="poses that are solved, rest included; cubics interpolate between them"
    )
    error: Annotated[Ratio, Field(gt=0, lt=1)] = Field(
        5e-4,
        description="error of the force, in parts of the largest, to which the mesh is refined; a warning says if it "
        "cannot be reached",
    )


class DesignKeys(Model):
    """Common part of every family's `design` block: tolerances, process, and values free to reach a yield."""

    tolerances: dict[str, tuple[MetricValue, MetricValue] | Tolerance] | None = Field(
        None,
        min_length=1,
        description="deviations of manufactured parts, as in `sensitivity.parameters`: {path: {normal: 0.02 mm}}",
    )
    process: Literal["laser", "wire-edm", "fdm", "sls", "mill"] | None = Field(
        None,
        description="manufacturing process, whose assumed tolerances are used if none are stated; "
        "default: by the material",
    )
    correlated: tuple[Correlated, ...] = Field((), description="tolerances that deviate together, as in `sensitivity`")
    free: dict[str, tuple[MetricValue, MetricValue]] = Field(
        {},
        description="values of the design that may move for `yield`, and in which ranges: {path: [4 mm, 8 mm]}; "
        "default: those that the family's design chooses. Without other targets they move until all requirements are "
        "met",
    )
    robust: Literal["cvar", "worst"] | None = Field(
        None,
        description="after first-order margins: 48 random parts are solved at each step, to improve the mean of "
        "the worst share of them (cvar), or the worst one",
    )
    verify: Literal["solid"] | None = Field(
        None,
        description="solid: at the end the part is solved as drawn, as a planar solid; its widths (from a sheet: "
        "the force of the design) are corrected once, so that the solid has the requested force",
    )
    samples: int = Field(
        400, ge=20, le=1_000_000, description="random parts within the tolerances with which the design is evaluated"
    )
    seed: int | None = Field(None, ge=0, description="of the random parts; default: `--seed`")

    @property
    def by_requirements(self) -> bool:
        """Whether the block has no targets of its family: values in `free` move until the requirements are met."""
        return bool(self.free) and self.model_fields_set <= {*DesignKeys.model_fields, "yield"}

    def tolerances_of(self, _spec: Any) -> tuple[Mapping[str, Any], int]:
        """Return the tolerances that are stated for a specification, and how many parts are to be drawn."""
        return self.tolerances or {}, self.samples


if TYPE_CHECKING:
    from cfmkit.specs.evaluable_target_curve import TargetCurve

    DesignBlock = DesignKeys
else:
    # 'yield' is a word of Python's own: a field of that name cannot be written down in a class
    DesignBlock = create_model(
        "DesignBlock",
        __base__=DesignKeys,
        __doc__="What every family's `design` block has; families add their own keys.",
        __module__=__name__,
        **{
            "yield": (
                Ratio | None,
                Field(
                    None,
                    gt=0,
                    lt=1,
                    description="required share of manufactured parts that meet all requirements: 95 %",
                ),
            )
        },
    )


AS_MADE = "as_made"  # key of the context in which a manufactured part is validated: see `Spec.replace`


def is_made(info: ValidationInfo) -> bool:
    """Return True if the values that are validated are those of one manufactured part."""
    return bool(info.context) and bool(info.context.get(AS_MADE))  # type: ignore[union-attr]


class Spec(Model):
    """A complete specification of one mechanism; families narrow the blocks."""

    cfmkit: Literal[1] = Field(1, description="schema version")
    family: str = Field(description="which family of mechanisms")
    name: str = Field("unnamed", min_length=1, max_length=200, description="a name for tables and titles")
    description: str = Field("", description="free text")
    requirements: tuple[Requirement, ...] = Field((), description="checked after every run")
    sweep: Sweep | None = Field(None, description="what `cfmkit sweep` varies")
    sensitivity: Sensitivity | None = Field(None, description="what `cfmkit sensitivity` varies")

    def __repr__(self) -> str:
        """Return the specification in a line; `cfmkit.dumps` writes it out."""
        return f"<{type(self).__name__} {self.name!r}; cfmkit.dumps(spec) writes it out>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the file."""
        from html import escape

        from cfmkit.specs.yamlio import dump

        return f"<pre>{escape(dump(self))}</pre>"

    @property
    def fidelity(self) -> str | None:
        """The model that the analysis uses; None if its family has one only."""
        fidelity: str | None = getattr(getattr(self, "analysis", None), "fidelity", None)
        return fidelity

    def end_stop_changes(self, end: float) -> Mapping[str, Any]:
        """Return what puts a rigid stop at a motion [m] and ends the analysis there; empty if it can have none."""
        return {}

    @property
    def part_requirements(self) -> tuple[Requirement, ...]:
        """The requirements that a single part meets or misses: all but those on a yield."""
        return tuple(requirement for requirement in self.requirements if requirement.metric not in OF_MANY_PARTS)

    @property
    def motion(self) -> Literal["length", "angle"]:
        """Abscissa of the curves: displacements, or angles where a family says so."""
        return "length"

    @model_validator(mode="after")
    def _require_windows_of_motion(self) -> Self:
        right = DIMENSIONS_BY_NAME[self.motion]
        faults = {
            path: f"the curve runs over {right.phrase}: write its window in {right.unit}, or in shares of the travel: "
            "[1 %, 100 %]"
            for path, ends in self.windows()
            if {dimension_of_end(end) for end in ends} - {self.motion, SHARE_DIMENSION}
        }
        refuse("Spec", faults)
        return self

    def _targets(self) -> Iterator[tuple[tuple[str, ...], Target]]:
        """Yield (path, target curve) of the analysis, then of the design."""
        # a family need not have these blocks, and no family is named here
        for block in ("analysis", "design"):
            target = getattr(getattr(self, block, None), "target", None)
            if isinstance(target, Target):
                yield (block, "target"), target

    @property
    def target_curve(self) -> TargetCurve | None:
        """The curve that the analysis or else the design names; None if the force is to be constant."""
        design, target = getattr(self, "design", None), next((target for _, target in self._targets()), None)
        if target is None:
            return None
        return target.curve(getattr(design, "force", None) or getattr(design, "torque", None))

    @model_validator(mode="after")
    def _require_target_of_motion(self) -> Self:
        right = "torque" if self.motion == "angle" else "force"
        faults: dict[tuple[str | int, ...], str] = {
            path: f"is a curve of {target.kind}, and this mechanism is driven by {right}"
            for path, target in self._targets()
            if target.kind not in (None, right)
        }
        refuse("Spec", faults)
        return self

    @property
    def out_of_plane_widths(self) -> Mapping[str, float | None]:
        """Widths cut from a sheet: each out of the plane [m], by its key below `mechanism`."""
        return {}

    def windows(self) -> Iterator[tuple[tuple[str | int, ...], Ends]]:
        """Yield (path, window) of the analysis, then of each requirement that has its own."""
        # a family need not have this block, and no family is named here
        window = getattr(getattr(self, "analysis", None), "window", None)
        if window is not None:
            yield ("analysis", "window"), window
        for index, requirement in enumerate(self.requirements):
            if requirement.over is not None:
                yield ("requirements", index, "over"), requirement.over

    def get_value(self, path: str) -> Any:
        """Return the value at a dotted path, SI for quantities: ``spec.get_value("mechanism.springs.stiffness")``.

        Raises
        ------
        KeyError
            If there is nothing at that path.
        """
        value: Any = self
        for part in path.split("."):
            value = _value_below(value, part, path)
        return value

    def replace(self, changes: Mapping[str, Any], as_made: bool = False) -> Self:
        """Return a validated copy with the values at some dotted paths changed.

        Values may be SI numbers or text with a unit (``"190 mm"``). `as_made`: the values are those of one manufactured
        part, which need not agree with each other as stated ones do: a spring's rate is not exactly that of its wire.

        Blocks in which nothing changes are not validated again: they come to validators that run before as they are.

        Raises
        ------
        cfmkit.errors.SpecError
            If the changed specification is not valid.
        """
        data = {**keys_of(self), "family": self.family}
        for path, value in changes.items():
            data = with_value(data, path.split("."), frozen(value))
        try:
            return type(self).model_validate(data, context={AS_MADE: as_made})
        except ValidationError as error:
            from cfmkit.specs.yamlio import spec_error

            whole = self.model_dump(exclude_unset=True) | {"family": self.family}
            for path, value in changes.items():
                whole = with_value(whole, path.split("."), frozen(value))
            raise spec_error(error, type(self), whole) from None

    def leaves(self) -> Iterator[tuple[str, float | int]]:
        """Yield every numeric leaf of the mechanism and its analysis as (dotted path, SI value).

        Laws that are assumed of a named material are none of the specification's.
        """
        everything = self.model_dump(exclude_none=True, exclude=set(STUDY_BLOCKS))
        yield from _stated_leaves(everything, self.model_dump(exclude_unset=True))


def readable_requirement(entry: Any) -> Requirement | None:
    """Return a requirement from what a file says, None if it cannot be read: to go on looking for errors."""
    try:
        return Requirement.model_validate(entry)
    except ValidationError:
        return None


def refuse(title: str, faults: Mapping[tuple[str | int, ...], str]) -> None:
    """Raise an error that names the place of each fault: path below the block being checked -> what is wrong.

    For validators of a block that find what is wrong deep inside it. Nothing is raised without faults.
    """
    if faults:
        lines = [
            {"type": "value_error", "loc": place, "input": None, "ctx": {"error": ValueError(message)}}
            for place, message in faults.items()
        ]
        raise ValidationError.from_exception_data(title, lines)  # type: ignore[arg-type]


def _value_below(value: Any, part: str, path: str) -> Any:
    if isinstance(value, tuple) and part.isdigit() and int(part) < len(value):
        return value[int(part)]
    if isinstance(value, Mapping) and part in value:
        return value[part]
    if isinstance(value, BaseModel) and part in type(value).model_fields:
        return getattr(value, part)
    raise KeyError(f"there is no {part!r} on the way to {path!r}")


def frozen(value: Any) -> Any:
    """Return `value` with lists turned into tuples, as the strict models want them."""
    if isinstance(value, list | tuple):
        return tuple(frozen(item) for item in value)
    if isinstance(value, Mapping):
        return {key: frozen(item) for key, item in value.items()}
    return value


ASSUMED_LAW = re.compile(r".*\.(fatigue|relaxation)(?=\.)")
"""Path of a block that a named material has without a word in the file."""


def _is_stated_at(data: Any, parts: list[str]) -> bool:
    """Return True if a block is stated at a path."""
    for part in parts:
        if isinstance(data, tuple | list) and part.isdigit() and int(part) < len(data):
            data = data[int(part)]
        elif isinstance(data, Mapping) and part in data:
            data = data[part]
        else:
            return False
    return True


def _stated_leaves(everything: Mapping[str, Any], stated: Mapping[str, Any]) -> Iterator[tuple[str, float | int]]:
    """Yield every numeric leaf as (dotted path, value), but for those of laws that a material has by its name alone."""
    for path, value in _numeric_leaves(everything, ""):
        law = ASSUMED_LAW.match(path)
        if law is None or _is_stated_at(stated, law[0].split(".")):
            yield path, value


def _numeric_leaves(value: Any, path: str) -> Iterator[tuple[str, float | int]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _numeric_leaves(item, f"{path}.{key}" if path else key)
    elif isinstance(value, tuple | list):
        for index, item in enumerate(value):
            yield from _numeric_leaves(item, f"{path}.{index}")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path, value


__all__ = [
    "Analysis",
    "DesignBlock",
    "DesignKeys",
    "Displacement",
    "Length",
    "Model",
    "NonNegativeLength",
    "PositiveForce",
    "PositiveLength",
    "Requirement",
    "SolidAnalysis",
    "Spec",
    "frozen",
    "is_made",
    "readable_requirement",
    "refuse",
]
