"""Record by which the registry knows beam mechanisms: models, design, proposals, pictures and names of results."""

from __future__ import annotations

from cfmkit.families.base import DesignMethod, ElasticParts, Family, Pictures, ResultNames
from cfmkit.families.beam.finding_names import BEAM_FINDINGS
from cfmkit.families.beam.network_from_spec import resolve
from cfmkit.families.beam.scalar_results import SCALAR_DEFINITIONS
from cfmkit.families.beam.spec import BeamSpec
from cfmkit.families.beam.tip_on_uneven_surface import TIP_DEFINITIONS
from cfmkit.families.deferred_imports import deferred_imports

with deferred_imports():
    from cfmkit.families.beam.design import design
    from cfmkit.families.beam.figures import figures, moving
    from cfmkit.families.beam.force_at_few_poses import sample_poses
    from cfmkit.families.beam.model import analyze, solve_rows
    from cfmkit.families.beam.outline import drawing
    from cfmkit.families.beam.part import part_over_motion
    from cfmkit.families.beam.plane_fem_analysis import analyze as analyze_solid
    from cfmkit.families.beam.plane_fem_analysis import elastic_networks, elastic_parts
    from cfmkit.families.beam.proposals import propose
    from cfmkit.families.beam.redesign_variables_and_process_errors import errors, free

FAMILY_RECORD = Family(
    name="beam",
    summary="a planar network of slender beams in large deflection",
    spec_type=BeamSpec,
    models={"inextensible": analyze, "extensible": analyze, "reissner": analyze, "solid": analyze_solid},
    outputs=ResultNames(
        values=SCALAR_DEFINITIONS | TIP_DEFINITIONS,
        findings=BEAM_FINDINGS,
        headline=(
            "nominal_force",
            "range_start",
            "range_fraction",
            "peak_force",
            "usable_stroke",
            "stress_max",
            "stress_limit_displacement",
            "frequency_held_min",
            "frequency_free_min",
        ),
    ),
    folder="cfmkit/families/beam",
    resolve=resolve,
    design=DesignMethod(
        design, levels=("design.rescale.force", "design.optimise.force.target"), tables=("starts.csv",)
    ),
    rows=solve_rows,
    sample=sample_poses,
    free=free,
    errors=errors,
    draw=Pictures(figures, moving),
    outline=drawing,
    elastic=ElasticParts(elastic_parts, elastic_networks),
    propose=propose,
    part=part_over_motion,
)
