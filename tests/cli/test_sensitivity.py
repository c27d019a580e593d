"""``cfmkit sensitivity`` end to end: files, exit codes, failures, resumption."""

from __future__ import annotations

import csv
import json
import re
import shutil
import signal
import time
from pathlib import Path

import pytest
from journal_support import keys_in

CONFIG = Path(__file__).parents[2] / "configs" / "studies" / "cam_tolerance.yaml"
RANGES = ("--vary", "mechanism.rest_half_width=uniform:0.1 mm", "--vary", "mechanism.rolling_friction=uniform:10 %")
QUICK = ("--no-plots", "-q")
METHODS = ("oat", "local", "morris", "sobol", "tolerance")
INDICES = {
    "oat": {"at_low_end", "at_high_end", "swing", "normalised_slope"},
    "local": {"gradient", "normalised_slope"},
    "morris": {"mu_star", "mu", "sigma"},
    "sobol": {"first_order", "total_order"},
    "tolerance": {"variance_drop_when_halved", "yield_gain_when_halved"},
}


@pytest.fixture
def study(cli) -> str:
    shutil.copy(CONFIG, cli.folder / "cam.yaml")
    return "cam.yaml"


def table(path: Path) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def lines(cli, folder: str, index: str, metric: str = "force_mean") -> dict[str, dict[str, str]]:
    rows = table(cli.folder / folder / "indices.csv")
    return {one["parameter"]: one for one in rows if one["index"] == index and one["metric"].startswith(metric)}


def report(cli, folder: str):
    return json.loads((cli.folder / folder / "metrics.json").read_text())


@pytest.mark.parametrize("method", METHODS)
def test_every_method_writes_its_tables_and_pictures(cli, study, method):
    options = ("--method", method, "--samples", "4", "-j", "1", "-q")
    done = cli("sensitivity", study, "-o", "out", *RANGES, *options)
    assert done.code in (0, 5), done.err
    rows = table(cli.folder / "out" / "indices.csv")
    assert {row["index"] for row in rows} == INDICES[method]
    samples = table(cli.folder / "out" / "results.csv")
    assert all(row["status"] == "complete" for row in samples)
    reported = report(cli, "out")
    assert reported["method"] == method
    assert reported["samples"]["evaluated"] == len(samples)
    assert list((cli.folder / "out" / "figures").glob("*.png"))
    listed = json.loads((cli.folder / "out" / "manifest.json").read_text())["files"]
    assert "indices.csv" in str(listed)


@pytest.mark.parametrize("change", ["sensitivity.samples=6", "cam: sensitivity.samples = 6"])
def test_a_number_of_samples_that_is_set_counts_for_the_method_of_the_option(cli, study, change):
    for more in (("--set", change), ("--set", change, "--samples", "5")):
        done = cli("sensitivity", study, "-o", "out", "--method", "oat", *more, "-j", "1", "-q", "--no-plots")
        assert done.code in (0, 5), done.err
        assert report(cli, "out")["samples"]["blocks"] == int(more[-1][-1])


def test_the_force_is_proportional_to_the_springs(cli, study):
    vary = ("--vary", "mechanism.springs.stiffness.*=uniform:1 %")
    assert cli("sensitivity", study, "-o", "out", "--method", "local", *vary, *QUICK, "-j", "1").code == 0
    slopes = lines(cli, "out", "normalised_slope")
    assert [float(one["value"]) for one in slopes.values()] == pytest.approx([0.5, 0.5], abs=1e-9)
    exact = lines(cli, "out", "gradient")["mechanism.springs.stiffness.0"]
    assert exact["unit"] == "N/(N/mm)"
    nominal = report(cli, "out")["metrics"]["force_mean_load over 5 ... 235 mm"]["value"]
    assert float(exact["value"]) == pytest.approx(nominal / 2 / 0.69, rel=1e-9)


def test_two_springs_of_one_batch_scatter_more_than_two_of_any(cli, study):
    spreads = []
    for correlation in (0, 1):
        change = ("--set", f"sensitivity.correlated.0.correlation={correlation}")
        only = ("--set", "sensitivity.samples=100", "--metrics", "theoretical_force", "-j", "1")
        assert cli("sensitivity", study, "-o", "out", *change, *only, *QUICK).code in (0, 5)
        forces = [
            float(row["theoretical_force [N]"])
            for row in table(cli.folder / "out" / "results.csv")
            if row["role"] == "drawn"
        ]
        mean = sum(forces) / len(forces)
        spreads.append((sum((one - mean) ** 2 for one in forces) / len(forces)) ** 0.5 / mean)
    # Two springs of 1 % each: 1/sqrt(2) % if they are independent, 1 % if they are the same.
    assert spreads == pytest.approx([0.01 / 2**0.5, 0.01], rel=0.2)


def test_the_yield_stands_in_the_report_with_its_interval_and_decides_the_exit_code(cli, study):
    options = ("--samples", "40", *QUICK)
    done = cli("sensitivity", study, "-o", "out", *options)
    reported = report(cli, "out")["yield"]
    assert done.code == (0 if reported["value"] >= 0.8 else 5)
    assert reported["parts"] == 40
    assert reported["wilson"][0] < reported["value"] < reported["wilson"][1]
    missed = cli("sensitivity", study, "-o", "out", *options, "--set", "sensitivity.min_yield=100 %")
    assert missed.code == 5
    assert "required >= 100 %" in missed.err
    assert report(cli, "out")["requirements"][-1]["metric"] == "yield"
    assert report(cli, "out")["requirements"][-1]["ok"] is False


FAILING = ("--vary", "mechanism.rolling_friction=-0.001:0.005", "--vary", "mechanism.roller_radius=uniform:0.01 mm")


@pytest.mark.parametrize("method", ["oat", "morris", "sobol", "tolerance"])
def test_samples_that_fail_leave_the_indices_out_and_exit_with_6(cli, study, method):
    options = ("--method", method, "--samples", "8", "-j", "1", *QUICK)
    done = cli("sensitivity", study, "-o", "out", *FAILING, *options)
    assert done.code == 6, done.err
    reported = report(cli, "out")
    failed = [row for row in table(cli.folder / "out" / "results.csv") if row["status"] == "invalid"]
    assert reported["samples"]["failed"] == len(failed) > 0
    assert all(not row["force_mean_load over 5 ... 235 mm [N]"] for row in failed)
    name = {"oat": "swing", "morris": "mu_star", "sobol": "total_order", "tolerance": "variance_drop_when_halved"}
    value = lines(cli, "out", name[method])["mechanism.rolling_friction"]["value"]
    assert value == ""
    assert "failed_samples" in [one["name"] for one in reported["warnings"]]


def test_the_same_seed_gives_the_same_bytes_however_many_processes_and_another_seed_does_not(cli, study):
    tables = []
    for number, options in enumerate((("-j", "1"), ("-j", "2"), ("-j", "1", "--seed", "7"))):
        folder = f"out{number}"
        cli("sensitivity", study, "-o", folder, "--method", "sobol", "--samples", "4", *RANGES, *QUICK, *options)
        tables.append([(cli.folder / folder / name).read_bytes() for name in ("results.csv", "indices.csv")])
    assert tables[0] == tables[1]
    assert tables[0][0] != tables[2][0]


def test_more_samples_reuse_those_that_are_there(cli, study):
    options = ("--method", "sobol", *RANGES, *QUICK, "-j", "1", "--json")
    first = cli("sensitivity", study, "-o", "out", "--samples", "32", *options)
    second = cli("sensitivity", study, "-o", "out", "--samples", "64", *options)
    assert json.loads(first.out)["reused"] == 0
    assert json.loads(second.out)["reused"] == 128  # whole blocks of the vectorised model


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (("--vary", "mechanism.roller_radius"), 2, "low:high"),
        (("--vary", "mechanism.roller_radius=normal:1:2"), 2, "low:high"),
        (("--vary", "mechanism.roler=normal:1 mm"), 3, "mechanism.roler"),
        (("--vary", "mechanism.roller_radius=normal:1 N"), 3, "is a force"),
        (("--vary", "mechanism.roller_radius=normal:0.1"), 3, "has no unit"),
        (("--vary", "mechanism.roller_radius=17 mm:16 mm"), 3, "smaller"),
        (("--vary", "mechanism.springs.stiffness=normal:1 %"), 3, "is a list here"),
        (("--vary", "mechanism.masses.brace=normal:1 %"), 3, "has no value"),
        (("--vary", "analysis.points=1:2"), 3, "does not vary continuously"),
        (("--vary", "mechanism.roller_radius=20 mm:21 mm"), 3, "nominal value is outside"),
        (("--metrics", "force_men"), 2, "force_men"),
        (("--samples", "1"), 2, "--samples"),
        (("--set", "sensitivity.on_failure=bound"), 3, "was removed; samples without a result are counted"),
        (("--max-points", "10"), 2, "--max-points"),
        (("--set", "sensitivity=null"), 2, "nothing to vary"),
        (("--set", "sensitivity.correlated.0.correlation=2"), 3, "<= 1"),
        (("--set", "mechanism.brace_length=60 mm"), 4, "itself has no solution"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_is_computed(cli, study, options, code, words):
    done = cli("sensitivity", study, "-o", "out", "--no-plots", *options)
    assert done.code == code, done.err
    assert words in done.err
    assert not (cli.folder / "out").exists()


def test_faults_of_the_block_are_told_with_line_and_column(cli, study):
    text = (cli.folder / study).read_text()
    text = text.replace("{uniform: 0.05 mm}", "{uniform: 0.05 N}")
    (cli.folder / "bad.yaml").write_text(text.replace("mechanism.brace_length:", "mechanism.brace_lenth:"))
    done = cli("check", "bad.yaml")
    assert done.code == 3
    first, second = done.err.splitlines()
    assert first.startswith("bad.yaml:31:30: sensitivity.parameters.'mechanism.roller_radius': uniform: ")
    assert second.startswith("bad.yaml:32:")
    assert "did you mean 'mechanism.brace_length'" in second


def test_a_part_that_follows_another_value_is_warned_of(cli, cam):
    done = cli("sensitivity", cam, "-o", "out", "--method", "local", *RANGES, *QUICK, "--json")
    (warned,) = [one for one in json.loads(done.out)["warnings"] if one["name"] == "derived_part"]
    assert "mechanism.profile.rest_half_width follow" in warned["message"]
    done = cli("sensitivity", str(CONFIG), "-o", "out", "--method", "local", *RANGES, *QUICK, "--json")
    assert "derived_part" not in [one["name"] for one in json.loads(done.out)["warnings"]]


def test_the_page_says_what_matters(cli, study):
    done = cli("sensitivity", study, "-o", "out", "--samples", "10", "--no-plots")
    for words in ("yield", "95 %", "variance drop when halved", "  rest_half_width", "files"):
        assert words in done.out


def test_an_interrupted_study_exits_130_and_goes_on_where_it_stopped(cli, study):
    command = (
        "sensitivity",
        study,
        "-o",
        "out",
        "--method",
        "oat",
        "--samples",
        "300",
        "-j",
        "2",
        *RANGES,
        "--no-plots",
    )
    slow = ("--set", "analysis.points=100000")
    process = cli.start(*command, *slow, "-q")
    journal, deadline = cli.folder / "out" / ".cfmkit-journal.sqlite", time.monotonic() + 60
    while not keys_in(journal):
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    rows = table(cli.folder / "out" / "results.csv")
    missing, every = map(int, re.search(rb"(\d+) of (\d+) samples were not computed", err).groups())
    assert (every - missing, missing > 0) == (len(rows), True)
    samples = json.loads((cli.folder / "out" / "metrics.json").read_text())["samples"]
    assert (samples["evaluated"], samples["missing"]) == (len(rows), missing)
    assert 0 < len(rows) < 600
    assert not (cli.folder / "out" / "indices.csv").exists()
    again = cli(*command, *slow, "--json")
    assert again.code in (0, 5)
    assert again.document["reused"] == len(rows)
    assert again.document["samples"]["evaluated"] == 600


def test_a_seed_of_zero_goes_before_that_of_the_spec(cli, study):
    def seed(*options):
        command = ("sensitivity", study, "--method", "morris", "--samples", "2", "--no-plots", "-o", "o", *options)
        assert cli(*command).code == 0
        return json.loads((cli.folder / "o" / "manifest.json").read_text())["seed"]

    assert seed() == 0
    assert seed("--set", "sensitivity.seed=7") == 7
    assert seed("--set", "sensitivity.seed=7", "--seed", "0") == 0
    assert seed("--set", "sensitivity.seed=7", "--seed", "3") == 3


def test_a_metric_that_does_not_vary_is_told_and_changes_no_exit_code(cli, study):
    reported = cli(
        "sensitivity", study, "--method", "sobol", "--samples", "4", "--no-plots", "--metrics", "force_constant"
    )
    assert reported.code == 0
    assert "force_constant does not vary" in " ".join(reported.out.split())


def test_a_sensitivity_without_any_value_names_the_window_that_is_outside(cli, tmp_path):
    varied = ("--vary", "mechanism.rolling_friction=0.001:0.004", "--metrics", "force_ripple")
    done = cli(
        "sensitivity",
        str(CONFIG.parents[1] / "cam.yaml"),
        *varied,
        "--set",
        "analysis.window=[250 mm, 300 mm]",
        "-o",
        "out",
    )
    assert done.code == 4
    assert "no value over 250 ... 300 mm (analysis.window): the curve covers only 0 ... 240 mm" in done.err
