"""Whatever the text, the reader ends soon, with a specification or with errors meant for the user."""

from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pace import within
from pydantic import Field

from cfmkit.errors import SpecError, UsageError
from cfmkit.specs.spec import Analysis, Model, Spec
from cfmkit.specs.units import Angle, Force, Length, Ratio, Stiffness
from cfmkit.specs.yamlio import dump, read_document, tree_builder

GOOD = (Path(__file__).parent / "bad_specs" / "good.yaml").read_text()
LINES = GOOD.splitlines(keepends=True)


class Load(Model):
    kind: Literal["spring"]
    stiffness: Stiffness = Field(gt=0)


class Link(Model):
    length: Annotated[Length, Field(gt=0)]
    angle: Angle = 0.0


class Mechanism(Model):
    width: Length = Field(gt=0, le=1.0)
    load: Load | Stiffness
    links: tuple[Link, ...]
    friction: Ratio = 0.0
    count: int = Field(2, ge=1)
    extra_forces: dict[str, Force] = Field(default_factory=dict)


class PressSpec(Spec):
    family: Literal["press"]
    mechanism: Mechanism
    analysis: Analysis = Field(default_factory=Analysis)


PIECES = st.sampled_from(
    [
        *(
            "\t",
            "\u00a0",
            "\0",
            ":",
            ": ",
            "- ",
            "[",
            "]",
            "{",
            "}",
            "#",
            "&a ",
            "*a",
            "!!str ",
            "!x ",
            "|",
            ">",
            "'",
            '"',
        ),
        *("\\", "<<: ", "---\n", "...\n", "%YAML 1.1\n", "? ", "@", "`", "nan", ".inf", "010", "1:30", "1e999", "0x1F"),
        *(
            "1_000",
            "1,5",
            "−",
            "\n",
            " ",
            "null",
            "~",
            "true",
            "yes",
            "9**9**9",
            "1e-999",
            "mm",
            " N",
            "width",
            "\ufeff",
        ),
        *("\r", "\u2028", "\x85", "😀", "[[[[", "a: "),
    ]
)


@st.composite
def mutated(draw: st.DrawFn) -> str:
    """Return the good file with a few pieces put in, cut out, doubled or exchanged."""
    text = GOOD
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(text)))
        stop = min(len(text), start + draw(st.sampled_from([0, 0, 1, 2, 5, 20, 80])))
        new = draw(PIECES | st.sampled_from(LINES) | st.text(max_size=5) | st.just(text[start:stop] * 2))
        text = text[:start] + new + text[stop:]
    return text


def read_good() -> None:
    """Read the good file; the slowest text of 1 MB takes as long as a thousand of it."""
    read_document(GOOD, "x.yaml").bind(PressSpec)


def outcome(data: str | bytes, *options: str) -> Any:
    """Return the specification, or the lines that the user gets to see."""
    with within(10_000, read_good):
        try:
            document = read_document(data, "x.yaml")
            for option in options:
                document = document.set(option)
            return document.bind(PressSpec)
        except (SpecError, UsageError) as error:
            result = str(error).splitlines()
    assert result
    return result


def acceptable(result: Any) -> bool:
    """Return whether this is a specification that can be written and read, or plain sentences."""
    if isinstance(result, PressSpec):
        return read_document(dump(result), "dumped").bind(PressSpec) == result
    return all(line.isprintable() and "pydantic" not in line and "Input should" not in line for line in result)


@settings(max_examples=400, deadline=None)
@given(mutated())
def test_mutations_of_a_good_file_are_read_or_refused(text: str) -> None:
    assert acceptable(outcome(text))


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=200) | st.text(max_size=200).map(lambda text: text.encode("utf-8", "surrogatepass")))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    assert acceptable(outcome(data))


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=40) | st.builds("{}={}".format, st.sampled_from(["mechanism.width", "name", "a.0.b"]), PIECES))
def test_any_option_is_read_or_refused(option: str) -> None:
    assert acceptable(outcome(GOOD, option))


@settings(max_examples=200, deadline=None)
@given(mutated())
def test_the_fast_parser_and_the_one_in_python_never_read_one_text_differently(text: str) -> None:
    fast = tree_builder.read_text(text)
    both, tree_builder._YAML_LOADERS[:] = list(tree_builder._YAML_LOADERS), tree_builder._YAML_LOADERS[-1:]
    try:
        slow = tree_builder.read_text(text)
    finally:
        tree_builder._YAML_LOADERS[:] = both
    if not fast.faults and not slow.faults:
        assert (fast.tree, fast.keys) == (slow.tree, slow.keys)


HUGE = 999_000


@pytest.mark.parametrize(
    "text",
    [
        "a: " + "[" * HUGE,
        "a: " + "{" * HUGE,
        "- " * (HUGE // 2),
        "? " * (HUGE // 2),
        "a: " + "1" * HUGE,
        "a: '" + "1" * HUGE + " mm'",
        "a:\n" + "- 1\n" * (HUGE // 4),
        "a: 1\n" * (HUGE // 5),
        "a: [" + "*a ," * (HUGE // 4) + "]",
        "a: [" + "!a 1," * (HUGE // 6) + "]",
        "\t" * HUGE,
        "\n" * HUGE,
        "%" * HUGE,
        GOOD.replace("200 mm", "1" + ",000" * 200_000),
        "x" * (2 * HUGE),
    ],
    ids=lambda text: text[:12].encode("unicode_escape").decode(),
)
def test_huge_and_deep_files_are_refused_at_once(text: str) -> None:
    assert isinstance(outcome(text), list)
