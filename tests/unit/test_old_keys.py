"""Keys that have another name now: what stands under the old one means the same, and a line says the new one."""

from __future__ import annotations

import pytest

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.results import OLD_KEY
from cfmkit.studies.parts.assumed_errors import assumed
from cfmkit.studies.parts.parts import Parts


def warned(spec):
    return {one.name: one.message for one in cfmkit.analyze(spec).warnings}


def test_tolerances_of_a_search_of_shapes_are_tolerances_of_the_design():
    spec = cfmkit.load("configs/beam_design_arch.yaml")
    old = {"nodes": "0.05 mm", "coefficients": "0.01 rad", "samples": 30}
    by_old = spec.replace({"design.optimise.tolerances": old})
    shape = [f"mechanism.beams.s.shape.coefficients.{k}" for k in (1, 2, 3)]
    reported = {path: {"normal": "0.01 rad"} for path in shape[: len(spec.mechanism.beams["s"].shape.coefficients) - 1]}
    by_new = spec.replace({"design.tolerances": {"mechanism.nodes.b.at.1": {"normal": "0.05 mm"}} | reported})
    found, wanted = (Parts.of_design(one, one.design, 0) for one in (by_old, by_new))
    stated = [{one.path: one.spread.deviation for one in each.parameters} for each in (found, wanted)]
    assert stated[0] == pytest.approx(stated[1])
    assert (found.samples, wanted.samples) == (30, 400)
    assert Parts.of_design(spec, spec.design, 0) is None
    assert OLD_KEY not in warned(by_new)
    message = warned(by_old)[OLD_KEY]
    assert "'design.optimise.tolerances' is the old name of 'design.tolerances'" in message
    assert "mechanism.nodes.b.at.1: {normal: 0.05 mm}" in message


def test_the_tolerances_of_a_design_count_where_both_are_given():
    spec = cfmkit.load("configs/beam_design_arch.yaml").replace(
        {
            "design.optimise.tolerances": {"nodes": "0.05 mm"},
            "design.tolerances": {"mechanism.thickness": {"normal": "0.01 mm"}},
        }
    )
    assert Parts.of_design(spec, spec.design, 0).paths == ("mechanism.thickness",)


def test_the_process_of_a_printed_slider_crank_is_that_of_its_part():
    spec = cfmkit.load("configs/slider_crank_strip.yaml")
    values = {"analysis.points": 11}
    new = spec.replace({**values, "mechanism.part": {"process": {"position": "0.1 mm", "least_feature": "2 mm"}}})
    old = spec.replace({**values, "mechanism.part": None, "mechanism.process": {"layer": "0.1 mm", "thinnest": "2 mm"}})
    by_new, by_old = warned(new), warned(old)
    assert "kink_too_small" in by_new
    assert "too_thin" in by_new
    assert "position: 0.1 mm, least_feature: 2 mm" in by_old.pop(OLD_KEY)
    assert by_old == by_new


def test_the_process_of_a_part_is_what_it_is_assumed_to_be_made_by_and_its_own_values_count():
    spec = cfmkit.load("configs/slider_crank_strip.yaml")
    named = spec.replace({"mechanism.part": {"process": "mill"}})
    own = spec.replace({"mechanism.part": {"process": {"name": "mill", "thickness": "0.007 mm"}}})
    assert assumed(named).deviations == {"mechanism.beam.offset": 2e-5}
    assert assumed(own).deviations == {"mechanism.beam.offset": pytest.approx(7e-6)}
    assert assumed(own).process.least_feature == assumed(named).process.least_feature
    # it says how parts are made where their yield is asked for, and judges no parts otherwise
    assert Parts.of_design(own, own.design, 0) is None
    asked = own.replace({"design.yield": 0.9})
    assert Parts.of_design(asked, asked.design, 0).paths == ("mechanism.beam.offset",)


def test_a_process_that_is_none_is_refused():
    with pytest.raises(SpecError, match="process"):
        cfmkit.load("configs/slider_crank_strip.yaml").replace({"mechanism.part": {"process": "origami"}})


OLD_TOLERANCES = {
    "beam_design_arch": ["design.optimise.tolerances={nodes: 0.05 mm, samples: 20}"],
    "slider_crank_strip": ["mechanism.part=null", "mechanism.process={layer: 0.1 mm, thinnest: 0.4 mm}"],
}


@pytest.mark.parametrize("name", sorted(OLD_TOLERANCES))
def test_a_requirement_on_the_yield_is_content_with_tolerances_under_an_old_name(name):
    asked = "requirements=[{metric: stress_max, max: 42.5 MPa}, {metric: yield, min: 40 %}]"
    file = f"configs/{name}.yaml"
    spec = cfmkit.load(file, [*OLD_TOLERANCES[name], asked])
    made = Parts.of_design(spec, spec.design, 0)
    assert made.paths
    unsaid = OLD_TOLERANCES[name][:-1]
    with pytest.raises(SpecError, match=r"state their tolerances in 'design\.tolerances'"):
        cfmkit.load(file, [*unsaid, asked])
