"""Record of the family of two oblique springs beside a vertical one."""

from functools import partial

from cfmkit.families.base import DesignMethod, Family, Pictures, ResultNames
from cfmkit.families.deferred_imports import deferred_imports
from cfmkit_oblique.design import design
from cfmkit_oblique.model import DEFINITIONS, FINDINGS, Solution, analyze, resolve
from cfmkit_oblique.spec import ObliqueSpec

with deferred_imports():
    from cfmkit_oblique.figures import figures
    from cfmkit_oblique.outline import drawing

FAMILY_RECORD = Family(
    name="oblique",
    summary="a slider on a vertical spring between two oblique springs: quasi-zero stiffness",
    spec_type=ObliqueSpec,
    models={"cubic": partial(analyze, Solution.cubic), "exact": partial(analyze, Solution.exact)},
    outputs=ResultNames(
        values=DEFINITIONS,
        findings=FINDINGS,
        headline=("plateau_force", "plateau_position", "plateau_stiffness", "stiffness_ratio", "band_range_1pct"),
        branches=("load",),
    ),
    folder="cfmkit_oblique",
    resolve=resolve,
    design=DesignMethod(design),
    draw=Pictures(figures),
    outline=drawing,
    interface=1,
)
