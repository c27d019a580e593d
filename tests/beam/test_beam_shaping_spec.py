"""What is wrong with a block `design.optimise` is reported at its place, before anything is searched."""

from __future__ import annotations

import pytest
from beam_support import CONFIGS

import cfmkit
from cfmkit.designing import Clock
from cfmkit.errors import SpecError
from cfmkit.families.beam.shaping.design import _explain_no_design, task_of, with_stretch_and_shear
from cfmkit.families.beam.shaping.multistart import Explored
from cfmkit.families.beam.shaping.search import StartBudget

TEXT = (CONFIGS / "beam_design_arch.yaml").read_text()


@pytest.mark.parametrize(
    ("old", "new", "path", "words"),
    [
        ("{b: {y: [2 mm, 20 mm]}}", "{b: {y: [20 mm, 2 mm]}}", "free.b", "'y' must be increasing"),
        ("{b: {y: [2 mm, 20 mm]}}", "{c: {y: [2 mm, 20 mm]}}", "free.c", "there is no node 'c'; nodes are a, b"),
        ("{min: 0.4 N}", "{min: 0.4 N, target: 0.3 N}", "force", "'target' is below 'min'"),
        ("starts: 2", "starts: 2\n    compare: [4 mm, 8 mm]", "compare", "must be [a, b] with a > b > 0"),
        ("starts: 2", "starts: 2\n    beams: [s, r]", "beams.1", "there is no beam 'r'; beams are s"),
    ],
)  # fmt: skip
def test_nonsense_is_refused_at_its_place(old, new, path, words):
    assert old in TEXT
    text = TEXT.replace(old, new)
    with pytest.raises(SpecError) as caught:
        cfmkit.loads(text)
    (fault,) = caught.value.problems
    assert fault.path == f"design.optimise.{path}"
    assert words in fault.message
    assert fault.line > 20


def test_limits_of_the_specification_are_those_of_the_search():
    limits = "limits: {joint_opening: 0.5, clearance: 2 mm, min_radius: 3 mm, max_length_ratio: 1.2, "
    assert "limits: {" in TEXT
    spec = cfmkit.loads(TEXT.replace("limits: {", limits))
    held = task_of(spec, spec.design.optimise).limits
    assert (held.opening, held.clearance, held.radius, held.length_ratio) == (0.5, 2e-3, 3e-3, 1.2)


def test_nothing_that_may_vary_is_refused():
    text = TEXT.replace("free: {b: {y: [2 mm, 20 mm]}}", "beams: []")
    with pytest.raises(SpecError, match="leaves nothing to vary"):
        cfmkit.loads(text)


def test_a_start_that_the_time_ended_is_no_reason_to_widen_the_envelope():
    nothing = Explored({0: None}, reused=0, missing=0)
    assert "the time budget ended" in _explain_no_design(nothing, StartBudget(clock=Clock(0.0))).message
    assert "widen the envelope" in _explain_no_design(nothing, StartBudget()).message


@pytest.mark.parametrize(
    ("said", "model"),
    [
        ([], "reissner"),
        (["analysis.fidelity=inextensible"], "inextensible"),
        (["mechanism.axial=true"], "extensible"),
        (["mechanism.axial=false"], "inextensible"),
    ],
)
def test_shapes_are_searched_with_stretch_and_shear_unless_the_specification_says_otherwise(said, model):
    spec = with_stretch_and_shear(cfmkit.load("configs/beam_design_arch.yaml", said))
    assert spec.fidelity == model
    task = task_of(spec, spec.design.optimise)
    assert task.fidelity == model
    assert task.first.fidelity == "inextensible"
    assert (task.first is task) == (model == "inextensible")
