"""What yield is to be expected of a design that says nothing of its tolerances."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

import cfmkit
from cfmkit import Run
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.stock import MATERIALS_BY_NAME, PROCESSES_BY_NAME
from cfmkit.studies.parts import requirement_rows
from cfmkit.studies.parts.drawn_parts import analyze_parts
from cfmkit.studies.parts.near_parts import expected_shares, expected_yield
from cfmkit.studies.parts.parts import Parts, assume_errors, tolerances
from cfmkit.studies.stock_and_digits import decimals_of

STRIP = "configs/slider_crank_strip.yaml"


def test_every_process_has_a_reason_and_a_size():
    for one in PROCESSES_BY_NAME.values():
        assert one.reason
        assert 0 < one.position < 1e-3
        assert 0 < one.thickness < one.least_feature


def test_the_estimate_is_near_the_yield_of_parts_that_are_analysed():
    asked = ({"metric": "force_mean", "min": "1.4 N", "max": "1.6 N"}, {"metric": "half_band", "max": "1.5 %"})
    spec = cfmkit.load(STRIP).replace({"requirements": asked, "analysis.points": 17})
    spec = spec.replace({"design.process": "wire-edm", "design.samples": 20})
    result = cfmkit.analyze(spec)
    shares = expected_shares(result, Parts.from_assumed_errors(spec, 0), Run())
    made = Parts.from_design(spec, spec.design, 0)
    assert made.paths == ("mechanism.beam.offset",)
    judged = analyze_parts(made, made.draw(), result, Run()).share()
    share = shares.good.value
    assert shares.good == shares.measured
    assert not shares.proportional  # no spread of the modulus is stated
    assert abs(share - judged.value) < 3 * (share * (1 - share) / judged.count) ** 0.5 + 0.02


def test_the_band_of_a_named_material_is_the_spread_of_its_modulus():
    asked = ({"metric": "force_mean", "min": "1 N", "max": "2 N"},)
    spec = cfmkit.load(STRIP).replace({"requirements": asked, "analysis.points": 17})
    spec = spec.replace({"mechanism.material": "pla", "mechanism.beam.width": "3.083 mm"})
    found = assume_errors(spec)
    assert (found.process.name, found.modulus) == ("fdm", (1.6e9, 4.0e9))
    reported = expected_yield(cfmkit.analyze(spec), Run())
    assert "assumed" in reported
    assert "once the modulus is measured" in reported
    assert "design.process=fdm" in reported


def test_what_is_assumed_is_of_the_materials_that_beams_have():
    """The process was that of a material no beam has, and its modulus was drawn, which changes nothing."""
    spec = cfmkit.load("configs/beam_lan2010.yaml")
    bands = {name: one.scatter.youngs_modulus for name, one in MATERIALS_BY_NAME.items()}
    paths = [f"mechanism.beams.{name}.material" for name in spec.mechanism.beams]

    def found(top, *own):
        changes = {path: {"name": name} for path, name in zip(paths, own, strict=False)}
        return spec.replace({"mechanism.material": {"name": top}, **changes})

    def reported(part):
        made = assume_errors(part)
        return made.process.name, made.modulus, made.as_stated

    assert reported(found("pla")) == ("fdm", bands["pla"], False)
    assert reported(found("pla", *["steel-304"] * 4)) == ("wire-edm", None, True)
    assert reported(found("steel-304", *["pla"] * 4)) == ("fdm", None, True)
    assert reported(found("steel-304", "pla")) == ("fdm", bands["steel-304"], True)
    assert "mechanism.material.youngs_modulus" not in tolerances(found("pla", *["steel-304"] * 4))
    assert "mechanism.material.youngs_modulus" in tolerances(found("pla"))


def test_the_estimate_does_not_solve_the_design_again(monkeypatch):
    """Its analysis is known, and what was seen of it at a few poses: only its neighbours are solved."""
    spec = cfmkit.load("configs/beam_design_arch.yaml").replace(
        {"design": None, "requirements": ({"metric": "range_95_fraction", "min": "20 %"},)}
    )
    result = cfmkit.analyze(spec)
    record, solved, looked = family(spec.family), [], []
    analyze, sample = record.analyze, record.sample

    def analysed(part, run):
        solved.append(part)
        return analyze(part, run)

    def seen(part, places, paths=()):
        if paths:  # for slopes: here there are none
            return None
        looked.append(part)
        return sample(part, places)

    changed = SimpleNamespace(analyze=analysed, sample=seen, with_envelope=record.with_envelope)
    monkeypatch.setattr(requirement_rows, "family", lambda _name: changed)
    expected_shares(result, Parts.from_assumed_errors(spec, 0), Run())
    nominal = spec.mechanism.model_dump()
    assert sum(part.mechanism.model_dump() == nominal for part in looked) == 1
    again = [part for part in solved if part.mechanism.model_dump() == nominal]
    assert all(part.analysis.points < spec.analysis.points for part in again)  # once with fewer points, if any
    assert len(again) <= 1 < len(solved)


def test_the_process_of_a_part_is_what_it_is_assumed_to_be_made_by_and_its_own_values_count():
    spec = cfmkit.load(STRIP)
    named = spec.replace({"mechanism.part": {"process": "mill"}})
    own = spec.replace({"mechanism.part": {"process": {"name": "mill", "thickness": "0.007 mm"}}})
    assert assume_errors(named).deviations == {"mechanism.beam.offset": 2e-5}
    assert assume_errors(own).deviations == {"mechanism.beam.offset": pytest.approx(7e-6)}
    assert assume_errors(own).process.least_feature == assume_errors(named).process.least_feature
    # it says how parts are made where their yield is asked for, and judges no parts otherwise
    assert Parts.from_design(own, own.design, 0) is None
    asked = own.replace({"design.yield": 0.9})
    assert Parts.from_design(asked, asked.design, 0).paths == ("mechanism.beam.offset",)


def test_the_process_of_a_part_warns_of_what_it_cannot_make():
    part = {"process": {"position": "0.1 mm", "least_feature": "2 mm"}}
    spec = cfmkit.load(STRIP).replace({"analysis.points": 11, "mechanism.part": part})
    assert {"kink_too_small", "too_thin"} <= {one.name for one in cfmkit.analyze(spec).warnings}


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        ({"mechanism.part": {"process": "origami"}}, "process"),
        ({"mechanism.process": {"layer": "0.1 mm"}}, r"'process' was removed; write 'part: \{process: \{position"),
    ],
    ids=["none", "the old place"],
)
def test_a_process_that_is_none_is_refused(change, reported):
    with pytest.raises(SpecError, match=reported):
        cfmkit.load(STRIP).replace(change)


def test_tolerances_of_a_search_of_shapes_are_those_of_its_audit_alone():
    spec = cfmkit.load("configs/beam_design_arch.yaml").replace({"design.optimise.tolerances": {"nodes": "0.05 mm"}})
    assert Parts.from_design(spec, spec.design, 0) is None
    toleranced = spec.replace({"design.tolerances": {"mechanism.nodes.b.at.1": {"normal": "0.05 mm"}}})
    assert Parts.from_design(toleranced, toleranced.design, 0).paths == ("mechanism.nodes.b.at.1",)


def test_the_last_digit_is_at_most_a_tenth_of_the_deviation_of_the_process():
    for process in PROCESSES_BY_NAME.values():
        unit = 10.0 ** -decimals_of(process) * 1e-3
        deviation = min(process.thickness, process.position)
        assert unit <= 0.1 * deviation * (1 + 1e-9)
        assert unit > 0.01 * deviation or math.isclose(unit, 0.01 * deviation)
