"""Reading specifications: what is refused, where the fault is said to be, and in which words."""

import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import pytest
from pydantic import Field, model_validator

from cfmkit.errors import SpecError, UsageError
from cfmkit.specs.keys_and_schema import json_schema
from cfmkit.specs.spec import Analysis, Model, Spec
from cfmkit.specs.units import Angle, Force, Length, Mass, Ratio, RotationalStiffness, Stiffness
from cfmkit.specs.yamlio import read_document

CORPUS = Path(__file__).parent / "bad_specs"


class Spring(Model):
    kind: Literal["spring"]
    stiffness: Stiffness = Field(gt=0)


class Weight(Model):
    kind: Literal["weight"]
    mass: Mass = Field(gt=0)


class Link(Model):
    length: Annotated[Length, Field(gt=0, le=2.0)]
    angle: Angle = 0.0


class Mechanism(Model):
    width: Length = Field(gt=0, le=1.0)
    load: Annotated[Spring | Weight, Field(discriminator="kind")]
    links: tuple[Link, ...] = Field(min_length=1)
    stiffness: Stiffness | tuple[Stiffness, ...] = 500.0
    thickness: Length | Literal["auto"] = "auto"
    pivot_stiffness: RotationalStiffness | None = Field(None, ge=0)
    friction: Ratio = Field(0.0, ge=0, lt=1)
    count: int = Field(2, ge=1, le=6)
    method: Literal["quadrature", "ode"] = "quadrature"
    mirrored: bool = False
    extra_forces: dict[str, Force] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _narrow_enough(self) -> Self:
        if self.width > 0.5 and self.count > 4:
            raise ValueError("a mechanism wider than 500 mm has at most 4 of them")
        return self


class PressSpec(Spec):
    family: Literal["press"]
    mechanism: Mechanism
    analysis: Analysis = Field(default_factory=Analysis)


GOOD = (CORPUS / "good.yaml").read_text()


def bound(text: str | bytes, *options: str) -> PressSpec:
    document = read_document(text, "press.yaml")
    for option in options:
        document = document.set(option)
    return document.bind(PressSpec)


def complaint(text: str | bytes, *options: str) -> str:
    with pytest.raises(SpecError) as caught:
        bound(text, *options)
    return str(caught.value)


def expected_messages() -> dict[str, list[str]]:
    """Return the lines that each bad file must give."""
    lines = (CORPUS / "expected.txt").read_text().splitlines()
    messages: dict[str, list[str]] = {}
    for line in lines:
        messages.setdefault(line.split(":")[0], []).append(line)
    return messages


EXPECTED = expected_messages()
BAD_FILES = sorted(path.name for path in CORPUS.glob("*.yaml") if path.name != "good.yaml")


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_bad_file_gives_exactly_these_lines(name: str) -> None:
    document = read_document((CORPUS / name).read_bytes(), name)
    with pytest.raises(SpecError) as caught:
        document.bind(PressSpec)
    assert str(caught.value).splitlines() == EXPECTED[name]


def test_every_expected_message_has_its_file() -> None:
    assert sorted(EXPECTED) == BAD_FILES
    assert len(BAD_FILES) >= 80


def test_messages_hold_no_jargon() -> None:
    reported = "\n".join(line for lines in EXPECTED.values() for line in lines)
    jargon = (
        "pydantic",
        "http",
        "Input should",
        "Value error",
        "dict",
        "tuple",
        "NoneType",
        "scalar",
        "token",
        "BaseModel",
    )
    assert not [word for word in jargon if word in reported]


def test_the_good_file_is_read() -> None:
    spec = bound(GOOD)
    assert spec.mechanism.width == 0.2
    assert spec.mechanism.load == Spring(kind="spring", stiffness=690.0)
    assert [link.length for link in spec.mechanism.links] == [0.08, 1.2]
    assert spec.mechanism.friction == 0.02
    assert spec.requirements[0].max == "5 %"


@pytest.mark.parametrize("ending", ["\r\n", "\r"])
def test_line_endings_and_a_byte_order_mark_make_no_difference(ending: str) -> None:
    data = b"\xef\xbb\xbf" + GOOD.replace("\n", ending).encode()
    assert bound(data) == bound(GOOD)
    broken = data.replace(b"width: 200 mm", b"width: 200")
    assert complaint(broken) == "press.yaml:6:10: mechanism.width: 200 has no unit; write '200 mm'"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),
        ("1.5E3", 1500.0),
        (".5", 0.5),
        ("-7", -7),
        ("+7", 7),
        ("0", 0),
        ("true", True),
        ("False", False),
        ("null", None),
        ("~", None),
        ("", None),
        ("yes", "yes"),
        ("NO", "NO"),
        ("2022-05-10", "2022-05-10"),
        ("1.2.3", "1.2.3"),
        ("5 %", "5 %"),
        ("'010'", "010"),
        ('"1:30"', "1:30"),
        ('"a\\nb\\u00e9"', "a\nbé"),
        ("[1, 2.0, [x]]", (1, 2.0, ("x",))),
        ("{a: 1, 'b': 2}", {"a": 1, "b": 2}),
        ("|\n  two\n  lines\n", "two\nlines\n"),
    ],
)
def test_scalars_mean_what_yaml_1_2_says(text: str, value: Any) -> None:
    document = read_document(f"a: {text}", "x")
    assert document.problems == ()
    assert document.tree == {"a": value}
    assert type(document.tree["a"]) is type(value)


def test_every_key_and_value_has_its_place() -> None:
    document = read_document(GOOD, "press.yaml")
    assert document.place("mechanism.width") == (6, 10)
    assert document.place("mechanism.links.0.angle") == (9, 30)
    assert document.place(("mechanism", "links", 1, "length")) == (10, 15)
    assert document.place("mechanism.nothing.here") == (6, 3)
    assert document.place("") == (2, 1)


def test_a_problem_can_be_put_at_any_path() -> None:
    document = read_document(GOOD, "press.yaml").set("analysis.points=55")
    assert str(document.problem("mechanism.count", "is odd")) == "press.yaml:12:10: mechanism.count: is odd"
    assert str(document.problem("analysis.points", "is odd")) == "--set analysis.points: is odd"


def test_the_two_parsers_see_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    from cfmkit.specs.yamlio import tree_builder

    fast = tree_builder.read_text(GOOD)
    monkeypatch.setattr(tree_builder, "_YAML_LOADERS", tree_builder._YAML_LOADERS[-1:])
    assert tree_builder.read_text(GOOD) == fast


# Families


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("cfmkit: 1\nfamily: cm\n", "x:2:9: family: 'cm' is not one of cam, beam; did you mean 'cam'?"),
        ("cfmkit: 1\n", "x:1:1: the key 'family' is missing: one of cam, beam"),
        ("family: [cam]\n", "x:1:9: family: a list is not one of cam, beam"),
        ("family: cam: 1\n", "x:1:12: a second ': ' on one line, or a line indented under a value; "
         "quote text that holds ': ', or put the key on a separate line"),
    ],
)  # fmt: skip
def test_the_family_is_one_of_the_known(text: str, words: str) -> None:
    with pytest.raises(SpecError) as caught:
        read_document(text, "x").family(["cam", "beam"])
    assert str(caught.value) == words


def test_the_family_is_found() -> None:
    assert read_document("family: cam", "x").family(["cam", "beam"]) == "cam"


# Options


def test_options_change_values_and_make_blocks() -> None:
    spec = bound(GOOD, "mechanism.width=0.3 m", "mechanism.links.1.length = 70 mm", "analysis.window=[1 mm, 2 mm]")
    assert (spec.mechanism.width, spec.mechanism.links[1].length, spec.analysis.window) == (0.3, 0.07, (0.001, 0.002))
    assert bound(GOOD, "mechanism.load={kind: weight, mass: 3 kg}").mechanism.load == Weight(kind="weight", mass=3.0)
    assert bound(
        "cfmkit: 1\nfamily: press\n" + GOOD[GOOD.index("mechanism") : GOOD.index("analysis")], "analysis.points=7"
    )


def test_an_option_leaves_the_document_it_was_set_on_alone() -> None:
    document = read_document(GOOD, "x")
    document.set("mechanism.width=1 mm")
    assert document.tree["mechanism"]["width"] == "200 mm"


def test_the_last_of_two_options_counts() -> None:
    assert bound(GOOD, "mechanism.count=3", "mechanism.count=4").mechanism.count == 4
    assert complaint(GOOD, "mechanism.width=5 N", "mechanism.width=6 N").startswith("--set mechanism.width: '6 N'")


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("mechanism.width=5", "--set mechanism.width: 5 has no unit; write '5 mm'"),
        ("mechanism.width=5 N", "--set mechanism.width: '5 N' is a force; a length is needed, e.g. '5 mm'"),
        ("mechanism.width=1,5 mm", "--set mechanism.width: '1,5' has a decimal comma; write 1.5"),
        ("mechanism.widht=5 mm", "--set mechanism.widht: unknown key 'widht'; did you mean 'width'?"),
        ("mechanism.links.2=x", "--set mechanism.links.2: '2' is not an index of this list; there are 0 to 1"),
        ("mechanism.links.x=5 mm", "--set mechanism.links.x: 'x' is not an index of this list; there are 0 to 1"),
        ("name.x=5", "--set name.x: 'x' is below a value; only blocks and lists have something below them"),
        ("mechanism.width=[1 mm", "--set mechanism.width: a '[' is never closed"),
        ("mechanism.width=!!float 5", "--set mechanism.width: the tag '!!float' is not read; write the plain value"),
        ("name=5\u00a0mm", "--set name: here is a no-break space (U+00A0); use an ordinary space"),
        ("name=a: b", "--set name: 'a: b' would be a block; write {key: value}, or quote text"),
        ("name=- b", "--set name: '- b' would be a list; write [a, b]"),
        ("mechanism.load={kind: weight}", "--set mechanism.load: the key 'mass' is missing: a mass, e.g. '0.25 kg'"),
        ("mechanism.load={kind: weight, mass: 1 N}", "--set mechanism.load: mechanism.load.mass: '1 N' is a force; "
         "a mass is needed, e.g. '1 kg'"),
        ("width=5 mm", "--set width: unknown key 'width'; did you mean 'mechanism.width'?"),
        ("new.block.key=1", "--set new.block.key: new: unknown key 'new'; allowed are cfmkit, family, name, "
         "description, requirements, sweep, sensitivity, mechanism, analysis"),
    ],
)  # fmt: skip
def test_a_wrong_option_is_told_as_the_option(option: str, words: str) -> None:
    assert complaint(GOOD, option) == words


@pytest.mark.parametrize(
    "option",
    [
        "",
        "=",
        "a",
        "a=",
        "=1",
        "a..b=1",
        ".a=1",
        "a b",
        ".=1",
        "a.b.=2",
        "a." * 40 + "a=1",
        "a.'b=1",
        '""=1',
        "a.'b'c=1",
    ],
)
def test_a_malformed_option_is_a_usage_error(option: str) -> None:
    with pytest.raises(UsageError, match=r"^--set .*; write e\.g\. --set mechanism\.springs\.count=2$"):
        read_document(GOOD, "x").set(option)


def test_a_list_whose_items_are_wrong_is_not_too_short_as_well() -> None:
    assert complaint(GOOD, "mechanism.links=[5]").splitlines() == [
        "--set mechanism.links: mechanism.links.0: 5 does not fit here; a block with length is needed"
    ]
    assert (
        complaint(GOOD, "mechanism.links=[]") == "--set mechanism.links: the list has 0 items; at least 1 must be there"
    )


PARAMETERS = GOOD + "sensitivity: {parameters: {mechanism.width: [1 mm, 2 mm], mechanism.count: [1, 2]}}\n"


@pytest.mark.parametrize("quote", ["'", '"'])
def test_a_key_with_dots_is_reached_in_quotes(quote: str) -> None:
    width = f"{quote}mechanism.width{quote}"
    given = bound(
        PARAMETERS, f"sensitivity.parameters.{width}=[3 mm, 4 mm]", f"sensitivity . parameters.{width}.0=2 mm"
    )
    assert given.sensitivity is not None
    assert given.sensitivity.parameters == {"mechanism.width": ("2 mm", "4 mm"), "mechanism.count": ("1", "2")}
    option = f"sensitivity.parameters.{quote}a=b.c{quote}=0"
    assert complaint(PARAMETERS, option).startswith("--set sensitivity.parameters.'a=b.c'")


def test_file_and_option_problems_come_together_the_file_first() -> None:
    lines = complaint(GOOD.replace("count: 2", "count: two"), "mechanism.width=5", "analysis.points=010").splitlines()
    assert [line.split(": ")[0] for line in lines] == [
        "press.yaml:12:10",
        "--set analysis.points",
        "--set mechanism.width",
    ]


# From Python


def test_a_wrong_replacement_is_told_with_its_path_and_units() -> None:
    spec = bound(GOOD)
    with pytest.raises(SpecError) as caught:
        spec.replace({"mechanism.width": -0.2, "mechanism.links.0.length": -0.1, "mechanism.count": 9})
    assert str(caught.value).splitlines() == [
        "mechanism.width: -200 mm is not allowed: must be > 0 and <= 1000 mm",
        "mechanism.links.0.length: -100 mm is not allowed: must be > 0 and <= 2000 mm",
        "mechanism.count: 9 is not allowed: must be >= 1 and <= 6",
    ]


def test_the_json_schema_speaks_in_units() -> None:
    definitions = json_schema(PressSpec)["$defs"]
    width = definitions["Mechanism"]["properties"]["width"]
    assert width["type"] == "string"
    assert width["x-dimension"] == "length"
    assert width["x-allowed"] == "> 0 and <= 1000 mm"
    assert definitions["Link"]["properties"]["length"]["x-allowed"] == "> 0 and <= 2000 mm"
    assert definitions["Link"]["properties"]["angle"]["default"] == "0 deg"
    assert definitions["Mechanism"]["properties"]["stiffness"]["default"] == "0.5 N/mm"
    assert definitions["Mechanism"]["properties"]["friction"]["type"] == ["number", "string"]


@pytest.mark.parametrize("heavy", ["pint", "numpy", "scipy", "matplotlib"])
def test_reading_common_units_needs_no(heavy: str) -> None:
    code = (
        "import sys; from cfmkit.specs.spec import Spec; from cfmkit.specs.yamlio import read_document;"
        "text = 'cfmkit: 1\\nfamily: x\\nrequirements: [{metric: a, max: 5 %, over: [1 mm, 2 mm]},"
        " {metric: b, max: 2 deg}]';"
        "read_document(text, 'x').bind(Spec);"
        f"assert {heavy!r} not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("flow", "column", "path", "reported"),
    [
        ("{pivot: 28,303 N*mm, b: 1 mm}", 14, ".pivot", "'28,303 N*mm' has a decimal comma; write 28.303 N*mm"),
        ("{pivot: -0,69 N/mm}", 14, ".pivot", "'-0,69 N/mm' has a decimal comma; write -0.69 N/mm"),
        ("{pivot: 0, 5 %, b: 2}", 14, ".pivot", "'0,5 %' has a decimal comma; write 0.5 %"),
        ("{pivot: 1,234,567 N}", 14, ".pivot", "'1,234' has a decimal comma; write 1.234"),
        ("[2,5 mm, 4 mm]", 7, ".0", "'2,5 mm' has a decimal comma; write 2.5 mm"),
        ("[2 mm, 4,5 mm]", 13, ".1", "'4,5 mm' has a decimal comma; write 4.5 mm"),
        ("[-1,25 %,3 %]", 7, ".0", "'-1,25 %' has a decimal comma; write -1.25 %"),
        ("[0,5 mm, 4 mm]", 7, "", "'0,5 mm' has a decimal comma; write 0.5 mm"),
    ],
)  # fmt: skip
def test_a_decimal_comma_in_a_flow_block_or_list_is_called_one_at_its_place(flow, column, path, reported):
    found = read_document(f"cfmkit: 1\nkey: {flow}\n", "a.yaml").problems
    assert [(problem.line, problem.column, problem.path, problem.message) for problem in found] == [
        (2, column, f"key{path}", reported)
    ]


@pytest.mark.parametrize(
    "flow", ["[1,2,4]", "[0,240 mm]", "[0, 5 mm, 6 mm]", "[0,0.5 mm, 2 mm]", "[2 mm,4 mm]", "['2',5 mm]", "[1,2e3, 4]"]
)
def test_commas_between_the_values_of_a_list_are_no_decimal_commas(flow):
    assert not read_document(f"cfmkit: 1\nwindow: {flow}\n", "a.yaml").problems


@pytest.mark.parametrize(
    "text", ["a: 5\n1: 6\n", "a: {b: 5, c: 1}\n", "a: {b: '5', 1 mm: 2}\n", "a: {b: x, 1 mm: 2}\n"]
)
def test_digits_where_a_key_should_be_are_no_decimal_comma_elsewhere(text):
    assert not [one for one in read_document(text, "a.yaml").problems if "decimal comma" in one.message]
