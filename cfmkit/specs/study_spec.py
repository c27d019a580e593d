"""Blocks `sweep` and `sensitivity` of a specification, and the tolerances that studies and designs have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from cfmkit.numerics.unit_cube_samples import SAMPLE_KINDS, list_phrases
from cfmkit.specs.block import Model
from cfmkit.specs.sensitivity_methods import METHOD_NAMES, MethodWord, describe_methods, describe_samples
from cfmkit.specs.units import MetricValue, Ratio

SweepValue = str | int | float | bool

if TYPE_CHECKING:
    Combine = str
    SampleWord = str
else:
    SampleWord = Literal[tuple(SAMPLE_KINDS)]
    Combine = Literal["grid", "zip", *SAMPLE_KINDS]


class Sweep(Model):
    """Block `sweep`: the durable form of ``--vary``."""

    vary: dict[str, str | tuple[SweepValue, ...]] = Field(
        description="dotted path: 'start:stop:n' with units, e.g. '8 mm:16 mm:5', or a list of values", min_length=1
    )
    combine: Combine = Field(
        "grid",
        description=f"all combinations, values in step, {list_phrases()}; ranges of what is drawn are 'start:stop'",
    )
    samples: int | None = Field(None, ge=1, description=f"points of {list_phrases()}")
    design: bool = Field(False, description="redesign the mechanism at each point")
    metrics: tuple[str, ...] = Field((), description="columns of results.csv; default: all metrics and values")
    curves: bool = Field(False, description="keep the curve of every point in curves.csv")

    @model_validator(mode="after")
    def _require_samples_if_drawn(self) -> Self:
        if (self.combine in SAMPLE_KINDS) != (self.samples is not None):
            kinds = "' or '".join(SAMPLE_KINDS)
            raise ValueError(f"'samples' and 'combine: {kinds}' belong together: give both or neither")
        return self


class Tolerance(Model):
    """Deviation of a value from its nominal one; a percentage is of the nominal value."""

    normal: MetricValue | None = Field(None, description="standard deviation, e.g. '0.1 mm' or '2 %'")
    uniform: MetricValue | None = Field(
        None, description="half width of a range in which all values are equally likely"
    )
    truncate: MetricValue | None = Field(None, description="parts that deviate by more are rejected before assembly")

    @model_validator(mode="after")
    def _require_one_distribution(self) -> Self:
        if (self.normal is None) == (self.uniform is None):
            raise ValueError("give either 'normal' (a standard deviation) or 'uniform' (a half width)")
        if self.truncate is not None and self.normal is None:
            raise ValueError("'truncate' cuts the tails of 'normal'; a 'uniform' tolerance has none")
        return self


class Correlated(Model):
    """Parameters that deviate together, such as all springs of one batch."""

    parameters: tuple[str, ...] = Field(
        min_length=1, description="paths as under 'parameters'; `.*` stands for every item of a list"
    )
    correlation: Ratio = Field(
        1.0,
        ge=-1,
        le=1,
        description="correlation coefficient between any two of the parameters; 1: all deviate by the same share",
    )


class Sensitivity(Model):
    """Block `sensitivity`."""

    removed_keys: ClassVar[dict[str, str]] = {
        "on_failure": "samples without a result are counted and reported; indices that need them are not stated"
    }
    method: MethodWord = Field("oat", description=describe_methods())
    parameters: dict[str, tuple[MetricValue, MetricValue] | Tolerance] = Field(
        min_length=1, description="dotted path: a range [199 mm, 201 mm] or a tolerance {normal: 0.1 mm}"
    )
    correlated: tuple[Correlated, ...] = Field((), description="parameters that deviate together; for tolerances")
    samples: int | None = Field(None, ge=2, description=describe_samples())
    sampling: SampleWord | None = Field(
        None,
        description=f"how samples are drawn: {list_phrases()}; default: "
        + ", ".join(f"{method.name}: {method.sampling}" for method in METHOD_NAMES.values() if method.sampling),
    )
    seed: int | None = Field(None, ge=0, description="seed of all random numbers; `--seed` takes precedence")
    metrics: tuple[str, ...] = Field((), description="default: those of the requirements, over their windows")
    min_yield: Ratio | None = Field(None, gt=0, le=1, description="share of parts that must meet all requirements")
    costs: dict[str, Annotated[float, Field(gt=0)]] = Field(
        {},
        description="inverse: a tolerance costs this number over its width, in any unit: {path: 2.0}; default: 1 each",
    )
    design: bool = Field(False, description="redesign the mechanism at each point")

    @model_validator(mode="after")
    def _sampling_where_drawn(self) -> Self:
        if self.sampling is not None and not METHOD_NAMES[self.method].sampling:
            methods = ", ".join(method.name for method in METHOD_NAMES.values() if method.sampling)
            raise ValueError(f"{self.method} has points of its own: 'sampling' is for {methods}")
        return self
