"""``cfmkit batch`` end to end: files, exit codes, JUnit, processes."""

from __future__ import annotations

import csv
import json
import re
import shlex
import signal
import time
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

CONFIGS = Path(__file__).parents[2] / "configs"
CAM = (CONFIGS / "cam_gravity.yaml").read_text()

SPECS = {
    "good": CAM,
    "missed": CAM.replace("max: 3 %", "max: 0.1 %"),
    "invalid": CAM.replace("brace_length: 200 mm", "brace_length: 200"),
    "nothing": CAM.replace("brace_length: 200 mm", "brace_length: 60 mm").split("design:")[0],
    "partial": CAM.replace("analysis:", "analysis:\n  travel: 400 mm").replace("design:", "sweep: null\ndesign:"),
}


def write(cli, *names: str, folder: str = "specs") -> None:
    (cli.folder / folder).mkdir(exist_ok=True)
    for name in names:
        (cli.folder / folder / f"{name}.yaml").write_text(SPECS[name])


def rows(cli, folder: str = "out") -> list[dict[str, str]]:
    with open(cli.folder / folder / "results.csv", newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def batch(cli, *arguments: str, quick: bool = True):
    return cli("batch", *arguments, "-o", "out", *(("--no-plots", "-j", "1") if quick else ()))


STARTS = {"beam_lan2010_yield"}
"""Studies of a published shape that misses its requirements as it stands, which is why it is to be moved."""


@pytest.mark.parametrize(
    ("folder", "verb"),
    [
        ("studies", ("--verb", "analyze")),  # the others are analysed one by one in test_contract.py
        pytest.param(".", ("--verb", "analyze"), marks=pytest.mark.slow),
        pytest.param(".", (), marks=pytest.mark.long),
    ],
    ids=["studies", "analyze", "design"],
)
def test_the_configurations_of_the_package_pass_as_a_batch(cli, folder, verb):
    done = cli("batch", str(CONFIGS / folder), "-o", "out", "--no-plots", "--junit", "reports/cfmkit.xml", *verb)
    start = STARTS if "analyze" in verb else set()
    assert done.code == (5 if start else 0), done.out + done.err
    found = [row for row in rows(cli) if Path(row["folder"]).name not in start]
    assert len(found) == len(rows(cli)) - len(start)
    passed = {path.stem for path in (CONFIGS / folder).rglob("*.yaml")} - start
    assert len(found) == len(passed)
    assert {row["status"] for row in found} == {"complete"}
    assert all(int(row["requirements"]) > 0 and row["missed"] == "0" for row in found)
    root = ElementTree.parse(cli.folder / "reports" / "cfmkit.xml").getroot()
    assert int(root.get("failures")) == sum(int(row["missed"]) for row in rows(cli))
    assert root.get("errors") == root.get("skipped") == "0"
    for row in found:
        assert (cli.folder / "out" / row["folder"] / "manifest.json").exists()
        assert (cli.folder / "out" / row["folder"] / "design.yaml").exists() == (row["verb"] == "design")


@pytest.mark.parametrize(
    ("names", "code"),
    [
        (("good",), 0),
        (("good", "missed"), 5),
        (("missed", "partial"), 6),
        (("missed", "partial", "nothing"), 4),
        (("missed", "partial", "nothing", "invalid"), 3),
    ],
)
def test_the_exit_code_is_the_first_of_the_contract_that_occurs(cli, names, code):
    write(cli, *names)
    done = batch(cli, "specs/*.yaml", "--verb", "analyze")
    assert done.code == code, done.out + done.err
    assert sorted(row["folder"] for row in rows(cli)) == sorted(names)


def test_a_folder_that_cannot_be_written_counts_before_what_is_invalid(cli):
    write(cli, "good", "invalid")
    (cli.folder / "out").mkdir()
    (cli.folder / "out" / "good").write_text("in the way")
    done = batch(cli, "specs")
    assert done.code == 7
    assert {row["folder"]: row["status"] for row in rows(cli)} == {"good": "io", "invalid": "invalid"}


def test_faults_are_told_with_file_line_and_column(cli):
    write(cli, "good", "invalid")
    done = batch(cli, "specs")
    assert done.err.startswith("specs/invalid.yaml:7:17: mechanism.brace_length: ")
    assert "INVALID" in done.out


def test_one_json_document_says_everything(cli):
    write(cli, "good", "missed")
    done = batch(cli, "specs", "--json")
    reported = done.document
    assert (reported["exit_code"], reported["message"]) == (5, "2 specs: 1 ok, 1 missed")
    assert [one["verb"] for one in reported["specs"]] == ["design", "design"]
    assert [one["ok"] for one in reported["requirements"]] == [True, False]
    assert reported["requirements"][1]["spec"] == "specs/missed.yaml"
    assert json.loads((cli.folder / "out" / "metrics.json").read_text())["specs"] == reported["specs"]


def test_each_specification_gives_what_a_run_of_its_own_gives(cli):
    write(cli, "good")
    batch(cli, "specs")
    assert cli("design", "specs/good.yaml", "-o", "alone", "--no-plots").code == 0
    for name in ("metrics.json", "curve.csv", "design.yaml", "resolved.yaml", "geometry/cam.dxf"):
        assert (cli.folder / "alone" / name).read_bytes() == (cli.folder / "out" / "good" / name).read_bytes(), name


def test_several_processes_give_the_same_bytes_in_the_same_order(cli):
    write(cli, "good", "missed", "invalid")
    tables = []
    for jobs in ("1", "3"):
        assert cli("batch", "specs", "-o", "out", "--no-plots", "-j", jobs).code == 3
        tables.append([(cli.folder / "out" / name).read_bytes() for name in ("results.csv", "metrics.json")])
    assert tables[0] == tables[1]


def test_the_second_run_of_an_unchanged_folder_computes_nothing(cli):
    write(cli, *SPECS)
    first = batch(cli, "specs", "--json")
    kept = (path for path in (cli.folder / "out").rglob("*") if path.is_file() and path.name != "manifest.json")
    files = {path: path.read_bytes() for path in kept}
    again = batch(cli, "specs", "--json")
    # What is not valid is looked at again, as `check` does: a file that it names may be there now.
    assert (first.document["reused"], again.document["reused"]) == (0, len(SPECS) - 1)
    assert again.code == first.code
    assert {path: path.read_bytes() for path in files} == files
    manifests = {path: path.read_bytes() for path in (cli.folder / "out").glob("*/manifest.json")}
    write(cli, "missed", folder="more")
    (cli.folder / "more" / "missed.yaml").rename(cli.folder / "specs" / "good.yaml")
    assert batch(cli, "specs", "--json").document["reused"] == len(SPECS) - 2
    changed = [path.parent.name for path, data in manifests.items() if path.read_bytes() != data]
    assert changed == ["good"]
    assert batch(cli, "specs", "--fresh", "--json").document["reused"] == 0


def test_a_batch_that_was_killed_goes_on(cli):
    for name in range(12):
        write(cli, "good")
        (cli.folder / "specs" / "good.yaml").rename(cli.folder / "specs" / f"n{name:02}.yaml")
    process = cli.start("batch", "specs", "-o", "out", "-j", "1", "-q", "--no-plots")
    deadline = time.monotonic() + 60
    while not (cli.folder / "out" / "n02" / "manifest.json").exists():
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.kill()
    process.communicate()
    done = batch(cli, "specs", "--json")
    assert (done.code, len(rows(cli))) == (0, 12)
    assert 2 <= done.document["reused"] < 12


def test_after_a_failure_fail_fast_starts_nothing_more(cli):
    write(cli, "good", "missed")
    write(cli, "invalid", folder="first")
    done = batch(cli, "first", "specs", "--fail-fast", "--junit", "junit.xml")
    assert done.code == 3
    assert [row["status"] for row in rows(cli)] == ["invalid", "skipped", "skipped"]
    root = ElementTree.parse(cli.folder / "junit.xml").getroot()
    assert (root.get("errors"), root.get("skipped")) == ("1", "2")
    assert not (cli.folder / "out" / "good").exists()


def test_equal_stems_write_to_folders_of_their_own(cli):
    write(cli, "good", folder="a")
    write(cli, "good", folder="b")
    assert batch(cli, "a/good.yaml", "b/good.yaml").code == 0
    assert [row["folder"] for row in rows(cli)] == ["a-good", "b-good"]


def test_options_hold_for_every_specification(cli):
    write(cli, "good")
    assert batch(cli, "specs", "--verb", "analyze", "--set", "requirements.0.max=0.1 %").code == 5
    assert rows(cli)[0]["verb"] == "analyze"
    assert batch(cli, "specs", "--set", "mechanism.rollers=2").code == 3


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ((), 2, "SPEC"),
        (("nothing*.yaml",), 2, "no file matches"),
        (("nothing.yaml",), 2, "no such file"),
        (("-",), 2, "a batch reads files"),
        (("specs", "--timeout-per-point", "0"), 2, "must be > 0"),
        (("specs", "--junit", "specs"), 7, "is a folder"),
        (("specs", "--junit", "specs/good.yaml/x.xml"), 7, "cannot write"),
        (("specs", "--junit", ""), 2, "name a file"),
        (("specs", "-o", ""), 2, "--out is empty"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_is_computed(cli, arguments, code, words):
    write(cli, "good")
    done = cli("batch", *arguments, "--no-plots")
    assert done.code == code, done.err
    assert words in done.err
    assert not (cli.folder / "cfm-out").exists()


def test_an_option_for_one_family_leaves_the_others_alone(cli):
    write(cli, "good")
    (cli.folder / "specs" / "crank.yaml").write_text((CONFIGS / "slider_crank_li2019.yaml").read_text())
    plain = batch(cli, "specs", "--set", "mechanism.roller_radius=20 mm", "--verb", "analyze")
    assert (plain.code, [row["status"] for row in rows(cli)]) == (3, ["invalid", "complete"])
    done = batch(cli, "specs", "--set", "cam:mechanism.roller_radius=20 mm", "--verb", "analyze")
    assert done.code == 0, done.err
    assert "roller_radius: 20 mm" in (cli.folder / "out" / "good" / "resolved.yaml").read_text()
    named = "specs/crank.yaml: --set mechanism.roller_radius: unknown key 'roller_radius'"
    assert named in plain.err, "an error in an option names the specification that has it"
    refused = batch(cli, "specs", "--set", "cams:mechanism.roller_radius=20 mm")
    assert (refused.code, "there is no family 'cams'; did you mean 'cam'?" in refused.err) == (2, True)


def test_an_option_for_a_family_that_is_not_there_is_not_lost_without_a_word(cli):
    write(cli, "good")
    option = "vcfm:mechanism.bistable.thickness=1 mm"
    done = batch(cli, "specs", "--set", option, "--verb", "analyze")
    assert (done.code, f"--set {option}: no specification is of the family 'vcfm'" in done.err) == (0, True)
    for verb in ("analyze", "design", "export", "check", "sweep", "sensitivity"):
        alone = cli(verb, "specs/good.yaml", "--set", option)
        assert (alone.code, f"--set {option}: specs/good.yaml is of the family 'cam'" in alone.err) == (2, True)
    (cli.folder / "specs" / "leaves.yaml").write_text((CONFIGS / "vcfm_pla.yaml").read_text())
    assert cli("check", "specs/good.yaml", "specs/leaves.yaml", "--set", option).code == 0


def test_a_run_that_takes_too_long_is_given_up(cli):
    write(cli, "good")
    done = batch(cli, "specs", "--timeout-per-point", "0.001")
    # Nobody knows whether there is a solution: the exit code is not that of a mechanism without one.
    assert done.code == 6
    assert rows(cli)[0]["status"] == "timeout"
    assert "1 timed out" in done.out
    assert batch(cli, "specs").code == 0, "what timed out is computed when there is time"


def test_ctrl_c_writes_what_there_is_and_exits_130(cli):
    write(cli, "good")
    for name in range(40):
        (cli.folder / "specs" / f"n{name:02}.yaml").write_text(CAM)
    process = cli.start("batch", "specs", "-o", "out", "-j", "1", "-q")
    deadline = time.monotonic() + 60
    while not (cli.folder / "out" / "good" / "manifest.json").exists():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 130
    ends = [row["status"] for row in rows(cli)]
    assert ends[0] == "complete"
    assert ends[-1] == "skipped"
    process.communicate()


def test_the_workflows_to_copy_are_yaml_and_their_command_works(cli):
    text = (CONFIGS.parent / "docs" / "ci.md").read_text()
    blocks = [yaml.safe_load(block) for block in re.findall("^```yaml\n(.*?)^```", text, re.M | re.S)]
    github, gitlab = (next(block for block in blocks if key in block) for key in ("jobs", "mechanisms"))
    steps = [step["run"] for step in github["jobs"]["requirements"]["steps"] if "run" in step]
    commands = [line for line in (*steps, *gitlab["mechanisms"]["script"]) if line.startswith("cfmkit")]
    assert len(commands) == 2
    write(cli, "good", folder="mechanisms")
    for command in commands:
        assert cli(*shlex.split(command)[1:], "--no-plots", "-j", "1").code == 0
        assert (cli.folder / "results" / "junit.xml").exists()
