"""Record by which the registry knows slider-cranks: their models, design, proposals, pictures, names of results."""

from __future__ import annotations

from cfmkit.families.base import DesignMethod, ElasticParts, Family, Pictures, ResultNames
from cfmkit.families.deferred_imports import deferred_imports
from cfmkit.families.end_stops import STOP_QUANTITIES
from cfmkit.families.slider_crank.findings import SLIDER_CRANK_FINDINGS
from cfmkit.families.slider_crank.linkage import resolve
from cfmkit.families.slider_crank.printed.scalar_results import SCALAR_DEFINITIONS as OF_PARTS
from cfmkit.families.slider_crank.spec import SliderCrankSpec
from cfmkit.families.slider_crank.springs.bistability_class import CLASS_NAMES
from cfmkit.families.slider_crank.springs.scalar_results import SCALAR_DEFINITIONS as OF_SPRINGS

with deferred_imports():
    from cfmkit.families.slider_crank.design import design
    from cfmkit.families.slider_crank.figures import figures, moving
    from cfmkit.families.slider_crank.force_at_few_poses import sample_poses
    from cfmkit.families.slider_crank.outline import drawing
    from cfmkit.families.slider_crank.part import part_over_motion
    from cfmkit.families.slider_crank.printed.model import analyze as analyze_printed
    from cfmkit.families.slider_crank.printed.plane_fem_analysis import analyze as analyze_solid
    from cfmkit.families.slider_crank.printed.plane_fem_analysis import elastic_networks, elastic_parts
    from cfmkit.families.slider_crank.proposals import propose
    from cfmkit.families.slider_crank.redesign_variables_and_process_errors import errors, free
    from cfmkit.families.slider_crank.springs.model import analyze, gradient, solve_rows

FAMILY_RECORD = Family(
    name="slider-crank",
    summary="a crank, a coupler and a slider with a spring at each joint: constant torque or force",
    spec_type=SliderCrankSpec,
    models={"prb": analyze, "lumped": analyze_printed, "beam": analyze_printed, "solid": analyze_solid},
    outputs=ResultNames(
        values=OF_SPRINGS | OF_PARTS | STOP_QUANTITIES,
        words={"stiffness_class": CLASS_NAMES},
        findings=SLIDER_CRANK_FINDINGS,
        headline=("stiffness_class", "band_range_05pct", "half_band", "energy_max", "crank_pin_rotation_max"),
    ),
    folder="cfmkit/families/slider_crank",
    resolve=resolve,
    design=DesignMethod(
        design, levels=("design.force",), findings=("near_optima", "spring_dropped", "window_not_proven")
    ),
    rows=solve_rows,
    gradient=gradient,
    sample=sample_poses,
    free=free,
    errors=errors,
    draw=Pictures(figures, moving),
    outline=drawing,
    elastic=ElasticParts(elastic_parts, elastic_networks),
    propose=propose,
    part=part_over_motion,
)
