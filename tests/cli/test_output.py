"""How the page looks: widths, colours, encodings, progress."""

from __future__ import annotations

import io
import os
import subprocess
import sys

import pytest

from cfmkit.cli import output
from cfmkit.cli.output import Terminal

ESCAPE = "\x1b["
RUN = ("analyze", "cam.yaml", "-o", "out", "--no-plots", "--set", "requirements.0.max=1 %")


@pytest.mark.parametrize("columns", [40, 60, 80, 108, 300])
def test_a_page_keeps_to_the_width_of_the_terminal(cli, cam, columns):
    lines = cli(*RUN, "-v", COLUMNS=str(columns)).out.splitlines()
    commands = [line for line in lines if line.strip().startswith("cfmkit design")]
    changed = "           cfmkit design cam.yaml --set 'requirements.0.max=1 %' --set design."
    assert commands == [f"{changed}choose=preload", f"{changed}avoid_undercut=true"]
    whole = [line for line in lines if len(line) > min(columns, 100) and " " in line.strip()]
    assert whole == commands[: len(whole)]
    short = cli(*RUN, COLUMNS=str(columns)).out.splitlines()
    assert max(map(len, short)) <= min(columns, 100)
    assert len(short) <= 15 or columns < 80


@pytest.mark.parametrize("columns", [40, 50])
def test_a_narrow_page_has_the_numbers_as_well(cli, cam, columns):
    page = cli(*RUN, COLUMNS=str(columns)).out
    for number in ("50.7 N", "238.9 mm", "<= 1 %", "MISSED"):
        assert number in page


def test_redirected_output_has_no_colour(cli, cam):
    assert ESCAPE not in cli(*RUN).out


def on_terminal(cli, *arguments: str, **environment: str) -> str:
    """Return what a command writes to a terminal."""
    import pty

    ours, theirs = pty.openpty()
    with open(theirs, "wb") as stream:
        process = cli.start(*arguments, stdout=stream, stderr=stream, env_more=environment)
    parts = []
    while True:
        try:
            parts.append(os.read(ours, 4096))
        except OSError:
            break
        if not parts[-1]:
            break
    os.close(ours)
    process.wait(timeout=60)
    return b"".join(parts).decode()


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
class TestOnATerminal:
    def test_colours_repeat_what_words_say(self, cli, cam):
        page = on_terminal(cli, *RUN, TERM="xterm-256color")
        assert f"{ESCAPE}1;33mMISSED" in page
        assert f"{ESCAPE}36mok" in page

    def test_no_color_is_honoured(self, cli, cam):
        page = on_terminal(cli, *RUN, TERM="xterm-256color", NO_COLOR="1")
        assert "MISSED" in page
        assert not any(f"{ESCAPE}{code}" in page for code in ("1;33m", "33m", "36m", "31m"))

    def test_json_is_never_coloured(self, cli, cam):
        assert ESCAPE not in on_terminal(cli, *RUN, "--json", TERM="xterm-256color")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_a_name_that_the_encoding_cannot_say_is_escaped(cli, cam, encoding):
    command = [cli.command, *RUN, "--set", "name=Kräfte 力"]
    environment = cli.environment(PYTHONIOENCODING=encoding, PYTHONUTF8="0")
    done = subprocess.run(command, cwd=cli.folder, env=environment, capture_output=True, check=False)
    assert done.returncode == 5
    told = done.stdout.splitlines()[0].decode(encoding)
    assert {"ascii": r"Kr\xe4fte \u529b", "latin-1": r"Kräfte \u529b", "utf-8": "Kräfte 力"}[encoding] in told


def test_json_is_readable_in_every_encoding(cli, cam):
    done = cli.program(*RUN, "--json", "--set", "name=Kräfte 力", PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert done.document["name"] == "Kräfte 力"


@pytest.mark.parametrize(
    ("arguments", "json", "verbose"),
    [
        (["analyze", "x", "--json"], True, 0),
        (["analyze", "--", "--json"], False, 0),
        (["-vv"], False, 2),
        (["-v", "-qv"], False, 2),
        (["--verbose", "--verbose"], False, 2),
        (["-o", "v"], False, 0),
    ],
)
def test_options_of_output_are_read_off_a_command_line_that_may_be_malformed(arguments, json, verbose):
    output = Terminal.guess(arguments)
    assert (output.json, output.verbose) == (json, verbose)


class Watched(io.StringIO):
    """A terminal that somebody watches."""

    def isatty(self) -> bool:
        return True


def reported(monkeypatch: pytest.MonkeyPatch, stream: io.StringIO, terminal: Terminal) -> str:
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    with terminal.progress() as report:
        report(0.5, "solving")
        report(1.0, "solving")
    return stream.getvalue()


@pytest.mark.parametrize("things", ["points", "specs"])
def test_a_study_says_what_it_counts(monkeypatch, capsys, things):
    from cfmkit.cli import progress

    monkeypatch.setattr(progress, "LINE_EVERY", 0.0)
    quiet = type("Screen", (), {"json": False, "quiet": False})()
    with progress.watching(quiet, things) as monitor:
        monitor.total(4)
        monitor.add_finished(1, 0, False)
        monitor.interrupt(2, None)
    told = capsys.readouterr().err
    assert f"1 of 4 {things}, " in told
    assert f"stopping after the {things} that run now" in told


def test_points_that_are_drawn_again_are_counted_with_those_before(monkeypatch, capsys):
    from cfmkit.cli import progress

    monkeypatch.setattr(progress, "LINE_EVERY", 0.0)
    with progress.watching(type("Screen", (), {"json": False, "quiet": False})()) as monitor:
        for points in (4, 2):
            monitor.total(points)
            monitor.add_finished(points, 0, False)
    assert "6 of 6 points" in capsys.readouterr().err


def test_progress_is_shown_where_somebody_watches(monkeypatch):
    assert "solving" in reported(monkeypatch, Watched(), Terminal())


def test_a_bar_does_not_go_back(monkeypatch):
    shown = []
    bar = output.Bar()
    monkeypatch.setattr(bar, "show", lambda done, total, text: shown.append((done, total, text)))
    for fraction, text in ((0.2, "starts"), (1.0, "starts"), (0.75, "refinements")):
        bar.report(fraction, text)
    assert shown == [(20, 100, "starts"), (100, 100, "starts"), (100, 100, "refinements")]


@pytest.mark.parametrize(
    ("stream", "terminal"),
    [(io.StringIO(), Terminal()), (Watched(), Terminal(quiet=True)), (Watched(), Terminal(json=True))],
    ids=["redirected", "quiet", "json"],
)
def test_progress_is_not_shown_elsewhere(monkeypatch, stream, terminal):
    assert reported(monkeypatch, stream, terminal) == ""


NAME = "a\x1b[31m\nb.yaml"
"""A file name that would turn a terminal red and break a line."""


@pytest.mark.parametrize("verb", ["check", "batch", "analyze", "design", "sweep", "export"])
def test_a_name_with_control_characters_is_shown_escaped_and_on_one_line(cli, cam, verb):
    (cli.folder / cam).rename(cli.folder / NAME)
    options = ["--vary", "analysis.points=[481,401]"] if verb == "sweep" else []
    options += ["-v"] if verb in ("analyze", "design") else []
    done = cli(verb, NAME, *options, *(["--no-plots", "-o", "o\x1b[5m"] if verb not in ("check", "export") else []))
    assert done.code == 0
    for text in (done.out, done.err):
        assert all(char == "\n" or char.isprintable() for char in text)
    named = [line for line in (done.out + done.err).split("\n") if "b.yaml" in line]
    assert all("a\\x1b[31m\\x0ab.yaml" in line for line in named)
    assert named or verb in ("sweep", "export")


def test_a_broken_file_with_control_characters_in_its_name_and_content_commands_nothing(cli):
    (cli.folder / NAME).write_text("cfmkit: 1\nfamily: 'x\ny'\nname: \"\\e[5m\"\n")
    for done in (cli("check", NAME), cli("batch", NAME), cli("check", "no\x1b[31m.yaml"), cli("show", "\x1b[31m")):
        assert done.code in (2, 3)
        assert all(char == "\n" or char.isprintable() for char in done.out + done.err)


LONG = "q" * 3000


@pytest.mark.parametrize(
    "change",
    [
        "family={}",
        "mechanism.brace_length={}",
        "mechanism.contact={{width: 8 mm, material: {}}}",
        "mechanism.profile.file={}",
        "analysis.fidelity={}",
        "requirements.0.metric={}",
        "requirements.0.over=[{}, 1 mm]",
        "mechanism.{}=1",
    ],
)
def test_a_long_value_is_quoted_no_further_than_needed_to_recognise_it(cli, cam, change):
    done = cli("check", cam, "--set", change.format(LONG))
    assert done.code in (2, 3)
    assert all(len(line) < 700 for line in done.err.split("\n"))
    assert "qqqq" in done.err


@pytest.mark.parametrize(
    "arguments",
    [
        (LONG,),
        ("analyze", LONG),
        ("analyze", "cam.yaml", f"--{LONG}"),
        ("analyze", "cam.yaml", "-o", LONG),
        ("analyze", "cam.yaml", "--seed", LONG),
        ("sweep", "cam.yaml", "--vary", f"mechanism.{LONG}=1 mm:2 mm:3"),
        ("sweep", "cam.yaml", "--vary", f"mechanism.roller_radius={LONG}"),
        ("sensitivity", "cam.yaml", "--vary", f"{LONG}=normal:1 %"),
        ("batch", LONG),
        ("check", f"{LONG}.yaml"),
        ("measure", f"{LONG}.csv"),
    ],
)
def test_a_long_name_is_shown_no_further_than_needed_to_recognise_it(cli, cam, arguments):
    done = cli(*arguments)
    assert done.code in (2, 3, 7)
    assert all(len(line) < 700 for line in done.err.split("\n"))
    assert "\n\n" not in done.err


def test_piped_work_prints_a_line_with_the_time_left_now_and_then(monkeypatch, capsys):
    clock = iter([0.0, 3.0, 12.0, 15.0, 30.0, 60.0])
    monkeypatch.setattr(output.time, "monotonic", lambda: next(clock))
    lines = output.ProgressLines()
    for share, text in ((0.1, "a"), (0.25, "b"), (0.26, "c"), (0.5, "d"), (1.0, "end")):
        lines.report(share, text)
    assert capsys.readouterr().err == "25 %, 36 s left: b\n50 %, 30 s left: d\n"
