"""Base of every block of a specification, lengths and forces within bounds, and the keys that a block states."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Self, TypeVar

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

    def derive(self, **values: Any) -> Self:
        """Return a copy with other values, which are neither validated nor counted as stated: no file has them."""
        copy = self.model_copy()
        for name, value in values.items():
            object.__setattr__(copy, name, value)  # past the frozen model
        return copy


Block = TypeVar("Block", bound=Model)


def replace_blocks(value: Any, kind: type[Block], change: Callable[[Block], Block]) -> Any:
    """Return a block, or a list or mapping of some, in which all blocks of a kind are changed.

    Blocks without one in them are shared; what is stated stays so. In a validator of `Spec`, which has checked all
    blocks, ``object.__setattr__(self, "mechanism", replace_blocks(self.mechanism, MaterialSpec, ...))`` derives values
    of all materials from the analysis.
    """
    if isinstance(value, kind):
        return change(value)
    if isinstance(value, Model):
        items = {name: getattr(value, name) for name in type(value).model_fields}
        replaced = {name: replace_blocks(item, kind, change) for name, item in items.items()}
        changes = {name: item for name, item in replaced.items() if item is not items[name]}
        return value.derive(**changes) if changes else value
    if isinstance(value, tuple):
        listed = tuple(replace_blocks(item, kind, change) for item in value)
        return listed if any(new is not old for new, old in zip(listed, value, strict=True)) else value
    if isinstance(value, Mapping):
        mapped = {key: replace_blocks(item, kind, change) for key, item in value.items()}
        return mapped if any(mapped[key] is not item for key, item in value.items()) else value
    return value


def keys_of(block: Any) -> Mapping[str, Any]:
    """Return the keys and values that a block states or its validators set; empty if it is no block.

    It need not be validated: for validators that run before, to which `Spec.replace` gives validated blocks beside what
    a file says.
    """
    if isinstance(block, Model):
        return {name: getattr(block, name) for name in block.model_fields_set}
    return block if isinstance(block, Mapping) else {}
