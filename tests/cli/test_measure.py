"""`measure` as a user runs it: files, numbers, exit codes, speed."""

from __future__ import annotations

import csv
import json
import resource

import numpy as np
import pytest
from experiment_support import csv_text, loop_columns, lossy_loop, reference_case, rows, triangle


@pytest.fixture
def data(tmp_path):
    """The reference case as a lab file with decimal commas."""
    case = reference_case()
    text = "Zeit [s];Weg [mm];Kraft [N]\n" + rows((case.time, case.motion * 1e3, case.effort), ";", ",", 9)
    (tmp_path / "rig.csv").write_text(text)
    return "rig.csv"


REFERENCE = ("--filter", "2 Hz", "--window", "40 mm:210 mm")


def test_measure_writes_curve_cycles_metrics_figure_and_manifest(cli, data):
    done = cli("measure", data, *REFERENCE)
    assert (done.code, done.err) == (0, "")
    out = cli.folder / "cfm-out/rig-measure"
    assert {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()} == {
        "curve.csv", "cycles.csv", "metrics.json", "manifest.json", "figures/loop.png",
    }  # fmt: skip


def test_metrics_json_holds_raw_and_filtered_values_in_border_units(cli, data):
    cli("measure", data, *REFERENCE, "-o", "out", "--no-plots")
    document = json.loads((cli.folder / "out/metrics.json").read_text())
    assert document["metrics"]["hysteresis_area"]["value"] == pytest.approx(229.53181, abs=1e-4)
    assert document["metrics_filtered"]["hysteresis_area"]["value"] == pytest.approx(229.5, abs=1e-4)
    assert document["metrics_filtered"]["force_mean"]["branches"]["load"] == {
        "value": pytest.approx(50.658152, abs=1e-6),  # over the displacement; 50.658418 over the points
    }
    assert (document["status"], document["cycles"]) == ("complete", 1)
    assert document["window"] == {"from": 40.0, "to": 210.0, "unit": "mm"}
    assert document["filter"].startswith("Butterworth of order 6 per pass, back and forth, cut-off 2 Hz")
    assert document["reading"][0] == "utf-8, separator semicolon, decimal comma"


def test_the_curve_has_raw_and_filtered_forces_in_the_units_of_the_border(cli, data):
    cli("measure", data, *REFERENCE, "-o", "out", "--no-plots")
    with (cli.folder / "out/curve.csv").open(newline="") as file:
        head, *body = csv.reader(file)
    assert head == ["branch", "displacement [mm]", "force [N]", "stable", "force_filtered [N]", "time [s]"]
    assert [row[0] for row in body] == ["load"] * 1008 + ["unload"] * 1008


def test_what_measure_wrote_can_be_measured_again(cli, data):
    cli("measure", data, *REFERENCE, "-o", "one", "--no-plots")
    done = cli("measure", "one/curve.csv", *REFERENCE, "--units", "force=N", "-o", "two", "--no-plots")
    assert done.code == 0
    one, two = (json.loads((cli.folder / name / "metrics.json").read_text())["metrics"] for name in ("one", "two"))
    assert two["hysteresis_area"]["value"] == pytest.approx(one["hysteresis_area"]["value"], rel=1e-12)


def test_the_page_says_how_the_file_was_read_and_both_values(cli, data):
    page = cli("measure", data, *REFERENCE, "--no-plots").out
    assert "rig.csv   2016 points, 1 cycle, window 40 to 210 mm" in page
    assert "  read        utf-8, separator semicolon, decimal comma" in page
    assert any(line.split() == ["hysteresis", "area", "229.5", "N*mm", "229.5", "N*mm"] for line in page.splitlines())


def test_json_is_one_document_with_the_same_numbers_as_the_file(cli, data):
    done = cli("measure", data, *REFERENCE, "-o", "out", "--no-plots", "--json")
    document = json.loads((cli.folder / "out/metrics.json").read_text())
    assert {key: done.document[key] for key in document} == document
    assert done.document["out"] == "out"


def test_the_same_command_gives_the_same_bytes(cli, data):
    for out in ("one", "two"):
        assert cli("measure", data, *REFERENCE, "-o", out).code == 0
    for name in ("curve.csv", "cycles.csv", "metrics.json", "figures/loop.png"):
        assert (cli.folder / "one" / name).read_bytes() == (cli.folder / "two" / name).read_bytes()


def test_a_target_gives_the_deviation_from_it(cli, data):
    done = cli("measure", data, *REFERENCE, "--target", "50 N", "--json", "--no-plots")
    raw = done.document["metrics"]
    assert raw["deviation_from_target"]["value"] == pytest.approx((50 - raw["force_min"]["value"]) / 50)


@pytest.mark.parametrize(
    ("arguments", "code", "complaint"),
    [
        (("none.csv",), 2, "none.csv: there is no such file"),
        (("rig.csv", "--window", "40 mm"), 2, "--window: '40 mm' is not 'from:to'"),
        (("rig.csv", "--window", "40:210"), 2, "--window: 40 has no unit"),
        (("rig.csv", "--filter", "2"), 2, "--filter: 2 has no unit"),
        (("rig.csv", "--units", "Weg"), 2, "--units: 'Weg' is not 'column=unit'"),
        (("rig.csv", "--target", "50 mm"), 2, "--target: '50 mm' is a length"),
        (("rig.csv", "--window", "40 mm:300 mm"), 3, "the window 40 ... 300 mm is not measured on every branch"),
        (("rig.csv", "--window", "400 mm:500 mm"), 3, "the window 400 ... 500 mm is not measured on every branch"),
        (("rig.csv", "--filter", "20 Hz"), 3, "the cut-off 20 Hz is not below half the sampling rate"),
        (("bad.csv",), 3, "bad.csv: line 7: column 'F' [N] holds 'NaN', which is not a number"),
    ],
)
def test_what_is_wrong_is_said_in_one_line_with_its_exit_code(cli, data, arguments, code, complaint):
    lines = csv_text().splitlines()
    lines[6] = lines[6].rpartition(";")[0] + ";NaN"
    (cli.folder / "bad.csv").write_text("\n".join(lines))
    done = cli("measure", *arguments, "--no-plots", "-o", "out")
    assert done.code == code
    assert complaint in done.err
    assert done.err.count("\n") == 1
    assert not (cli.folder / "out").exists()


@pytest.fixture
def spoilt(cli):
    """An elastic reversal of 1 mm, two spikes, 0.4 N of tare, a zero at 3 mm, the force with the other sign."""
    case = lossy_loop(triangle(2), elastic=1.0)
    effort = np.array(case.effort)
    effort[[60, 500]] += 20.0
    text = "t [s];s [mm];F [N]\n" + rows((case.time, 1e3 * case.motion + 3.0, -(effort + 0.4)), digits=9)
    (cli.folder / "spoilt.csv").write_text(text)
    return "spoilt.csv"


def test_tare_zero_and_flip_are_taken_out_and_spikes_and_reversals_left_out(cli, spoilt):
    done = cli("measure", spoilt, "--tare=-0.4 N", "--zero", "start", "--flip", "force", "--window", "0 mm:100 mm",
               "-o", "out", "--no-plots", "--json")  # fmt: skip
    assert done.code == 0
    assert [item["name"] for item in done.document["warnings"]] == ["spikes", "reversals", "window_at_reversal"]
    raw = done.document["metrics"]
    assert raw["force_ripple"]["branches"]["load"]["value"] == pytest.approx(0.6 / 50.8, rel=1e-3)
    assert raw["force_mean"]["branches"]["unload"]["value"] == pytest.approx(49.5, abs=0.02)
    assert done.document["window"]["from"] == pytest.approx(1.5)
    assert done.document["reading"][-3:] == [
        "-0.4 N subtracted from the force", "3 mm subtracted from the displacement", "sign of the force reversed",
    ]  # fmt: skip


def test_as_recorded_nothing_is_left_out(cli, spoilt):
    done = cli("measure", spoilt, "--flip", "force", "--as-recorded", "-o", "out", "--no-plots", "--json")
    assert done.document["warnings"] == []
    assert done.document["metrics"]["force_max"]["value"] > 70


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--tare", "0.4"), "--tare: 0.4 has no unit; write '0.4 N'; or write 'start'"),
        (("--zero", "1 N"), "--zero: '1 N' is a force"),
        (("--flip", "torque"), "--flip: 'torque' is not in this recording; it has force and displacement"),
    ],
)
def test_malformed_corrections_are_usage_errors(cli, data, arguments, complaint):
    done = cli("measure", data, *arguments, "--no-plots")
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert complaint in done.err


def test_one_branch_only_is_refused_unless_it_is_all_there_is(cli):
    (cli.folder / "up.csv").write_text("s [mm];F [N]\n" + rows((np.arange(200.0), 50 + np.arange(200.0) / 100)))
    done = cli("measure", "up.csv", "--no-plots", "-o", "out")
    assert (done.code, done.err.count("\n")) == (3, 1)
    assert done.err.startswith("error    up.csv: holds only the branch 'load'")
    assert not (cli.folder / "out").exists()
    accepted = cli("measure", "up.csv", "--no-plots", "--one-branch", "-o", "out")
    assert accepted.code == 0
    assert "  warning     one_branch" in accepted.out


def test_exchanged_units_are_told_in_one_line(cli):
    text = csv_text("t [s];s [N];F [mm]")
    (cli.folder / "rig.csv").write_text(text)
    done = cli("measure", "rig.csv", "--no-plots")
    assert done.code == 3
    assert done.err == (
        "error    rig.csv: no travel is measured on every branch; are the columns or units of displacement and force "
        "swapped?\n"
    )


def test_a_file_of_100_000_rows_takes_seconds_of_processor_time(cli):
    k = np.arange(1, 50_001) / 50_000
    motion, way = np.concatenate([240 * k, 240 * (1 - k)]), np.repeat([1.0, -1.0], 50_000)
    force = 50 + 0.4 * np.sin(motion / 5) + way * (0.3 + 0.003 * motion)
    (cli.folder / "long.csv").write_text(
        "t [s];s [mm];F [N]\n" + rows((0.001 * np.arange(100_000), motion, force), ";", ",")
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert cli("measure", "long.csv", "-o", "out").code == 0
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    # 1.2 s on an idle machine, 1.05 s of the clock; a busy one inflates processor time, too.
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 3.0


def holed(low=30.0, high=60.0):
    """A loop of 100 mm of which a part was not recorded."""
    motion = triangle(2)
    keep = (motion <= low) | (motion >= high)
    force = 50.0 + 0.01 * motion + 0.5 * np.sign(np.diff(motion, append=motion[-2]))
    return "s [mm];F [N]\n" + rows((motion[keep], force[keep]))


def test_a_hole_in_the_window_is_named_and_ends_with_6(cli):
    (cli.folder / "hole.csv").write_text(holed())
    done = cli("measure", "hole.csv", "-o", "out")
    assert done.code == 6
    page = " ".join(done.out.split())
    assert "holes: not recorded: 30 ... 60 mm (up to 30 % of the window)" in page
    assert "coverage on load 69.7 %" in page
    assert "force mean on load no value" in page
    document = json.loads((cli.folder / "out/metrics.json").read_text())
    assert (document["status"], document["metrics"]["force_mean"]["branches"]["load"]["value"]) == ("partial", None)
    assert document["metrics"]["coverage"]["value"] == pytest.approx(1 - 30 / 99)
    assert document["message"].startswith("not recorded: 30 ... 60 mm")
    assert json.loads((cli.folder / "out/manifest.json").read_text())["exit_code"] == 6
    for options in (("--window", "62 mm:98 mm"), ("--max-hole", "40 %")):
        assert cli("measure", "hole.csv", *options, "-o", "out", "--no-plots").code == 0


def test_each_specimen_of_a_file_has_its_own_values(cli):
    _, motion, force = loop_columns()
    body = "".join(f"{k};{s:.3f};{level + f:.4f}\n" for k, level in (("A", 0.0), ("B", 20.0))
                   for s, f in zip(motion, force, strict=True))  # fmt: skip
    (cli.folder / "both.csv").write_text("Probe;s [mm];F [N]\n" + body)
    refused = cli("measure", "both.csv", "-o", "out")
    assert refused.code == 3
    assert '--group "Probe=A" or --group "Probe=B"' in refused.err
    done = cli("measure", "both.csv", "--group", "Probe", "-o", "out")
    assert done.code == 0
    document = json.loads((cli.folder / "out/metrics.json").read_text())
    levels = [document["metrics"][f"force_mean[{name}]"]["value"] for name in "AB"]
    assert levels[1] - levels[0] == pytest.approx(20.0)
    assert set(document["groups"]) == {"A", "B"}
    with (cli.folder / "out/curve.csv").open(newline="") as file:
        head, *lines = csv.reader(file)
    assert head[0] == "group"
    assert {line[0] for line in lines} == {"A", "B"}
    assert {path.name for path in (cli.folder / "out/figures").iterdir()} == {"loop-1.png", "loop-2.png"}
    one = cli("measure", "both.csv", "--group", "Probe=B", "-o", "one", "--no-plots", "--json").document
    assert one["metrics"]["force_mean"]["value"] == pytest.approx(levels[1])


def test_cycles_are_chosen_by_number(cli):
    motion = np.concatenate([triangle(1, 20, 10.0), triangle(2)[1:]])
    force = 50.0 + 0.01 * motion + 0.5 * np.sign(np.diff(motion, append=motion[-2]))
    (cli.folder / "three.csv").write_text("s [mm];F [N]\n" + rows((motion, force)))
    done = cli("measure", "three.csv", "-o", "out", "--no-plots", "--json").document
    assert done["cycles"] == 2
    assert [item["name"] for item in done["warnings"]] == ["seating_cycles"]
    assert cli("measure", "three.csv", "--cycles", "3", "-o", "out", "--no-plots", "--json").document["cycles"] == 1
    assert cli("measure", "three.csv", "--cycles", "x", "-o", "out").code == 2
    refused = cli("measure", "three.csv", "--cycles", "2:7", "-o", "out")
    assert (refused.code, refused.err.count("\n")) == (3, 1)
