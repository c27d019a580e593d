"""Specification of the snap-through leaves and of the spring of leaves, with the kinds that there are of each."""

from __future__ import annotations

from math import radians
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from cfmkit.families.vcfm.leaves.cosine import COSINE_LEAF
from cfmkit.families.vcfm.leaves.hybrid import HYBRID_LEAF
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import (
    DIAMOND_SPRING,
    FOLDED_SPRING,
    STRAIGHT_SPRING,
    U_SHAPE,
)
from cfmkit.families.vcfm.leaves.v_beam import V_BEAM
from cfmkit.specs.spec import Model, NonNegativeLength, PositiveLength
from cfmkit.specs.units import Angle, Ratio

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cfmkit.families.vcfm.leaves.kinds import LeafKind, SpringKind, StructureKind

LEAF_KINDS: dict[str, LeafKind] = {kind.name: kind for kind in (V_BEAM, COSINE_LEAF, HYBRID_LEAF)}
SPRING_KINDS: dict[str, SpringKind] = {
    kind.name: kind for kind in (DIAMOND_SPRING, FOLDED_SPRING, STRAIGHT_SPRING, U_SHAPE)
}
"""Every kind of snap-through leaf, and of springs of leaves, in the order of the documentation.

A new one is its file in `leaves/`, and its record here.
"""

if TYPE_CHECKING:
    LeafName = str
    SpringName = str
else:
    LeafName = Literal[tuple(LEAF_KINDS)]
    SpringName = Literal[tuple(SPRING_KINDS)]

LeafAngle = Annotated[Angle, Field(ge=0, le=radians(40))]
SteepAngle = Annotated[Angle, Field(gt=0, le=radians(40))]


def _check_sizes(block: Positive | Bistable) -> None:
    if block.thickness >= block.length:
        raise ValueError("'thickness' must be smaller than 'length': a leaf is long and thin")
    for key, what in block.kind.needs.items():
        if getattr(block, key) is None:
            raise ValueError(f"'structure: {block.structure}' needs '{key}', {what}")


def _list_descriptions(kinds: Iterable[StructureKind]) -> str:
    *others, last = (kind.description for kind in kinds)
    return f"{', '.join(others)}, or {last}"


class Positive(Model):
    """The spring: the structure with a positive stiffness, whose far end the preload moves."""

    structure: SpringName = Field(DIAMOND_SPRING.name, description=_list_descriptions(SPRING_KINDS.values()))
    loaded: Literal["whole", "half"] = Field("whole", description="all of the structure, or one side of it only")
    length: PositiveLength = Field(description="of one flexible leaf, L1")
    angle: LeafAngle = Field(0.0, description="of a diamond's leaves from the direction across the motion, theta1")
    thickness: PositiveLength = Field(description="in the plane, t1")
    width: PositiveLength = Field(description="out of the plane, b1")
    radius: PositiveLength | None = Field(
        None, description="of the flexible semicircle of a u-shape; the others have none"
    )

    @property
    def kind(self) -> SpringKind:
        """Record of the kind of this spring."""
        return SPRING_KINDS[self.structure]

    @model_validator(mode="after")
    def _sizes_fit(self) -> Self:
        _check_sizes(self)
        return self


class Bistable(Model):
    """The leaves between wall and shuttle that snap through, and so have a negative stiffness."""

    structure: LeafName = Field(V_BEAM.name, description=_list_descriptions(LEAF_KINDS.values()))
    half_beams: int = Field(
        ge=1, le=1000, description="leaves between wall and shuttle, all together: one V has two, two Vs have four"
    )
    guided: bool = Field(True, description="whether the shuttle cannot turn: two Vs at a distance, or a guide")
    length: PositiveLength = Field(description="between the ends of a leaf, L2")
    angle: SteepAngle = Field(description="of that line from the direction across the motion, theta2")
    thickness: PositiveLength = Field(description="in the plane, t2")
    width: PositiveLength = Field(description="out of the plane, b2")
    flexure_length: PositiveLength | None = Field(None, description="of each of a hybrid leaf's two flexures")
    stiffening: Annotated[Ratio, Field(ge=1.5, le=100)] | None = Field(
        None, description="thickness of a hybrid leaf's middle over that of its flexures; default 4"
    )
    waviness: NonNegativeLength = Field(
        0.0, description="deviation of an unloaded leaf from its shape, in its buckling mode; exact model only"
    )

    @property
    def kind(self) -> LeafKind:
        """Record of the kind of these leaves."""
        return LEAF_KINDS[self.structure]

    @model_validator(mode="after")
    def _sizes_fit(self) -> Self:
        _check_sizes(self)
        if self.flexure_length and 2.0 * self.flexure_length >= self.length:
            raise ValueError("two flexures of 'flexure_length' must be shorter than 'length'")
        return self
