"""From text to a specification and back: YAML with places, units, blocks of all families, targets, own metrics."""

from typing import TYPE_CHECKING

from cfmkit.lazy_names import lazy_names

if TYPE_CHECKING:
    from cfmkit.specs.evaluable_target_curve import TargetCurve as TargetCurve
    from cfmkit.specs.keys_and_schema import keys as keys
    from cfmkit.specs.keys_and_schema import schema as schema
    from cfmkit.specs.spec import Analysis as Analysis
    from cfmkit.specs.spec import Model as Model
    from cfmkit.specs.spec import PositiveForce as PositiveForce
    from cfmkit.specs.spec import PositiveLength as PositiveLength
    from cfmkit.specs.spec import Requirement as Requirement
    from cfmkit.specs.spec import Spec as Spec
    from cfmkit.specs.study_spec import Sensitivity as Sensitivity
    from cfmkit.specs.study_spec import Sweep as Sweep

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "evaluable_target_curve": "TargetCurve",
        "keys_and_schema": "keys schema",
        "spec": "Analysis Model PositiveForce PositiveLength Requirement Spec",
        "study_spec": "Sensitivity Sweep",
    },
)
