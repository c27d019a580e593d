"""Every exit code of the contract, reached by a user's command; and one JSON document whatever happens."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest

from cfmkit.errors import ExitCode, OutputError
from cfmkit.store import RunFolder

RUN = ("analyze", "cam.yaml", "-o", "out", "--no-plots")
ENVELOPE = ["status", "message", "exit_code", "metrics", "requirements", "warnings", "errors"]

OUTCOMES = {
    "ok": (RUN, ExitCode.OK, "complete"),
    "unknown-option": ((*RUN, "--fast"), ExitCode.USAGE, "usage"),
    "no-spec": (("analyze",), ExitCode.USAGE, "usage"),
    "unknown-verb": (("analyse", "cam.yaml"), ExitCode.USAGE, "usage"),
    "missing-file": (("analyze", "cem.yaml"), ExitCode.USAGE, "usage"),
    "a-folder": (("analyze", "."), ExitCode.USAGE, "usage"),
    "malformed-set": ((*RUN, "--set", "points"), ExitCode.USAGE, "usage"),
    "negative-seed": ((*RUN, "--seed", "-1"), ExitCode.USAGE, "usage"),
    "no-time": (("design", "cam.yaml", "--time-budget", "0 s"), ExitCode.USAGE, "usage"),
    "no-folder-for-stdin": (("analyze", "-"), ExitCode.USAGE, "usage"),
    "empty-folder-name": (("analyze", "cam.yaml", "-o", ""), ExitCode.USAGE, "usage"),
    "unknown-key": ((*RUN, "--set", "mechanism.roler=1 mm"), ExitCode.INVALID, "invalid"),
    "no-unit": ((*RUN, "--set", "mechanism.roller_radius=16"), ExitCode.INVALID, "invalid"),
    "unknown-metric": ((*RUN, "--set", "requirements.0.metric=force_riple"), ExitCode.INVALID, "invalid"),
    "unknown-fidelity": ((*RUN, "--fidelity", "ansys"), ExitCode.INVALID, "invalid"),
    "nothing-to-design": (
        ("design", "cam.yaml", "-o", "out", "--no-plots", "--set", "design=null"),
        ExitCode.INVALID,
        "invalid",
    ),
    "infeasible": (
        ("design", "cam.yaml", "-o", "out", "--no-plots", "--set", "mechanism.springs.max_elongation=120 mm"),
        ExitCode.NO_SOLUTION,
        "infeasible",
    ),
    "no-equilibrium": (
        (*RUN, "--set", "mechanism.brace_length=60 mm"),
        ExitCode.NO_SOLUTION,
        "no_equilibrium",
    ),
    "nothing-to-cut": (
        ("export", "cam.yaml", "-o", "out", "--set", "mechanism.brace_length=60 mm"),
        ExitCode.NO_SOLUTION,
        "no_solution",
    ),
    "missed": ((*RUN, "--set", "requirements.0.max=1 %"), ExitCode.REQUIREMENT_MISSED, "complete"),
    "partial": ((*RUN, "--set", "analysis.travel=400 mm"), ExitCode.PARTIAL, "partial"),
    "partial-before-missed": (
        (*RUN, "--set", "analysis.travel=400 mm", "--set", "requirements.0.max=1 %"),
        ExitCode.PARTIAL,
        "partial",
    ),
}


@pytest.mark.parametrize(("arguments", "code", "status"), OUTCOMES.values(), ids=OUTCOMES)
def test_each_outcome_has_its_exit_code_and_one_json_document(cli, cam, arguments, code, status):
    done = cli(*arguments, "--json")
    assert done.code == code
    assert list(done.document)[:7] == ENVELOPE
    assert (done.document["status"], done.document["exit_code"]) == (status, code)
    assert "Traceback" not in done.err
    failed = code in (ExitCode.USAGE, ExitCode.INVALID) or status == "no_solution"
    assert bool(done.document["errors"]) == failed
    assert bool(done.document["message"])


@pytest.mark.parametrize(("arguments", "code", "status"), OUTCOMES.values(), ids=OUTCOMES)
def test_without_json_a_failure_is_told_on_standard_error_in_plain_lines(cli, cam, arguments, code, status):
    done = cli(*arguments)
    assert done.code == code
    assert "Traceback" not in done.err + done.out
    if code in (ExitCode.USAGE, ExitCode.INVALID):
        assert done.out == ""
        assert len(done.err.splitlines()) == 1


@pytest.mark.parametrize("name", ["infeasible", "no-equilibrium"])
def test_without_a_solution_the_reason_is_written_but_no_curve(cli, cam, name):
    arguments, _, status = OUTCOMES[name]
    cli(*arguments)
    assert sorted(path.name for path in (cli.folder / "out").iterdir()) == [
        "manifest.json",
        "metrics.json",
        "resolved.yaml",
    ]
    assert f'"status": "{status}"' in (cli.folder / "out/metrics.json").read_text()


@pytest.mark.parametrize("name", ["unknown-key", "missing-file", "nothing-to-design", "unknown-option"])
def test_an_invalid_request_writes_nothing(cli, cam, name):
    cli(*OUTCOMES[name][0])
    assert sorted(path.name for path in cli.folder.iterdir()) == ["cam.yaml"]


def test_a_file_that_is_not_ours_in_the_way_is_exit_7_and_stays(cli, cam):
    (cli.folder / "out").mkdir()
    (cli.folder / "out/metrics.json").write_text("mine")
    done = cli(*RUN)
    assert done.code == ExitCode.IO
    assert "metrics.json is in the way" in done.err
    assert (cli.folder / "out/metrics.json").read_text() == "mine"
    assert os.listdir(cli.folder / "out") == ["metrics.json"]


def test_an_output_folder_that_is_a_file_is_exit_7(cli, cam):
    (cli.folder / "out").write_text("mine")
    done = cli(*RUN, "--json")
    assert (done.code, done.document["status"]) == (ExitCode.IO, "io")
    assert (cli.folder / "out").read_text() == "mine"


def test_a_folder_of_a_live_run_is_exit_8(cli, cam):
    with RunFolder(cli.folder / "out"):
        done = cli(*RUN, "--json")
    assert (done.code, done.document["status"]) == (ExitCode.IN_USE, "in_use")
    assert cli(*RUN).code == ExitCode.OK


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bug in cfmkit."""

    def analyze(spec, run=None):
        raise RuntimeError("the lever fell off")

    monkeypatch.setattr("cfmkit.api.analyze", analyze)


def test_a_bug_is_exit_70_in_one_line_with_the_way_to_see_more(cli, cam, broken):
    done = cli(*RUN)
    assert (done.code, done.out) == (ExitCode.BUG, "")
    assert done.err == "error    this is a bug in cfmkit: RuntimeError: the lever fell off; -vv shows where\n"
    assert not (cli.folder / "out").exists()


def test_a_bug_under_json_is_a_document(cli, cam, broken):
    done = cli(*RUN, "--json")
    assert (done.code, done.document["status"]) == (ExitCode.BUG, "bug")


@pytest.mark.parametrize("flags", [("-vv",), ("-v", "-v"), ("--verbose", "-v")])
def test_vv_lets_the_traceback_through(cli, cam, broken, flags):
    done = cli(*RUN, *flags)
    assert "Traceback (most recent call last)" in done.err
    assert 'raise RuntimeError("the lever fell off")' in done.err
    assert done.err.splitlines()[-1].startswith("error    this is a bug")


def test_v_alone_shows_no_traceback(cli, cam, broken):
    assert "Traceback" not in cli(*RUN, "-v").err


def test_every_fault_of_a_spec_is_one_line_with_its_place(cli):
    (cli.folder / "bad.yaml").write_text(
        "cfmkit: 1\nfamily: cam\nmechanism:\n  brace_lenght: 200 mm\n  roller_radius: 16\n"
        "requirements:\n  - {metric: force_riple, max: 5 %}\n  - {metric: force_mean, max: 5 mm}\n"
    )
    done = cli("analyze", "bad.yaml")
    assert done.code == ExitCode.INVALID
    lines = done.err.splitlines()
    assert all(re.match(r"bad\.yaml:\d+:\d+: [\w.]+: ", line) for line in lines)
    assert [int(line.split(":")[1]) for line in lines] == sorted(int(line.split(":")[1]) for line in lines)
    for part in ("did you mean 'brace_length'?", "roller_radius", "did you mean 'force_ripple'?", "requirements.1.max"):
        assert part in done.err


def test_the_place_of_every_fault_stands_in_the_json_document(cli):
    (cli.folder / "bad.yaml").write_text("cfmkit: 1\nfamily: cam\nmechanism: 3\n")
    fault = cli("analyze", "bad.yaml", "--json").document["errors"][0]
    assert fault.keys() == {"source", "line", "column", "path", "message"}
    assert (fault["source"], fault["line"], fault["path"]) == ("bad.yaml", 3, "mechanism")


def test_a_fault_in_an_option_names_the_option(cli, cam):
    assert cli(*RUN, "--fidelity", "ansys").err.startswith("--fidelity: 'ansys'")
    assert cli(*RUN, "--set", "mechanism.roller_radius=16").err.startswith("--set mechanism.roller_radius: ")


@pytest.mark.parametrize(
    ("name", "content", "code", "reported"),
    [
        ("empty.yaml", b"", 3, "the file is empty"),
        ("binary.yaml", bytes(range(256)), 3, "not UTF-8"),
        ("list.yaml", b"- 1\n", 3, "a list"),
        ("other.yaml", b"family: kam\n", 3, "'kam' is not one of"),
        ("none.yaml", b"name: x\n", 3, "'family' is missing"),
    ],
)
def test_a_file_that_is_no_spec_gets_one_clear_line(cli, name, content, code, reported):
    (cli.folder / name).write_bytes(content)
    done = cli("analyze", name)
    assert done.code == code
    assert reported in done.err
    assert len(done.err.splitlines()) == 1


def test_a_missing_file_is_compared_with_what_stands_there(cli, cam):
    assert "did you mean 'cam.yaml'?" in cli("analyze", "cm.yaml").err
    assert "nor a folder nowhere" in cli("analyze", "nowhere/cam.yaml").err
    assert "did you mean" not in cli("analyze", "nosuch.yaml").err


def test_an_unknown_verb_is_compared_with_those_there_are(cli):
    done = cli("analyse", "cam.yaml")
    assert done.code == 2
    assert done.err == "error    there is no command 'analyse'; did you mean 'analyze'? See 'cfmkit --help'\n"


needs_permissions = pytest.mark.skipif(
    sys.platform != "linux" and (sys.platform == "win32" or os.geteuid() == 0),
    reason="only on Linux root can be made to obey permissions",
)


@needs_permissions
def test_an_unreadable_file_is_exit_2(cli, cam):
    (cli.folder / cam).chmod(0)
    done = cli.permitted("analyze", cam)
    assert (done.code, len(done.err.splitlines())) == (ExitCode.USAGE, 1)


@needs_permissions
def test_a_folder_without_write_permission_is_exit_7(cli, cam):
    cli.folder.chmod(0o500)
    try:
        assert cli.permitted(*RUN).code == ExitCode.IO
    finally:
        cli.folder.chmod(0o700)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
@pytest.mark.parametrize("arguments", [("show", "units"), ("--help",), (*RUN, "--json"), RUN])
def test_a_full_disk_behind_standard_output_is_exit_7(cli, cam, arguments):
    with open("/dev/full", "wb") as full:
        process = cli.start(*arguments, stdout=full)
        _, reported = process.communicate(timeout=60)
    assert process.returncode == ExitCode.IO
    assert b"no space left" in reported
    assert b"Exception ignored" not in reported


@pytest.mark.skipif(sys.platform == "win32", reason="pipes differ")
@pytest.mark.parametrize("arguments", [("show", "cam"), ("--help",), (*RUN, "-v"), (*RUN, "--json")])
def test_a_reader_that_leaves_early_is_no_error(cli, cam, arguments):
    reading, writing = os.pipe()
    os.close(reading)
    process = cli.start(*arguments, stdout=writing)
    os.close(writing)
    _, reported = process.communicate(timeout=60)
    assert (process.returncode, reported) == (0, b"")


def test_closed_streams_are_no_error(cli, cam):
    script = f"'{cli.command}' analyze cam.yaml -o out --no-plots >&- 2>&- <&-"
    process = cli.shell(script)
    assert process.wait(timeout=60) == 0
    assert (cli.folder / "out/manifest.json").exists()


def test_a_missing_file_that_is_shipped_says_how_to_have_it(cli):
    for name in ("configs/cam.yaml", "cam.yaml", "configs/studies/cam_tolerance.yaml"):
        reported = cli("analyze", name)
        assert reported.code == 2
        assert f"`cfmkit examples {name.rpartition('/')[2].removesuffix('.yaml')}`" in reported.err
    assert "cfmkit examples" not in cli("analyze", "mine.yaml").err


@pytest.mark.parametrize("name", ["cam", "vcfm", "slider-crank", "beam"])
def test_the_hint_for_a_sweep_of_nothing_varies_a_value_of_that_mechanism(cli, name):
    assert cli("new", name, "-o", "mine.yaml").code == 0
    reported = cli("sweep", "mine.yaml")
    assert reported.code == 2
    hint = re.search(r"--vary '([^']+)'", reported.err)[1]
    assert cli("sweep", "mine.yaml", "--vary", hint, "--max-points", "4").err.count("5 points") == 1
    reported = cli("sensitivity", "mine.yaml").err
    assert f"--vary '{hint.partition('=')[0]}=normal" in reported


def test_what_a_model_refuses_is_told_with_its_place_in_the_file(cli, cam):
    spec = cli.folder / "cam.yaml"
    text = spec.read_text().replace(
        "  roller_radius: 16 mm\n", "  left: {roller_radius: 15 mm}\n  roller_radius: 16 mm\n", 1
    )
    spec.write_text(text)
    line = text[: text.index("  left: ")].count("\n") + 1
    run = cli(*RUN)
    assert run.code == ExitCode.INVALID
    reported = f"cam.yaml:{line}:9: mechanism.left: the quasi-static model is symmetric"
    assert run.err.startswith(reported)
    for command in (
        ("sweep", "--vary", "mechanism.brace_length=[200 mm, 201 mm]", "-j", "1"),
        ("sensitivity", "--vary", "mechanism.brace_length=normal:0.1 mm", "--samples", "4"),
    ):
        run = cli(command[0], "cam.yaml", "-o", command[0], "--no-plots", "-q", *command[1:])
        assert (run.code, run.err.count("\n")) == (ExitCode.INVALID, 1)
        assert run.err.startswith(reported)


def test_what_an_option_of_sensitivity_says_has_no_place_in_the_file(cli, cam):
    vary = ("--vary", "mechanism.brace_length=normal:0.1 mm")
    run = cli("sensitivity", "cam.yaml", "-o", "out", *vary, "--method", "inverse", "--set", "requirements=[]")
    assert run.code == ExitCode.INVALID
    assert run.err.startswith("sensitivity.method: finds the tolerances")


@pytest.mark.parametrize("command", [("new", "cam"), ("examples", "cam")])
def test_where_the_schema_cannot_be_written_beside_it_a_spec_is_not_written_either(cli, monkeypatch, command):
    def full(path, _data):
        raise OutputError(f"cannot write {path}: the disk is full")

    monkeypatch.setattr("cfmkit.runs.editor_schema.atomic_write", full)
    folder = cli.folder / "mine"
    out = str(folder / "cam.yaml") if command[0] == "new" else str(folder)
    if command[0] == "new":
        folder.mkdir()
    run = cli(*command, "-o", out)
    assert (run.code, run.err.count("\n")) == (ExitCode.IO, 1)
    assert "the disk is full" in run.err
    assert not folder.exists() or not list(folder.iterdir())


def test_a_safety_factor_says_of_which_stress_it_is(cli, cam):
    pressed = "mechanism.contact={material: steel-s235, width: 10 mm}"
    run = cli(*RUN, "--set", pressed, "--set", "mechanism.safety_factor=2", "-v")
    assert "of 117.5 MPa (yield strength / 2)" in " ".join(run.out.split())


def test_a_row_of_a_kept_requirement_measures_nothing_but_what_it_shows(cli, cam, monkeypatch):
    """Each row had every metric measured over its window: a page of some hundred requirements took minutes."""
    from cfmkit import metrics

    asked = []
    measured = metrics.evaluate

    def noted(result, names=None, window=None):
        asked.append(names)
        return measured(result, names, window)

    for module in ("cfmkit.metrics", "cfmkit.documents.run_document"):
        monkeypatch.setattr(f"{module}.evaluate", noted)
    run = cli(*RUN)
    assert "ripple 1.27 % <= 5 % ok" in " ".join(run.out.split())
    assert asked.count(None) <= 1
    assert all(len(names) <= 3 for names in asked if names is not None)


@pytest.mark.parametrize(
    ("arguments", "reported"),
    [
        (("sweep", "cam.yaml", "-j", "x"), "'-j' / '--jobs': a whole number is needed; see"),
        (("sensitivity", "cam.yaml", "--method", "nosuch"), "'--method': 'nosuch' is not one of 'oat'"),
    ],
)
def test_what_a_library_says_of_an_option_is_put_in_plain_words(cli, cam, arguments, reported):
    done = cli(*arguments)
    assert done.code in (ExitCode.USAGE, ExitCode.INVALID)
    assert reported in done.err
