"""The base of every block of a specification, and values within bounds that many blocks have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field

from cfmkit.arrays import MAX_REPR_LENGTH, Named
from cfmkit.specs.units import Force, Length

PositiveLength = Annotated[Length, Field(gt=0)]
NonNegativeLength = Annotated[Length, Field(ge=0)]
PositiveForce = Annotated[Force, Field(gt=0)]


STUDY_BLOCKS = ("sweep", "sensitivity", "suggest")
"""Blocks of a specification that no analysis reads."""


class Model(BaseModel):
    """Base of every block: frozen, no unknown keys, no silent type changes."""

    def __repr__(self) -> str:
        """Return the block as it is built, or its fields where that is too long."""
        text = super().__repr__()
        return text if len(text) <= MAX_REPR_LENGTH else f"{type(self).__name__}({Named(self)!r})"

    # Blocks stand in others, and only the whole is validated: built with it, each is built once, and quicker to import.
    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True, defer_build=True
    )

    removed_keys: ClassVar[dict[str, str]] = {}
    """Keys of earlier versions -> what to write instead."""


def keys_of(block: Any) -> Mapping[str, Any]:
    """Return what is given in a block, and what its validators set, by key; nothing if it is no block.

    It need not be validated: for validators that run before, to which `Spec.replace` gives validated blocks beside what
    a file says.
    """
    if isinstance(block, Model):
        return {name: getattr(block, name) for name in block.model_fields_set}
    return block if isinstance(block, Mapping) else {}
