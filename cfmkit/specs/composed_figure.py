"""What a file of a composed figure may say: which pictures of which runs stand beside each other."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from cfmkit.specs.spec import Model
from cfmkit.specs.units import Length


class Panel(Model):
    """One picture."""

    run: str = Field(min_length=1, description="a specification, or the output folder of a run; relative to this file")
    plot: str = Field(min_length=1, description="name of the figure, as in figures/, without the extension")
    verb: Literal["analyze", "design", "sweep"] | None = Field(
        None, description="verb to run; default: sweep if the specification has such a block, else analyze"
    )
    label: str = Field("", description="text beside the panel's letter")


class ComposedFigure(Model):
    """A figure of several panels."""

    panels: tuple[Panel, ...] = Field(min_length=1, max_length=24, description="from left to right, then down")
    columns: int = Field(2, ge=1, le=6, description="panels beside each other")
    width: Annotated[Length, Field(ge=0.06, le=0.6)] = Field(
        0.174,
        description="width in print, at which lettering keeps its size; default: 174 mm, two columns of a journal",
    )
    description: str = Field("", description="free text")
