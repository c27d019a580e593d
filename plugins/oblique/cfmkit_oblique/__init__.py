"""Two oblique springs beside a vertical one: quasi-zero stiffness [Carrella, Brennan, Waters 2007]."""

from functools import partial

from cfmkit.families.base import Family
from cfmkit_oblique.design import design
from cfmkit_oblique.model import DEFINITIONS, FINDINGS, Solution, analyze, resolve
from cfmkit_oblique.spec import ObliqueSpec

FAMILY = Family(
    name="oblique",
    summary="a slider on a vertical spring between two oblique springs: quasi-zero stiffness",
    spec_type=ObliqueSpec,
    models={"cubic": partial(analyze, Solution.cubic), "exact": partial(analyze, Solution.exact)},
    design=design,
    values=DEFINITIONS,
    resolve=resolve,
    draw="cfmkit_oblique.figures",
    dimension_drawing="cfmkit_oblique/dimensions.svg",
    outline="cfmkit_oblique.outline",
    headline=("plateau_force", "plateau_position", "plateau_stiffness", "stiffness_ratio", "band_range_1pct"),
    branches=("load",),
    template="cfmkit_oblique/template.yaml",
    findings=FINDINGS,
    references=(
        "A. Carrella, M.J. Brennan, T.P. Waters, Static analysis of a passive vibration isolator with "
        "quasi-zero-stiffness characteristic, J. Sound Vib. 301 (2007) 678-689",
    ),
    interface=1,
)
