"""What a newcomer reads: the help of every verb, and the pages of `cfmkit show`."""

from __future__ import annotations

import shlex
from importlib import import_module

import pytest

from cfmkit import families
from cfmkit.cli.commands import names, parse, program
from cfmkit.cli.main import HELP_EPILOG, HELP_TEXT, _accept_global_options, main
from cfmkit.cli.show_topics import READ_FIRST, explain

pytestmark = pytest.mark.lists

EXAMPLES = {
    name: module.HELP_EXAMPLE
    for name in names()
    if hasattr(module := import_module(f"cfmkit.cli.verbs.{name.replace('-', '_')}"), "HELP_EXAMPLE")
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_of_a_help_is_a_command_that_is_understood(name):
    command = EXAMPLES[name].partition(" > ")[0]
    program_name, verb, *_ = words = shlex.split(command)
    assert (program_name, verb) == ("cfmkit", name)
    assert parse(program(_accept_global_options, HELP_TEXT, HELP_EPILOG), words[1:]) is not None


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_ends_the_help(name, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    main([name, "--help"])
    shown = capsys.readouterr().out
    assert f"Example: {EXAMPLES[name]}" in " ".join(shown.split())
    assert "{SPEC}" not in shown


@pytest.mark.parametrize("name", names())
def test_the_help_fits_into_80_columns_with_every_word_whole(name, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    main([name, "--help"])
    shown = capsys.readouterr().out
    assert "\N{HORIZONTAL ELLIPSIS}" not in shown
    assert max(map(len, shown.splitlines())) <= 80


@pytest.mark.parametrize("name", ["batch", "explore", "sensitivity", "suggest"])
def test_a_paragraph_of_a_help_is_not_broken_where_the_docstring_is(name, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    main([name, "--help"])
    above = capsys.readouterr().out.partition("Arguments")[0]
    paragraphs = [line.strip() for line in above.splitlines() if line.strip()]
    assert all(line.endswith(".") for line in paragraphs[1:-1]), paragraphs


def test_the_help_says_what_a_spec_is_and_where_to_start(capsys):
    main(["--help"])
    shown = " ".join(capsys.readouterr().out.split())
    assert "A spec is a YAML file" in shown
    assert "`cfmkit new cam`" in shown


@pytest.mark.parametrize("name", families.names())
def test_a_family_is_explained_in_the_order_in_which_a_file_is_written(name, capsys):
    main(["show", name])
    lines = capsys.readouterr().out.splitlines()
    heads = [line.partition(":")[0] for line in lines if line and not line.startswith(" ") and ":" in line]
    blocks = [head for head in heads if head in READ_FIRST or head in ("sweep", "sensitivity")]
    assert blocks == [head for head in (*READ_FIRST, "sweep", "sensitivity") if head in blocks]
    assert f"cfmkit new {name}" in " ".join(lines[:3])


def test_what_the_overview_names_is_explained():
    from cfmkit.cli.show_topics import BY_NAME

    for name in BY_NAME:
        assert explain(name).data


@pytest.mark.parametrize(
    ("name", "kind", "family"),
    [
        ("brace_length", "keys", "cam"),
        ("mechanism.brace_length", "keys", "cam"),
        ("window", "keys", "every"),
        ("theta2", "symbols", "vcfm"),
        ("r1", "symbols", "slider-crank"),
    ],
)
def test_keys_and_symbols_are_explained_by_their_names(name, kind, family):
    assert family in {one["family"] for one in explain(name).data[kind]}


def test_a_command_is_no_topic_but_has_a_help(capsys):
    assert main(["show", "papers"]) == 2
    assert "`cfmkit papers --help`" in capsys.readouterr().err


def test_a_key_that_is_misspelt_is_named(capsys):
    assert main(["show", "brace_lenght"]) == 2
    assert "'brace_length'" in capsys.readouterr().err
