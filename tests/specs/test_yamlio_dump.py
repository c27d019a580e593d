"""Writing specifications: what is written reads back equal, and looks as people would write it."""

from typing import Annotated, Literal

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field

from cfmkit.specs.spec import Model, Spec
from cfmkit.specs.units import Angle, Displacement, Force, Length, MetricValue, Place, Ratio
from cfmkit.specs.yamlio import dump, read_document


class Spring(Model):
    kind: Literal["spring"] = "spring"
    force: Force = 1.0


class Weight(Model):
    kind: Literal["weight"] = "weight"
    height: Length = 0.5


class Sheet(Spec):
    family: Literal["sheet"] = "sheet"
    width: Length
    angle: Angle = 0.0
    slip: Ratio = 0.25
    count: int = 2
    mirrored: bool = False
    label: str | None = "none given"
    window: tuple[Displacement, Displacement] | None = None
    widths: tuple[Length, ...] = ()
    grid: tuple[tuple[float, ...], ...] = ()
    load: Annotated[Spring | Weight, Field(discriminator="kind")] | None = None
    loads: tuple[Annotated[Spring | Weight, Field(discriminator="kind")], ...] = ()
    named: dict[str, Force] = Field(default_factory=dict)
    limit: MetricValue | None = None


def read_back(text: str) -> Sheet:
    return read_document(text, "dumped").bind(Sheet)


NUMBERS = st.floats(min_value=-1e12, max_value=1e12).filter(lambda value: value == 0 or abs(value) > 1e-12)
WORDS = st.sampled_from(
    ["true", "010", "1e-3", "1:30", "5 mm", "null", "~", "yes", "a: b", "- a", "#x", "", " ", "<<", "a'b", "..."]
)
TEXTS = st.text(st.characters(exclude_categories=["Cc", "Cs"]), max_size=20) | WORDS
ANGLES = NUMBERS.map(lambda value: value * 6e-8)  # at most 10 000 turns
PLACES = st.builds(Place, NUMBERS, st.just("length")) | st.builds(Place, ANGLES, st.just("angle"))
LOADS = st.builds(Spring, force=NUMBERS) | st.builds(Weight, height=NUMBERS) | st.just(Weight())
SHEETS = st.builds(
    Sheet,
    family=st.just("sheet"),
    name=TEXTS.filter(bool),
    description=TEXTS,
    width=NUMBERS,
    angle=ANGLES,
    slip=NUMBERS,
    count=st.integers(-(10**18), 10**18),
    mirrored=st.booleans(),
    label=st.none() | TEXTS,
    window=st.none() | st.tuples(PLACES, PLACES),
    widths=st.lists(NUMBERS, max_size=40).map(tuple),
    grid=st.lists(st.lists(NUMBERS, max_size=4).map(tuple), max_size=4).map(tuple),
    load=st.none() | LOADS,
    loads=st.lists(LOADS, max_size=3).map(tuple),
    named=st.dictionaries(TEXTS, NUMBERS, max_size=3),
    limit=st.sampled_from([None, "5 %", "0.05", "140 mm", "1e-9 m"]),
)


@settings(max_examples=200, deadline=None)
@given(SHEETS, st.booleans())
def test_what_is_written_reads_back_equal(sheet: Sheet, complete: bool) -> None:
    text = dump(sheet, complete=complete)
    again = read_back(text)
    assert again == sheet
    assert [place.dimension for place in again.window or ()] == [place.dimension for place in sheet.window or ()]
    assert dump(again, complete=complete) == text


@settings(max_examples=100, deadline=None)
@given(TEXTS)
def test_text_is_text_for_every_yaml_reader(text: str) -> None:
    assert yaml.safe_load(dump(Sheet(width=1.0, label=text))).get("label") == text


def test_only_what_was_set_is_written_unless_asked() -> None:
    sheet = Sheet(width=0.068, load=Weight(), window=(0.002, "90 deg"))
    assert dump(sheet) == ("cfmkit: 1\nfamily: sheet\nwidth: 68 mm\nwindow: [2 mm, 90 deg]\nload:\n  kind: weight\n")
    assert dump(sheet, complete=True) == (
        'cfmkit: 1\nfamily: sheet\nname: unnamed\ndescription: ""\nrequirements: []\nwidth: 68 mm\nangle: 0 deg\n'
        "slip: 0.25\ncount: 2\nmirrored: false\nlabel: none given\nwindow: [2 mm, 90 deg]\nwidths: []\n"
        "grid: []\nload:\n  kind: weight\n  height: 500 mm\nloads: []\nnamed: {}\n"
    )


def test_a_none_that_is_not_the_default_is_written() -> None:
    assert "label: null" in dump(Sheet(width=1.0, label=None))


@pytest.mark.parametrize(
    ("label", "written"),
    [
        ("bench press", "bench press"),
        ("sanchez-salinas-2022", "sanchez-salinas-2022"),
        ("5 mm", "5 mm"),
        ("1e-3", '"1e-3"'),
        ("010", '"010"'),
        ("1:30", '"1:30"'),
        ("yes", '"yes"'),
        ("a: b", '"a: b"'),
        ("two\nlines", r'"two\nlines"'),
        ("no\u00a0break", r'"no\u00a0break"'),
        ("größe", "größe"),
        ("2022-05-10", '"2022-05-10"'),
    ],
)
def test_text_is_quoted_where_a_reader_could_mistake_it(label: str, written: str) -> None:
    assert f"\nlabel: {written}\n" in dump(Sheet(width=1.0, label=label))


def test_long_lists_are_wrapped_and_short_ones_stay_on_their_line() -> None:
    text = dump(Sheet(width=1.0, widths=tuple(0.001 * step for step in range(100)), grid=((1.0, 2.5), (3.0, 4.0))))
    assert max(map(len, text.splitlines())) <= 100
    assert "grid: [[1, 2.5], [3, 4]]" in text


def test_requirements_stand_at_the_end_one_below_the_other() -> None:
    requirements = [
        {"metric": "force_ripple", "max": "5 %", "over": ("2 mm", "90 mm")},
        {"metric": "force_min", "min": "4 N"},
    ]
    text = dump(Sheet(width=1.0, requirements=tuple(requirements)))
    assert text.endswith(
        "width: 1000 mm\nrequirements:\n  - metric: force_ripple\n    max: 5 %\n    over: [2 mm, 90 mm]\n"
        "  - metric: force_min\n    min: 4 N\n"
    )
