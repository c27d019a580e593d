"""References that metrics of a curve need: target, allowable stress, other load cases, model between points, error."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.arrays import FloatArray
    from cfmkit.curves import Curve
    from cfmkit.metrics.fatigue_and_relaxation import Durability
    from cfmkit.results import ClosedForm, WindingPath
    from cfmkit.specs.evaluable_target_curve import TargetCurve


@dataclass(frozen=True)
class MeasuringFrame:
    """References that a curve is measured against."""

    target: float | None = None  # the force or torque it should have [N or N m]
    reference: float | None = None  # motion of the reference pose [m or rad]; default: the centre of the window
    allowable_stress: float | None = None  # [Pa]
    band: float = 0.05  # half width of the force band of ``usable_stroke``, as a fraction
    # intervals of the motion in which the mechanism works as intended; None: everywhere
    valid: tuple[tuple[float, float], ...] | None = None
    load_cases: tuple[Curve, ...] = ()  # whose stress counts beside the curve's own
    # the model at every place, for metrics that are places
    closed: ClosedForm | None = field(default=None, compare=False)
    # points at which windows end between those of the curve, with their stress
    ends: Curve | None = field(default=None, compare=False)
    winding: WindingPath | None = field(default=None, compare=False)  # the model of a branch whose motion turns back
    durability: Durability | None = None  # fatigue and relaxation of the material
    curve: TargetCurve | None = None  # what it should follow where it is not to be constant
    over_motion: bool = False
    """Whether means are over the motion and not over the points: those of a recording stand where its clock put them.
    """
    # numerical error of the effort [N or N m], below which there is nothing to compare with; None: not stated
    effort_error: float | None = None
    # returns the largest effort of one spring or member of a branch at places of its motion (`Result.part_efforts`)
    part_efforts: Callable[[str, FloatArray], FloatArray] | None = field(default=None, compare=False)
