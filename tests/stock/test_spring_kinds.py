"""Kinds of helical springs are classes: nothing compares their names, and what is new in one follows from its class."""

from __future__ import annotations

import ast

import pytest
from pydantic import ValidationError
from sources import PACKAGE as ROOT
from sources import nodes

from cfmkit.stock.springs.helical_spring_formulas import HelicalSpring
from cfmkit.stock.springs.kinds import AXIAL_KINDS, HELICAL_KINDS, TURNED_KINDS
from cfmkit.stock.springs.offers import generic_series, slimmest_spring
from cfmkit.stock.springs.spec import CatalogueSpring


@pytest.mark.lists
def test_nothing_compares_the_name_of_a_kind():
    compared = {}
    for path in (*(ROOT / "stock").rglob("*.py"), *(ROOT / "families").rglob("*.py")):
        for node in nodes(path):
            sides = [node.left, *node.comparators] if isinstance(node, ast.Compare) else []
            words = {part.value for side in sides for part in ast.walk(side) if isinstance(part, ast.Constant)}
            if words & {*HELICAL_KINDS}:
                compared[f"{path.name}:{node.lineno}"] = ast.unparse(node)
    assert compared == {}


def test_each_kind_is_deflected_along_its_axis_or_turned():
    assert {*AXIAL_KINDS, *TURNED_KINDS} == {*HELICAL_KINDS}
    assert not {*AXIAL_KINDS} & {*TURNED_KINDS}


@pytest.mark.parametrize("spring_type", HELICAL_KINDS.values())
def test_a_catalogue_refuses_what_a_kind_has_not(spring_type):
    base = {"name": "x", "kind": spring_type.kind, spring_type.rate_key: 100.0}
    assert CatalogueSpring.model_validate(base).offer.spring_type is spring_type
    allowed = {"initial_tension": spring_type.has_initial_tension, "guide_rod": spring_type.needs_guide}
    for key, is_allowed in allowed.items():
        if is_allowed:
            assert getattr(CatalogueSpring.model_validate(base | {key: 1e-3}).offer, key) == 1e-3
        else:
            with pytest.raises(ValidationError, match=f"'{key}' is .* this is of kind '{spring_type.kind}'"):
                CatalogueSpring.model_validate(base | {key: 1e-3})


class ConicalSpring(HelicalSpring):
    """A kind of a test: half as stiff as a cylinder of its larger diameter, and flat when it is closed."""

    kind = "conical"
    lengthening = -1.0

    @property
    def rate(self) -> float:
        return 2.0 * super().rate

    @property
    def body_length(self) -> float:
        return self.wire


def test_a_new_kind_has_a_series_and_springs_made_to_measure():
    offer = generic_series(ConicalSpring)[0]
    assert offer.name == "generic-conical-d0.4-D2.4-n6"
    assert (offer.free_length, offer.rate) == (offer.wound.wire, offer.wound.rate)
    made = slimmest_spring(ConicalSpring, 500.0, 0.01, 2e-3)
    assert made.rate == pytest.approx(500.0, rel=0.01)
    assert made.wire <= 2e-3
