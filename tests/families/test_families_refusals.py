"""What all families share: the words of their findings, and what is made of a mechanism that cannot be."""

from __future__ import annotations

import pickle

import pytest

from cfmkit.families.findings import (
    CannotBuild,
    Finder,
    Infeasible,
    deg,
    format_at_least,
    format_at_most,
    mm,
    mpa,
    newton,
    no_design,
    no_result,
    percent,
    rate,
    refusals_answered,
)
from cfmkit.results import Finding, Status
from cfmkit.specs import Spec

SHORT = Finding("brace_too_short", "the braces do not reach the rollers", ("mechanism.brace_length=200 mm",))


def test_a_family_finds_only_what_it_explains():
    finding = Finder({"brace_too_short": "the brace is shorter than half the way between the rollers"})
    assert finding(SHORT.name, SHORT.message, *SHORT.cures) == SHORT
    with pytest.raises(KeyError, match="undercut"):
        finding("undercut", "")


def test_numbers_are_told_in_the_units_of_the_user():
    reported = (
        mm(0.0123456),
        deg(0.5235987755982988),
        newton(12.34567),
        mpa(1.234567e7),
        rate(1234.567),
        percent(0.012345),
    )
    assert reported == ("12.35 mm", "30 deg", "12.35 N", "12.35 MPa", "1.235 N/mm", "1.23 %")


def test_a_proposed_length_stays_on_its_side_of_the_exact_one():
    for length in (1e-7, 0.0144645, 0.1693794, 0.25, 3.0):
        low, high = (
            float(text.removesuffix(" mm")) / 1e3 for text in (format_at_most(length), format_at_least(length))
        )
        assert low <= length * (1 + 1e-15)
        assert high >= length * (1 - 1e-15)
        assert high - low <= 1.0001e-3 * length
    assert format_at_least(0.0) == format_at_most(0.0) == "0 mm"


def test_the_reason_why_nothing_can_be_built_survives_the_way_back_from_another_process():
    error = pickle.loads(pickle.dumps(CannotBuild(SHORT)))
    assert (error.finding, str(error)) == (SHORT, SHORT.message)


def test_a_mechanism_that_cannot_exist_is_a_result_with_the_reason():
    spec = Spec.model_construct()
    result = no_result(spec, SHORT)
    assert (result.status, result.message, result.warnings) == (Status.NO_EQUILIBRIUM, SHORT.message, (SHORT,))
    assert result.spec is spec
    assert result.curves == ()


def test_targets_that_cannot_be_met_are_a_design_without_a_specification():
    nearest = {"mechanism.brace_length": "more than 160 mm"}
    design = no_design(SHORT, nearest)
    assert design.spec is None
    assert (design.status, design.message, design.warnings) == (Status.INFEASIBLE, SHORT.message, (SHORT,))
    assert design.nearest_feasible == nearest
    assert no_design(SHORT).nearest_feasible == {}


@pytest.mark.parametrize(
    ("problem", "nearest"),
    [(CannotBuild(SHORT), {}), (Infeasible(SHORT, {"design.force": "40 N"}), {"design.force": "40 N"})],
)
def test_what_a_design_raises_is_its_answer(problem, nearest):
    @refusals_answered
    def design():
        raise problem

    found = design()
    assert found.status is Status.INFEASIBLE
    assert (found.message, found.nearest_feasible) == (SHORT.message, nearest)
