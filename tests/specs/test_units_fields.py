"""The annotated types of specifications: text with a unit in, SI inside, text with a unit out."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Annotated, Any

import numpy as np
import pytest
from pydantic import BaseModel, Field, ValidationError, create_model

from cfmkit.errors import QuantityError
from cfmkit.specs import units
from cfmkit.specs.units import DIMENSIONS_BY_NAME, BareFloat, Displacement, Length, MetricValue, Place, Ratio
from cfmkit.specs.units.fields import BareInt


class Part(BaseModel):
    width: Length = Field(0.01, gt=0, le=0.5)
    depth: Annotated[Length, Field(gt=0)] = 0.1
    slip: Ratio = 0.02
    at: Displacement | None = None
    limit: MetricValue | None = None


def test_text_and_si_numbers_are_the_same_length() -> None:
    assert Part(width="12 mm").width == Part(width=0.012).width == Part(width=np.float64(0.012)).width == 0.012
    assert type(Part(width=np.float64(0.012)).width) is float


@pytest.mark.parametrize("value", [BareInt(5), BareFloat(0.5)])
def test_a_number_from_a_file_needs_its_unit(value: Any) -> None:
    with pytest.raises(ValidationError, match=f"{value} has no unit; write '{value} mm'"):
        Part(width=value)


def test_zero_and_ratios_from_a_file_stand_bare() -> None:
    class Free(BaseModel):
        gap: Length
        slip: Ratio

    assert Free(gap=BareInt(0), slip=BareFloat(0.5)).model_dump() == {"gap": 0.0, "slip": 0.5}


@pytest.mark.parametrize("value", [True, None, [1.0], {"a": 1}, math.nan, math.inf, 10**400, 1j, "abc", b"1 mm"])
def test_what_is_no_length_is_no_length(value: Any) -> None:
    with pytest.raises(ValidationError):
        Part(width=value)


def test_bounds_are_told_with_units() -> None:
    with pytest.raises(ValidationError, match=r"-5 mm is not allowed: must be > 0 and <= 500 mm"):
        Part(width="-5 mm")
    with pytest.raises(ValidationError, match=r"600 mm is not allowed: must be > 0 and <= 500 mm"):
        Part(width=0.6)
    with pytest.raises(ValidationError):
        Part(depth="-5 mm")


def test_dumps_are_si_in_python_and_text_in_json() -> None:
    part = Part(width="12 mm", at="90 deg", limit="5 %")
    assert part.model_dump() == {"width": 0.012, "depth": 0.1, "slip": 0.02, "at": math.pi / 2, "limit": "5 %"}
    reported = {"width": "12 mm", "depth": "100 mm", "slip": 0.02, "at": "90 deg", "limit": "5 %"}
    assert part.model_dump(mode="json") == reported
    assert Part.model_validate(reported) == part


def test_a_place_keeps_its_dimension_through_copies_pickles_and_dumps() -> None:
    place = Part(at="90 deg").at
    assert isinstance(place, Place)
    for same in (copy.copy(place), copy.deepcopy(place), pickle.loads(pickle.dumps(place)), Part(at=place).at):
        assert same == place
        assert same.dimension == "angle"
    again = Part.model_validate(Part(at="90 deg").model_dump())
    assert again.at.dimension == "angle"
    assert Part(at=0.002).at.dimension == "length"


def test_a_place_from_a_file_needs_its_unit() -> None:
    with pytest.raises(ValidationError, match="2 has no unit; write '2 mm' or '2 deg'"):
        Part(at=BareInt(2))
    with pytest.raises(ValidationError, match="'2 N' is a force; a length or an angle is needed"):
        Part(at="2 N")


@pytest.mark.parametrize(
    ("given_", "kept"), [("5 %", "5 %"), (" 140  mm", "140 mm"), (0.05, "0.05"), (5, "5"), ("0.050", "0.05")]
)
def test_a_metric_value_is_kept_as_text_with_a_known_unit(given_: Any, kept: str) -> None:
    assert Part(limit=given_).limit == kept


@pytest.mark.parametrize("value", ["5 procent", "many", True, [1]])
def test_a_metric_value_is_a_number_with_a_known_unit(value: Any) -> None:
    with pytest.raises(ValidationError):
        Part(limit=value)


@pytest.mark.parametrize("name", [name for name in DIMENSIONS_BY_NAME if name not in ("count", "text")])
def test_a_key_may_be_of_every_dimension_with_a_unit(name):
    item = DIMENSIONS_BY_NAME[name]
    free = create_model("Free", value=(Annotated[float, units.quantity(name)], ...))
    assert free(value=item.example).value == pytest.approx(units.read_quantity(item.example, name))


@pytest.mark.parametrize("text", ["1e31 m", "1e-28 mm", "-1e34 mm"])
def test_sizes_whose_products_would_be_no_numbers_are_refused(text):
    with pytest.raises(QuantityError, match=r"is outside the range of the computation: 1e-30 to 1e\+30 in SI units"):
        units.quantity("length").read(text)
    assert units.quantity("length").read("1e29 m")[0] == 1e29
    assert units.quantity("length").read("0 mm")[0] == 0.0
