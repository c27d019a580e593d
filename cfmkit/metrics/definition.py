"""Definition of a metric: its name, unit, meaning, and the function that computes it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Kind


Worst = Literal["largest", "smallest", "farthest-from-target"]
Scope = Literal["branch", "cycle", "loop", "value"]

_DIMENSION_OF_PLACEHOLDER: Mapping[Kind, Mapping[str, str]] = {
    "force": {"effort": "force", "motion": "length", "work": "energy"},
    "torque": {"effort": "torque", "motion": "angle", "work": "energy"},
}
_MOTION_WORDS = {"force": "displacement", "torque": "angle"}


@dataclass(frozen=True)
class Definition:
    """Definition of a metric."""

    name: str  # as requirements and tables call it
    dimension: str  # a name of `cfmkit.specs.units`, or "effort", "motion", "work": what that is depends on the curve
    definition: str  # one sentence with the source; ``{effort}`` and ``{motion}`` stand for the curve's words
    # takes `RowsInWindow` (or `CycleRows`, see `scope`), returns SI, (d,), NaN where there is none; of one curve raises
    # `Undefined` with the reason; None: the family computes it and puts it into `Result.values`
    function: Callable[..., FloatArray] | None = None
    worst: Worst = "largest"  # which branch counts where none is named; without a target the farthest is the smallest
    # what it belongs to: one branch; all branches together, or one of them alone; the closed loop only; or no curve at
    # all
    scope: Scope = "branch"
    windowed: bool = True  # whether it looks only inside the window
    argument: str = ""  # what stands in its brackets in place of a branch: a dimension, or nothing
    of_material: bool = False  # whether it is there only where the material says something about use
    of_curve: bool = False  # whether it is there only where a target curve is
    of_parts: bool = False  # whether it is there only where the model knows the efforts of single springs and members

    @property
    def is_known_in_rows(self) -> bool:
        """Whether rows of many mechanisms have it: what a material says of its use stands with single curves."""
        return self.function is not None and not self.of_material

    @property
    def per_branch(self) -> bool:
        """Whether ``name[branch]`` means something."""
        return self.scope in ("branch", "cycle") and not self.argument

    def state_for_kind(self, kind: Kind) -> Definition:
        """Return the definition in the words and units of one kind of curve."""
        text = self.definition.replace("{effort}", kind).replace("{motion}", _MOTION_WORDS[kind])
        return replace(
            self, dimension=_DIMENSION_OF_PLACEHOLDER[kind].get(self.dimension, self.dimension), definition=text
        )
