"""From what is wanted to a specification: one way for each key of the block `design`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.results import Design, Status

if TYPE_CHECKING:
    from cfmkit.families.base import Run
    from cfmkit.families.beam.spec import BeamSpec


def design(spec: BeamSpec, run: Run) -> Design:
    """Return a complete specification that does what the `design` block asks for, or why there is none.

    Parameters
    ----------
    spec : BeamSpec
        With a `design` block.
    run : Run
        Seed, progress and time budget.
    """
    if spec.design is not None and spec.design.rescale is not None:
        from cfmkit.families.beam.rescale import rescaled

        return rescaled(spec, spec.design.rescale)
    if spec.design is not None and spec.design.optimise is not None:
        from cfmkit.families.beam.shaping.design import shaped

        return shaped(spec, spec.design.optimise, run)
    return Design(None, Status.INVALID, "this spec has no 'design' block: add 'rescale' or 'optimise'")
