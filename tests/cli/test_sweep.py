"""``cfmkit sweep`` as a user runs it: rows, order, failures, interruption, two at once."""

from __future__ import annotations

import csv
import json
import os
import random
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest
from journal_support import keys_in
from pace import wait_until

RADII = "mechanism.roller_radius=8 mm:16 mm:5"
BRACES = "mechanism.brace_length=[60 mm, 200 mm, -1 mm]"
FEW = (
    "--metrics", "force_mean,force_ripple,theoretical_force,usable_stroke", "--no-plots",
    "--set", "analysis.points=41", "--set", "requirements=[]",
)  # fmt: skip
JOURNAL = ".cfmkit-journal.sqlite"


def rows(folder):
    with open(folder / "results.csv", newline="") as file:
        return list(csv.DictReader(file))


CAM = Path(__file__).parents[2] / "configs" / "cam.yaml"


def test_every_point_has_a_row_in_order_whatever_becomes_of_it(cli, tmp_path):
    done = cli("sweep", str(CAM), "--vary", RADII, "--vary", BRACES, "-o", "out", *FEW)
    assert done.code == 6
    found = rows(tmp_path / "out")
    assert list(found[0])[:3] == ["mechanism.roller_radius [mm]", "mechanism.brace_length [mm]", "force_mean [N]"]
    assert [(row["mechanism.roller_radius [mm]"], row["mechanism.brace_length [mm]"]) for row in found] == [
        (radius, brace) for radius in ("8.0", "10.0", "12.0", "14.0", "16.0") for brace in ("60.0", "200.0", "-1.0")
    ]
    assert [row["status"] for row in found] == ["no_equilibrium", "complete", "invalid"] * 5
    assert {row["force_mean [N]"] for row in found if row["status"] != "complete"} == {""}
    assert "must be > 0" in found[2]["message"]


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_the_bytes_do_not_depend_on_the_number_of_processes(cli, tmp_path, jobs):
    varied = ("--vary", RADII, "--vary", BRACES, "--vary", "mechanism.profile.friction=0:0.002:4")
    cli("sweep", str(CAM), *varied, "-o", "one", "-j", "1", *FEW, "--curves")
    cli("sweep", str(CAM), *varied, "-o", "other", "-j", jobs, *FEW, "--curves", "--timeout-per-point", "60")
    for name in ("results.csv", "curves.csv", "metrics.json", "resolved.yaml"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes(), name


@pytest.mark.parametrize("options", [("-j", "2"), ("--curves",), ("--timeout-per-point", "60"), ()])
def test_an_ordinary_sweep_of_the_cam_has_the_same_bytes_however_it_is_done(cli, tmp_path, options):
    """Every column, in blocks: in one process or two, with curves and pictures or without, fresh or resumed."""
    command = ("sweep", str(CAM), "--vary", "mechanism.rest_half_width=60 mm:70 mm:90", "--set", "analysis.points=41")
    cli(*command, "-o", "one", "-j", "1", "--no-plots")
    plots = () if options == () else ("--no-plots",)
    cli(*command, "-o", "other", *options, *plots)
    cli(*command, "-o", "other", *options, *plots)
    for name in ("results.csv", "metrics.json", "resolved.yaml"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes(), name


def test_the_same_command_again_computes_nothing(cli, tmp_path):
    command = ("sweep", str(CAM), "--vary", RADII, "-o", "out", *FEW, "--json")
    first = cli(*command)
    before = (tmp_path / "out" / "results.csv").read_bytes()
    again = cli(*command)
    assert (first.document["reused"], again.document["reused"]) == (0, 5)
    assert (tmp_path / "out" / "results.csv").read_bytes() == before


def test_a_wider_range_reuses_the_points_it_shares(cli):
    """Designs are single points; closed models are solved, and kept, in blocks."""
    strokes = "design.stroke={} mm:250 mm:{}"
    cli("sweep", str(CAM), "--design", "--vary", strokes.format(150, 5), "-o", "out", *FEW)
    wider = cli("sweep", str(CAM), "--design", "--vary", strokes.format(125, 6), "-o", "out", *FEW, "--json")
    assert (wider.document["reused"], wider.document["points"]["total"]) == (5, 6)


def test_a_larger_grid_of_a_vectorised_model_reuses_the_blocks_it_shares(cli):
    """Their number decided their size: 10 000 points and 10 100 had no block in common."""
    rows = "mechanism.roller_radius=6 mm:7 mm:100"
    springs = "mechanism.springs.stiffness=[{}]"
    lists = [", ".join(f"{0.5 + k / 1000:.3f} N/mm" for k in range(count)) for count in (100, 101)]
    options = ("--metrics", "theoretical_force", "-o", "out", "--no-plots", "--json")
    cli("sweep", str(CAM), "--vary", springs.format(lists[0]), "--vary", rows, *options)
    journal = next(cli.folder.glob("out/.cfmkit-journal*")).stat().st_size
    assert journal < (cli.folder / "out" / "results.csv").stat().st_size / 5
    wider = cli("sweep", str(CAM), "--vary", springs.format(lists[1]), "--vary", rows, *options)
    assert (wider.document["points"]["total"], wider.document["reused"]) == (10_100, 9_984)


def test_the_block_of_the_spec_says_what_options_say(cli, tmp_path):
    text = CAM.read_text()
    block = (
        "sweep:\n  vary: {mechanism.roller_radius: '8 mm:16 mm:5', analysis.points: [21, 41]}\n"
        "  metrics: [force_mean]\n  curves: true\n"
    )
    (tmp_path / "own.yaml").write_text(text + block)
    assert cli("sweep", "own.yaml", "-o", "block", "--no-plots").code in (0, 5)
    options = ("--vary", RADII, "--vary", "analysis.points=[21, 41]", "--metrics", "force_mean", "--curves")
    assert cli("sweep", str(CAM), *options, "-o", "options", "--no-plots").code in (0, 5)
    for name in ("results.csv", "curves.csv", "metrics.json"):
        assert (tmp_path / "block" / name).read_bytes() == (tmp_path / "options" / name).read_bytes()


def test_a_wrong_path_in_the_spec_is_found_by_check_with_its_line(cli, tmp_path):
    text = CAM.read_text()
    (tmp_path / "own.yaml").write_text(text + "sweep:\n  vary:\n    mechanism.roler_radius: '8 mm:16 mm:5'\n")
    done = cli("check", "own.yaml")
    line = text.count("\n") + 3
    assert done.code == 3
    assert f"own.yaml:{line}:" in done.err
    assert "did you mean 'mechanism.roller_radius'?" in done.err


def test_curves_lead_with_what_varies(cli, tmp_path):
    cli("sweep", str(CAM), "--vary", RADII, "-o", "out", *FEW, "--curves")
    with open(tmp_path / "out" / "curves.csv", newline="") as file:
        found = list(csv.DictReader(file))
    assert list(found[0])[:4] == ["mechanism.roller_radius [mm]", "branch", "displacement [mm]", "force [N]"]
    assert len(found) == 5 * 2 * 41


def test_points_drawn_at_random_repeat_with_their_seed(cli, tmp_path):
    for out, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        varied = ("--vary", "mechanism.roller_radius=8 mm:16 mm", "--sample", "sobol:16", "--seed", seed)
        assert cli("sweep", str(CAM), *varied, "-o", out, *FEW).code == 0
    contents = [(tmp_path / out / "results.csv").read_bytes() for out in "abc"]
    assert contents[0] == contents[1] != contents[2]


def test_designing_at_each_point(cli, tmp_path):
    done = cli("sweep", str(CAM), "--vary", "design.force=[40 N, 60 N]", "--design", "-o", "out", *FEW)
    assert done.code == 0
    assert [float(row["theoretical_force [N]"]) for row in rows(tmp_path / "out")] == pytest.approx([40, 60])


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ((), 2, "nothing to vary"),
        (("--vary", "mechanism.roller_radius"), 2, "no values"),
        (("--vary", "mechanism.roler_radius=[1 mm]"), 3, "did you mean 'mechanism.roller_radius'?"),
        (("--vary", RADII, "--zip", "--sample", "lhs:4"), 2, "exclude each other"),
        (("--vary", RADII, "--sample", "dice:4"), 2, "lhs:N or "),
        (("--vary", RADII, "--metrics", "force_riple"), 2, "did you mean 'force_ripple'?"),
        (("--vary", RADII, "--max-points", "4"), 2, "5 points are more than 4"),
        (("--vary", "mechanism.roller_radius=1 mm:2 mm:999999999999"), 2, "--max-points"),
        (("--vary", RADII, "--timeout-per-point", "0"), 2, "must be > 0"),
        (("--vary", "mechanism.brace_length=[60 mm, 61 mm]"), 4, ""),
        (("--vary", "mechanism.brace_length=[-1 mm, -2 mm]"), 3, ""),
        (("--vary", "mechanism.springs.count=[1, 3]", "--set", "requirements.0.max=0.01 %"), 5, ""),
    ],
)
def test_exit_codes(cli, arguments, code, message):
    done = cli("sweep", str(CAM), *arguments, "-o", "out", "--no-plots")
    assert done.code == code
    assert message in done.err
    assert "Traceback" not in done.err


def test_a_time_limit_costs_its_points_only(cli, tmp_path):
    slow = ("--vary", "analysis.fidelity=[analytic, solid]", "--timeout-per-point", "1")
    done = cli("sweep", str(CAM.with_name("vcfm_ding2022.yaml")), *slow, "-o", "out", "--no-plots")
    assert done.code == 6
    assert [row["status"] for row in rows(tmp_path / "out")] == ["complete", "timeout"]


LEAVES, LAST = (
    str(CAM.with_name("vcfm_ding2022.yaml")),
    ("--fidelity", "exact", "--metrics", "force_mean", "--no-plots"),
)
SOME, MANY = (
    (LEAVES, "--vary", f"mechanism.bistable.thickness=0.9 mm:1.1 mm:{n}", "--vary", "analysis.points=[41, 42]", *LAST)
    for n in (50, 300)
)  # exact leaves are followed one by one


def test_ctrl_c_writes_what_is_there_and_the_same_command_goes_on(cli, tmp_path):
    command = ("sweep", *SOME, "-o", "out", "-j", "2")
    process = cli.start(*command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    journal = tmp_path / "out" / JOURNAL
    wait_until(lambda: len(keys_in(journal)) > 20, 30)
    process.send_signal(signal.SIGINT)
    _, complaints = process.communicate(timeout=30)
    assert process.returncode == 130
    assert b"run the same command again to continue" in complaints
    part = rows(tmp_path / "out")
    assert 0 < len(part) < 100
    assert cli(*command).code == 0
    whole = rows(tmp_path / "out")
    assert len(whole) == 100
    assert [row for row in whole if row in part] == part


@pytest.mark.parametrize(
    ("options", "reported"),
    [((), b"again to continue"), (("--fresh",), b"again without --fresh to continue")],
    ids=["kept", "fresh"],
)
def test_a_study_that_is_terminated_says_how_it_goes_on(cli, tmp_path, options, reported):
    command = ("sweep", *MANY, "-o", "out", "-j", "2", *options)
    process = cli.start(*command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    journal = tmp_path / "out" / JOURNAL
    wait_until(lambda: len(keys_in(journal)) > 4, 30)
    process.send_signal(signal.SIGTERM)
    _, complaints = process.communicate(timeout=30)
    assert process.returncode == 143
    assert b"terminated; what is finished is kept: run the same command " + reported in complaints


def test_ctrl_c_twice_ends_at_once_and_keeps_the_journal(cli, tmp_path):
    """Points of seconds run when it is struck: that none of them is finished shows that nobody waited for them."""
    slow = ("--vary", "analysis.points=[21, 999999, 1000000]", "-o", "out", "--no-plots", "-j", "2")
    process = cli.start("sweep", str(CAM), *slow, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    journal = tmp_path / "out" / JOURNAL
    wait_until(lambda: len(keys_in(journal)) == 1, 30)
    process.send_signal(signal.SIGINT)
    assert b"press Ctrl-C again to end at once" in process.stderr.readline()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    assert process.returncode in (130, -signal.SIGINT)
    assert len(keys_in(journal)) == 1
    assert not (tmp_path / "out" / "results.csv").exists()


@pytest.mark.parametrize(("kills", "points"), [(1, SOME), pytest.param(100, MANY, marks=pytest.mark.slow)])
def test_kills_at_random_moments_lose_no_row_and_change_no_byte(cli, tmp_path, kills, points):
    """Every record that was in the journal stays until all are in the table, which is that of an undisturbed run."""
    quiet = (*points, "-q")
    assert cli("sweep", *quiet, "-o", "undisturbed", "-j", "1").code == 0
    expected = (tmp_path / "undisturbed" / "results.csv").read_bytes()
    chance, struck, acknowledged = random.Random(kills), 0, set()
    journal = tmp_path / "out" / JOURNAL
    while struck < kills:
        jobs = chance.choice(("1", "2"))
        process = cli.start("sweep", *quiet, "-o", "out", "-j", jobs, stderr=subprocess.PIPE)
        time.sleep(chance.uniform(0.3, 1.6))
        process.kill()
        _, complaints = process.communicate()
        struck += process.returncode == -signal.SIGKILL
        assert b"Traceback" not in complaints
        kept = keys_in(journal)
        assert acknowledged <= kept
        acknowledged = kept
        if process.returncode == 0:
            assert (tmp_path / "out" / "results.csv").read_bytes() == expected
            journal.unlink()
            acknowledged = set()
    done = cli("sweep", *quiet, "-o", "out")
    assert done.code == 0
    assert (tmp_path / "out" / "results.csv").read_bytes() == expected
    assert (tmp_path / "out" / "metrics.json").read_bytes() == (tmp_path / "undisturbed" / "metrics.json").read_bytes()
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "results.csv", "metrics.json", "resolved.yaml", "manifest.json", JOURNAL,
    }  # fmt: skip


@pytest.mark.parametrize("races", [2, pytest.param(50, marks=pytest.mark.slow)])
def test_of_two_runs_into_one_folder_exactly_one_works(cli, tmp_path, races):
    slow = ("--vary", "analysis.points=100000:100040:41", "--no-plots", "-q", "-j", "1")
    for race in range(races):
        gate_out, gate_in = os.pipe()
        waiting = 'read _; exec "$0" "$@"'
        racers = [
            subprocess.Popen(
                ["sh", "-c", waiting, str(cli.command), "sweep", str(CAM), *slow, "-o", f"out-{race}"],
                cwd=tmp_path, env=cli.environment(), stdin=gate_out, stderr=subprocess.PIPE,
            )
            for _ in range(2)
        ]  # fmt: skip
        time.sleep(0.05)
        os.write(gate_in, b"\n\n")
        os.close(gate_in)
        os.close(gate_out)
        wait_until(lambda racers=racers: any(one.poll() is not None for one in racers), 30)
        loser = next(one for one in racers if one.poll() is not None)
        winner = racers[1 - racers.index(loser)]
        assert loser.returncode == 8, loser.stderr.read()
        assert b"is in use by a live run" in loser.stderr.read()
        assert winner.poll() is None
        winner.kill()
        winner.wait()
        loser.stderr.close()
        winner.stderr.close()


def test_json_says_what_was_found(cli, tmp_path):
    done = cli("sweep", str(CAM), "--vary", RADII, "-o", "out", *FEW, "--json")
    reported = done.document
    assert reported["points"] == {"total": 5, "complete": 5}
    assert reported["best"]["by"] == "force_ripple"
    assert reported["exit_code"] == 0
    written = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert written["best"] == reported["best"]
    ripples = [float(row["force_ripple [1]"]) for row in rows(tmp_path / "out")]
    assert reported["metrics"]["force_ripple"]["value"] == ripples[0]  # the first of those that are as good
    assert ripples[0] == pytest.approx(min(ripples), rel=1e-12)
    assert reported["best"]["point"] == 1
    assert reported["range"]["force_ripple"]["max"] == max(ripples)


@pytest.mark.parametrize(
    ("options", "names"),
    [
        (("--vary", RADII), {"curves.png", "force_ripple.png"}),
        (("--vary", RADII, "--vary", "mechanism.springs.count=[1, 2, 3]"), {"force_ripple.png"}),
        (("--vary", "mechanism.roller_radius=8 mm:16 mm", "--sample", "lhs:5"), {"curves.png", "force_ripple.png"}),
    ],
)
def test_pictures_fit_the_number_of_parameters(cli, tmp_path, options, names):
    done = cli("sweep", str(CAM), *options, "--metrics", "force_ripple", "--set", "requirements=[]", "-o", "out")
    assert done.code == 0
    assert {path.name for path in (tmp_path / "out" / "figures").iterdir()} == names
    assert not (tmp_path / "out" / "curves.csv").exists()


def test_of_numbers_without_a_unit_only_shares_are_percentages(cli):
    config = CAM.with_name("slider_crank_li2019_bistable.yaml")
    reported = cli(
        "sweep", str(config), "--vary", "mechanism.offset=[20 mm, 30 mm]", "-o", "out", "--no-plots", "-v"
    ).out
    lines = {words[0]: words[1:] for line in reported.splitlines() if (words := re.split(r"\s{2,}", line.strip()))}
    assert lines["stable positions"][0] == "2"
    assert lines["torque ripple"][0].endswith(" %")


DESIGNED = ("--design", "--vary", "design.stroke=150mm:250mm:3", "--metrics", "force_mean,force_ripple", "--no-plots")


def test_a_table_says_why_cells_are_empty_where_a_window_does_not_follow_a_swept_stroke(cli, tmp_path):
    places = ("[2 mm, 240 mm]", "[5 mm, 240 mm]")
    keys = ("analysis.window", "requirements.0.over", "requirements.1.over")
    stated = [f"{key}={places[key.endswith('1.over')]}" for key in keys]
    done = cli("sweep", str(CAM), *DESIGNED, "-o", "out", *(word for one in stated for word in ("--set", one)))
    found = rows(tmp_path / "out")
    assert [row["force_mean [N]"] == "" for row in found] == [True, True, False]
    assert [row["message"] for row in found] == [
        f"no value over 2 ... 240 mm (analysis.window, requirements.0.over): the curve covers only 0 ... {end} mm; "
        f"no value over 5 ... 240 mm (requirements.1.over): the curve covers only 0 ... {end} mm"
        for end in (150, 200)
    ] + [""]
    (reported,) = json.loads((tmp_path / "out" / "metrics.json").read_text())["warnings"]
    assert reported["name"] == "window_outside"
    assert reported["message"].startswith("2 of 3 points have no value over a window")
    assert "window_outside" in done.out


def test_windows_in_shares_of_the_travel_follow_a_swept_stroke(cli, tmp_path):
    shares = ("--set", "analysis.window=[1 %, 100 %]", "--set", "requirements.0.over=[1 %, 100 %]")
    done = cli("sweep", str(CAM), *DESIGNED, "-o", "out", *shares, "--set", "requirements.1.over=[5 mm, 100 %]")
    assert done.code == 0
    found = rows(tmp_path / "out")
    assert all(float(row["force_ripple [1]"]) > 0 for row in found)
    assert [(row["requirements_met"], row["message"]) for row in found] == [("true", "")] * 3
    assert json.loads((tmp_path / "out" / "metrics.json").read_text())["warnings"] == []


def test_a_design_that_is_impossible_names_the_key_that_blocks_in_tables_and_when_quiet(cli, tmp_path):
    short = ("--set", "mechanism.brace_length=60 mm", "--no-plots", "-o", "out")
    key = "nearest feasible: mechanism.brace_length: more than 68 mm"
    done = cli("design", str(CAM), *short, "-q")
    assert done.code == 4
    assert key in done.err
    cli("sweep", str(CAM), "--design", "--vary", "design.force=[40 N, 50 N]", *short[:-1], "swept")
    assert all(row["message"].endswith(key) for row in rows(tmp_path / "swept"))
