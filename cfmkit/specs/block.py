"""The base of every block of a specification."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Model(BaseModel):
    """Base of every block: frozen, no unknown keys, no silent type changes."""

    # Blocks stand in others, and only the whole is validated: built with it, each is built once, and quicker to import.
    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True, defer_build=True
    )
