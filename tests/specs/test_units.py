"""Numbers and quantities at the border: what is read, what is refused, and that nothing is lost on the way."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cfmkit.errors import InputError, QuantityError
from cfmkit.specs.units import (
    DIMENSIONS_BY_NAME,
    border_unit,
    format_quantity,
    from_border,
    read_number,
    read_quantity,
    to_border,
    unit_table,
)
from cfmkit.specs.units.quantities import decimal_text
from cfmkit.specs.units.table import COMMON_UNIT_SIZES, border_size, unit_size

READABLE = [name for name in DIMENSIONS_BY_NAME if name != "text"]
JSON_NUMBER = re.compile(r"[-+]?(0|[1-9][0-9]*|(?=\.[0-9]))(\.[0-9]*)?([eE][-+]?[0-9]+)?")


def refusal(text: str, dimension: str = "length") -> str:
    with pytest.raises(QuantityError) as caught:
        read_quantity(text, dimension)
    return str(caught.value)


# Numbers


@settings(max_examples=500, deadline=None)
@given(st.text(alphabet="0123456789.,+-eE_x: n\t−٣", max_size=12) | st.from_regex(JSON_NUMBER, fullmatch=True))
def test_a_number_is_read_exactly_when_it_is_a_plain_finite_decimal(text: str) -> None:
    allowed = JSON_NUMBER.fullmatch(text) is not None and len(text) <= 40
    lost = allowed and (math.isinf(float(text)) or (float(text) == 0 and re.search("[1-9]", re.split("[eE]", text)[0])))
    if allowed and not lost:
        assert read_number(text) == float(text)
    else:
        with pytest.raises(QuantityError):
            read_number(text)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1,5", "'1,5' has a decimal comma; write 1.5"),
        ("1,500", "'1,500' has a comma; write decimals with a dot, thousands plainly"),
        ("−5", "'−5' has a unicode minus (U+2212); write -5"),
        ("1e−5", "'1e−5' has a unicode minus or dash; write the ASCII '-'"),
        ("010", "'010' has a leading zero; write 10"),
        ("-007.5", "'-007.5' has a leading zero; write -7.5"),
        ("1:30", "'1:30' has a colon (old YAML reads it in base 60); write one decimal number"),
        ("0x10", "'0x10' is hexadecimal; write it in decimal"),
        ("0o17", "'0o17' is octal; write it in decimal"),
        ("0b11", "'0b11' is binary; write it in decimal"),
        ("1_000", "'1_000' has an underscore; write 1000"),
        ("nan", "'nan' is not a finite number"),
        ("-.INF", "'-.INF' is not a finite number"),
        ("9**9**9", "'9**9**9' is arithmetic; write its value"),
        ("1 000", "'1 000' has a space in it; write 1000"),
        ("1\u00a0000", "'1\\xa0000' holds a no-break space (U+00A0); use an ordinary space"),
        ("1\t", "'1\\x09' holds a tab; use spaces"),
        ("٣", "'٣' has digits that are not 0-9; write ASCII digits"),
        ("1.2.3", "'1.2.3' has more than one dot; write e.g. 1234.5"),
        ("1e999", "'1e999' is too large: at most 1.8e308"),
        ("-1e999", "'-1e999' is too large: at most 1.8e308"),
        ("1e-999", "'1e-999' is too small to differ from zero; write 0 if zero is meant"),
        ("", "there is no number"),
        ("five", "'five' is not a number; write e.g. 12, -0.5 or 1e-3"),
        (" 1", "' 1' is not a number; write e.g. 12, -0.5 or 1e-3"),
        ("1" * 41, f"'{'1' * 41}' is too long for a number: at most 40 characters"),
    ],
)
def test_what_is_no_number_is_refused_with_the_reason(text: str, reason: str) -> None:
    with pytest.raises(QuantityError) as caught:
        read_number(text)
    assert str(caught.value) == reason


def test_a_zero_with_a_huge_exponent_is_zero() -> None:
    assert read_number("0e999999999") == 0
    assert read_quantity("0e999999999 mm", "length") == 0


def test_a_quantity_error_is_invalid_input_and_a_value_error() -> None:
    assert issubclass(QuantityError, InputError)
    assert issubclass(QuantityError, ValueError)


# Quantities


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("200 mm", "length", 0.2),
        ("1mm", "length", 0.001),
        ("  .5 cm ", "length", 0.005),
        ("1 in", "length", 0.0254),
        ("1 inch", "length", 0.0254),
        ("1 ft", "length", 0.3048),
        ("180 deg", "angle", math.pi),
        ("1 rev", "angle", 2 * math.pi),
        ("5 %", "ratio", 0.05),
        ("5 percent", "ratio", 0.05),
        ("0.05", "ratio", 0.05),
        ("3 mm/m", "ratio", 0.003),
        ("1 lbf", "force", 4.4482216152605),
        ("1 lb", "mass", 0.45359237),
        ("1 psi", "stress", 4.4482216152605 / 0.0254**2),
        ("2 N/mm^2", "stress", 2e6),
        ("2 N/mm**2", "stress", 2e6),
        ("2 N * mm ^ -2", "stress", 2e6),
        ("0.69 N/mm", "stiffness", 690.0),
        ("1 N*mm/deg", "rotational_stiffness", 0.18 / math.pi),
        ("2 J", "energy", 2.0),
        ("4 1/mm", "curvature", 4000.0),
        ("60 rpm", "angular_velocity", 2 * math.pi),
        ("0", "force", 0.0),
        ("-0", "force", 0.0),
        ("1e-3 m", "length", 0.001),
    ],
)
def test_quantities_become_si(text: str, dimension: str, value: float) -> None:
    assert read_quantity(text, dimension) == pytest.approx(value, rel=1e-15)


@settings(max_examples=300, deadline=None)
@given(st.decimals(min_value="-1e9", max_value="1e9", allow_nan=False, places=6))
def test_the_same_length_in_any_unit_is_the_same_float(number: Any) -> None:
    texts = [f"{number:f} mm", f"{number / 10:f} cm", f"{number / 1000:f} m", f"{number * 1000:f} um"]
    texts = [text for text in texts if len(text.split()[0]) <= 40]
    assert {read_quantity(text, "length") for text in texts} == {float(Fraction(number) / 1000)}


def test_68_mm_has_one_value_in_every_spelling() -> None:
    assert (
        read_quantity("68 mm", "length")
        == read_quantity("0.068 m", "length")
        == read_quantity("6.8 cm", "length")
        == 0.068
    )


@pytest.mark.parametrize(
    ("text", "dimension", "words"),
    [
        ("5 N", "length", "'5 N' is a force; a length is needed, e.g. '5 mm'"),
        (
            "500 N*mm",
            "rotational_stiffness",
            "'500 N*mm' is a torque; a rotational stiffness is needed, e.g. '500 N*mm/rad'",
        ),
        ("5 N*s", "length", "'5 N*s' is of another kind; a length is needed, e.g. '5 mm'"),
        ("5 mm", "ratio", "'5 mm' is a length; a ratio is needed, e.g. '5 %'"),
        ("200", "length", "200 has no unit; write '200 mm'"),
        ("5 MM", "length", "'MM' is not a unit; did you mean 'mm'?"),
        ("5 Mm", "length", "'Mm' is not a unit; did you mean 'mm'?"),
        ("5 newton", "force", "'newton' is not a unit; did you mean 'N'?"),
        ("5 newtons", "force", "'newtons' is not a unit; did you mean 'N'?"),
        ("5 Nmm", "torque", "'Nmm' is not a unit; did you mean 'N*mm'?"),
        ("5 Nmm/rad", "rotational_stiffness", "'Nmm/rad' is not a unit; did you mean 'N*mm/rad'?"),
        ("5 mm2", "area", "'mm2' is not a unit; did you mean 'mm^2'?"),
        ("5 mm²", "area", "'mm²' is not a unit; did you mean 'mm^2'?"),
        ("5 N·mm", "torque", "'N·mm' is not a unit; did you mean 'N*mm'?"),
        ("5 µm", "length", "'µm' is not a unit; did you mean 'um'?"),
        ("90°", "angle", "'°' is not a unit; did you mean 'deg'?"),
        ("5 mmm", "length", "'mmm' is not a unit; did you mean 'mm'?"),
        ("100 %%", "ratio", "'%%' is not a unit; did you mean '%'?"),
        ("5 NN", "force", "'NN' is not a unit; did you mean 'N'?"),
        ("5 milimeter", "length", "'milimeter' is not a unit; did you mean 'mm'?"),
        ("5 parsec", "length", "'parsec' is not a unit; `cfmkit show units` lists them"),
        ("5 N/m m", "stiffness", "'N/m m' has two units side by side; put * or / between them"),
        ("5 N/(mm*s)", "force", "'N/(mm*s)' has parentheses; write the unit without them, e.g. N/mm/s"),
        ("5 mm^99", "length", "'mm^99' is not a unit; `cfmkit show units` lists them"),
        ("1,5 mm", "length", "'1,5' has a decimal comma; write 1.5"),
        ("3 mm; 2", "length", "'mm; 2' is not a unit; `cfmkit show units` lists them"),
        ("9**9**9 mm", "length", "'9**9**9' is arithmetic; write its value"),
        ("mm", "length", "'mm' is not a length; write e.g. '200 mm'"),
        ("5*mm", "length", "'5*mm' is not a length; write e.g. '200 mm'"),
        ("", "angle", "the text is empty; an angle is needed, e.g. '30 deg'"),
        ("1e308 GPa", "stress", "'1e308 GPa' is too large"),
        ("1e-320 um", "length", "'1e-320 um' is too small to differ from zero; write 0 if zero is meant"),
    ],
)
def test_a_wrong_quantity_is_refused_with_what_to_write(text: str, dimension: str, words: str) -> None:
    assert refusal(text, dimension) == words


@settings(max_examples=300, deadline=None)
@given(
    st.text(max_size=30) | st.text(alphabet="0123456789.eE-+ Nm/*^%kgMPradse", max_size=20), st.sampled_from(READABLE)
)
def test_any_text_is_a_quantity_or_refused_in_one_line(text: str, dimension: str) -> None:
    try:
        reported = str(read_quantity(text, dimension))
    except QuantityError as error:
        reported = str(error)
    assert reported.isprintable()
    assert reported not in ("nan", "inf", "-inf")


@settings(max_examples=300, deadline=None)
@given(
    st.floats(min_value=-1e290, max_value=1e290, allow_subnormal=False).filter(
        lambda value: value == 0 or abs(value) > 1e-290
    ),
    st.sampled_from(READABLE),
)
def test_written_quantities_read_back_bit_by_bit(value: float, dimension: str) -> None:
    assert read_quantity(format_quantity(value, dimension), dimension) == value


@settings(max_examples=200, deadline=None)
@given(st.floats(min_value=1e-9, max_value=1e9), st.sampled_from(["m", "mm", "cm", "um", "in", "ft"]))
def test_written_lengths_are_as_short_as_can_be(value: float, unit: str) -> None:
    text = format_quantity(value, "length", unit)
    assert read_quantity(text, "length") == value
    digits = re.sub("e.*", "", text.split()[0]).replace(".", "").strip("0")
    size = unit_size(unit).factor
    for count in range(1, len(digits)):
        shorter = float(f"{float(Fraction(value) / size):.{count - 1}e}")
        assert float(Fraction(str(shorter)) * size) != value


@pytest.mark.parametrize(
    ("value", "dimension", "unit", "text"),
    [
        (0.068, "length", None, "68 mm"),
        (0.068, "length", "m", "0.068 m"),
        (0.05, "ratio", None, "0.05"),
        (0.05, "ratio", "%", "5 %"),
        (690.0, "stiffness", None, "0.69 N/mm"),
        (0.0, "force", None, "0 N"),
        (1e-12, "length", None, "1e-9 mm"),
        (0.5235987755982989, "angle", None, "30 deg"),
        (2.1e11, "stress", None, "210000 MPa"),
        (3.0, "count", None, "3"),
    ],
)
def test_quantities_are_written_as_people_write_them(value: float, dimension: str, unit: str | None, text: str) -> None:
    assert format_quantity(value, dimension, unit) == text


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_not_written(value: float) -> None:
    with pytest.raises(QuantityError):
        format_quantity(value, "length")


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_decimal_text_reads_back_and_is_never_longer_than_repr(value: float) -> None:
    assert float(decimal_text(value)) == value
    assert len(decimal_text(value)) <= max(len(repr(value)), 17)


# Tables


@pytest.mark.parametrize("name", READABLE)
def test_border_factors_agree_with_the_unit_registry(name: str) -> None:
    item = DIMENSIONS_BY_NAME[name]
    size = border_size(name).factor
    assert item.down / item.up == pytest.approx(float(size), rel=1e-15)
    assert size == COMMON_UNIT_SIZES[name, item.unit]


@pytest.mark.parametrize(("name", "unit"), [key for key in COMMON_UNIT_SIZES if key[1] not in ("1", "")])
def test_what_needs_no_look_into_the_registry_agrees_with_it(name: str, unit: str) -> None:
    assert COMMON_UNIT_SIZES[name, unit] == unit_size(unit).factor


@pytest.mark.parametrize("name", READABLE)
def test_the_example_of_a_dimension_is_of_that_dimension(name: str) -> None:
    assert read_quantity(DIMENSIONS_BY_NAME[name].example, name) > 0


@pytest.mark.parametrize("name", READABLE)
def test_border_values_come_back(name: str) -> None:
    values = np.array([0.0, 0.068, -3.7, 1e-6])
    np.testing.assert_allclose(from_border(to_border(values, name), name), values, rtol=1e-15)


def test_an_angle_is_a_dimension() -> None:
    assert dict(border_size("rotational_stiffness").powers)["rad"] == -1
    assert "rad" not in dict(border_size("torque").powers)


def test_unknown_dimensions_are_named() -> None:
    with pytest.raises(KeyError, match="there is no dimension 'lenght'; there are length, angle"):
        border_unit("lenght")


def test_the_unit_table_lists_every_unit_once_with_its_size() -> None:
    rows = {row[0]: row for row in unit_table()}
    assert len(rows) == len(unit_table())
    assert rows["in"] == ("in", "inch", "length", 0.0254, True)
    assert rows["MPa"] == ("MPa", "megapascal", "stress", 1e6, False)
    assert all(unit_size(symbol).powers == border_size(row[2]).powers for symbol, row in rows.items())


def test_no_two_units_differ_in_case_only_within_a_dimension() -> None:
    seen = [(row[2], row[0].lower()) for row in unit_table()]
    assert len(seen) == len(set(seen))


@pytest.mark.parametrize("heavy", ["pint", "numpy", "yaml"])
def test_common_units_are_read_and_written_without(heavy: str) -> None:
    code = (
        "import sys, cfmkit.specs.units as u; assert u.read_quantity('0.69 N/mm', 'stiffness') == 690;"
        "u.format_quantity(0.5, 'angle'); u.to_border(0.2, 'length');"
        f"assert {heavy!r} not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_temperatures_are_in_kelvin_and_degrees_of_others_are_refused_with_the_way_to_write_them() -> None:
    assert read_quantity("296.15 K", "temperature") == 296.15
    assert format_quantity(296.15, "temperature") == "296.15 K"
    for text in ("23 °C", "23 degC", "23 deg C", "23 C", "73.4 degF", "23 celsius"):
        with pytest.raises(QuantityError, match="temperatures are in K"):
            read_quantity(text, "temperature")
