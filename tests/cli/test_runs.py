"""`design` and `analyze`: which files they write, what stands in them, and that they repeat."""

from __future__ import annotations

import csv
import json
from itertools import pairwise
from pathlib import Path

import pytest
import yaml

QUICK = ("--no-plots",)


def written(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_analyze_writes_curve_metrics_resolved_spec_and_manifest_in_the_default_folder(cli, cam):
    done = cli("analyze", cam, *QUICK)
    assert (done.code, done.err) == (0, "")
    assert written(cli.folder) == {cam} | {
        f"cfm-out/cam-analyze/{name}"
        for name in ("curve.csv", "metrics.json", "parts.csv", "resolved.yaml", "manifest.json")
    }


def test_design_adds_the_design_and_the_geometry(cli, cam):
    assert cli("design", cam, "-o", "out", *QUICK).code == 0
    names = written(cli.folder / "out")
    assert {"design.yaml", "curve.csv", "metrics.json", "resolved.yaml", "manifest.json"} < names
    assert {"geometry/cam.dxf", "geometry/cam.svg"} < names
    assert {Path(name).suffix for name in names if name.startswith("geometry/")} == {".dxf", ".svg", ".csv"}


def test_figures_are_drawn_unless_they_are_not_wanted(cli, cam):
    assert cli("analyze", cam, "-o", "out").code == 0
    figures = [path for path in (cli.folder / "out" / "figures").iterdir()]
    assert figures
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in figures)
    assert cli("analyze", cam, "-o", "out", *QUICK).code == 0
    assert not (cli.folder / "out" / "figures").exists()


def test_metrics_json_has_exactly_the_keys_of_the_contract(cli, cam):
    cli("analyze", cam, "-o", "out", *QUICK)
    document = json.loads((cli.folder / "out/metrics.json").read_text())
    assert list(document) == ["status", "message", "metrics", "requirements", "warnings"]
    assert document["status"] == "complete"
    assert document["metrics"]["force_constant"].keys() == {"value", "unit", "definition"}
    assert document["metrics"]["force_mean"].keys() - {"branches"} == {"value", "unit", "definition"}
    assert document["metrics"]["theoretical_force"]["unit"] == "N"
    assert [set(item) for item in document["warnings"]] == [{"name", "message"}] * len(document["warnings"])
    assert {item["name"] for item in document["warnings"]} >= {"undercut"}
    assert [item["ok"] for item in document["requirements"]] == [True, True, True]


def test_a_metric_without_a_value_is_null_and_says_why(cli, cam):
    cli("analyze", cam, "-o", "out", *QUICK)
    text = (cli.folder / "out/metrics.json").read_text()
    assert "NaN" not in text
    missing = json.loads(text)["metrics"]["stress_max"]
    assert missing["value"] is None
    assert missing["reason"]


def test_the_curve_has_both_branches_with_units_in_the_header(cli, cam):
    cli("analyze", cam, "-o", "out", *QUICK)
    with (cli.folder / "out/curve.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    assert head[:4] == ["branch", "displacement [mm]", "force [N]", "stable"]
    assert {"contact_force [N]", "spring_elongation [mm]", "pressure_angle [deg]"} <= set(head)
    assert [row[0] for row in rows] == ["load"] * 481 + ["unload"] * 481
    up = [float(row[1]) for row in rows if row[0] == "load"]
    assert all(one < other for one, other in pairwise(up))


def test_the_same_command_gives_the_same_bytes_but_for_the_manifest(cli, cam):
    for run, folder in ((cli, "one"), (cli.program, "two")):
        assert run("design", cam, "-o", folder).code == 0
    names = written(cli.folder / "one")
    assert names == written(cli.folder / "two")
    assert any(name.startswith("figures/") for name in names)
    for name in names - {"manifest.json"}:
        assert (cli.folder / "one" / name).read_bytes() == (cli.folder / "two" / name).read_bytes(), name


def test_the_manifest_is_the_only_file_with_a_time_and_says_how_the_run_was_made(cli, cam):
    cli("analyze", cam, "-o", "out", "--seed", "7", *QUICK)
    manifest = json.loads((cli.folder / "out/manifest.json").read_text())
    assert manifest["arguments"] == ["analyze", cam, "-o", "out", "--seed", "7", "--no-plots"]
    assert (manifest["command"], manifest["seed"], manifest["status"], manifest["exit_code"]) == (
        "analyze",
        7,
        "complete",
        0,
    )
    assert set(manifest["files"]) == {"curve.csv", "metrics.json", "parts.csv", "resolved.yaml"}
    assert manifest["spec"]["source"] == cam
    assert manifest["started"] <= manifest["finished"]


def test_the_hash_of_the_spec_follows_its_values(cli, cam):
    hashes = []
    for extra in ((), (), ("--set", "mechanism.roller_radius=10 mm")):
        cli("analyze", cam, "-o", "out", *QUICK, *extra)
        hashes.append(json.loads((cli.folder / "out/manifest.json").read_text())["spec"]["sha256"])
    assert hashes[0] == hashes[1] != hashes[2]


def test_resolved_yaml_says_every_value_and_gives_the_same_run(cli, cam):
    cli("analyze", cam, "-o", "one", *QUICK)
    resolved = yaml.safe_load((cli.folder / "one/resolved.yaml").read_text())
    assert resolved["analysis"]["points"] == 481
    assert resolved["analysis"]["travel"] == "240 mm"
    assert resolved["mechanism"]["profile"]["brace_length"] == "200 mm"
    cli("analyze", "one/resolved.yaml", "-o", "two", *QUICK)
    for name in ("resolved.yaml", "metrics.json", "curve.csv"):
        assert (cli.folder / "one" / name).read_bytes() == (cli.folder / "two" / name).read_bytes(), name


def test_design_yaml_is_a_complete_spec_that_analyses_to_the_same_metrics(cli, cam):
    cli("design", cam, "-o", "one", *QUICK)
    assert cli("analyze", "one/design.yaml", "-o", "two", *QUICK).code == 0
    assert (cli.folder / "one/metrics.json").read_bytes() == (cli.folder / "two/metrics.json").read_bytes()
    assert (cli.folder / "one/curve.csv").read_bytes() == (cli.folder / "two/curve.csv").read_bytes()


def test_a_spec_from_standard_input_gives_the_same_run_as_from_its_file(cli, cam):
    cli("analyze", cam, "-o", "one", *QUICK)
    done = cli("analyze", "-", "-o", "two", *QUICK, stdin=(cli.folder / cam).read_text())
    assert done.code == 0
    assert (cli.folder / "one/metrics.json").read_bytes() == (cli.folder / "two/metrics.json").read_bytes()


def test_set_changes_a_value_and_repeats(cli, cam):
    done = cli(
        "analyze", cam, "-o", "out", "--json", *QUICK,
        "--set", "mechanism.springs.stiffness=0.6825 N/mm", "--set", "mechanism.springs.count=4",
    )  # fmt: skip
    assert done.document["metrics"]["spring_stiffness"]["value"] == 2.73


def test_fidelity_is_short_for_a_set_option(cli, cam):
    named, set_ = (
        cli("analyze", cam, "-o", "out", "--json", *QUICK, *extra)
        for extra in (("--fidelity", "quasi-static"), ("--set", "analysis.fidelity=quasi-static"))
    )
    assert named.code == set_.code == 0
    assert named.out == set_.out


def test_a_run_replaces_the_files_of_the_run_before_and_nothing_else(cli, cam):
    cli("design", cam, "-o", "out", *QUICK)
    (cli.folder / "out/notes.txt").write_text("mine")
    assert (
        cli("design", cam, "-o", "out", *QUICK, "--set", "design.force=10 kN", "--set", "design.stroke=9 m").code == 4
    )
    assert written(cli.folder / "out") == {"notes.txt", "metrics.json", "resolved.yaml", "manifest.json"}


def test_an_edited_file_of_the_run_before_is_kept_and_the_user_is_told(cli, cam):
    cli("design", cam, "-o", "out", *QUICK)
    (cli.folder / "out/design.yaml").write_text("# edited\n")
    done = cli("design", cam, "-o", "out", *QUICK)
    assert "design.edited.yaml" in done.out
    assert (cli.folder / "out/design.edited.yaml").read_text() == "# edited\n"


def test_an_infeasible_design_says_why_and_what_would_be_feasible(cli, cam):
    done = cli(
        "design", cam, *QUICK, "--set", "design.stroke=300 mm", "--set", "mechanism.springs.max_elongation=120 mm"
    )
    assert done.code == 4
    assert "120 mm" in done.out
    assert "--set design.stroke=" in done.out
    document = json.loads((cli.folder / "cfm-out/cam-design/metrics.json").read_text())
    assert document["status"] == "infeasible"
    assert not (cli.folder / "cfm-out/cam-design/curve.csv").exists()


def test_the_page_has_the_numbers_requirements_warnings_and_files(cli, cam):
    page = cli("design", cam, "-v").out
    lines = page.splitlines()
    assert lines[0].startswith("sanchez-salinas-2022   50.7 N load, 49.3 N unload over 238 mm (2 to 240 mm)")
    assert lines[0].endswith("all 3 requirements met")
    assert any(line.split() == ["theoretical", "force", "50", "N"] for line in lines)
    assert any(line.startswith("  ripple") and line.endswith("<= 5 %      ok") for line in lines)
    assert "warning    undercut: " in page
    assert "           cfmkit design cam.yaml --set design.avoid_undercut=true\n" in page
    assert "files      cfm-out/cam-design/  design.yaml curve.csv parts.csv metrics.json" in page
    assert "geometry/cam.dxf" in page
    assert "figures/" in page


def test_the_cure_that_a_warning_names_works(cli, cam):
    page = cli("design", cam, *QUICK, "-v").out
    cure = next(line.strip() for line in page.splitlines() if line.strip().startswith("cfmkit design "))
    done = cli(*cure.split()[1:], *QUICK)
    assert "undercut:" not in done.out


def test_the_cure_keeps_what_the_command_line_had_changed(cli, cam):
    changes = ("--set", "mechanism.roller_radius=20 mm", "--set", "design.avoid_undercut=false")
    page = cli("design", cam, *QUICK, *changes, "-v").out
    tight, larger = (line.strip() for line in page.splitlines() if line.strip().startswith("cfmkit design "))
    kept = "cfmkit design cam.yaml --set 'mechanism.roller_radius=20 mm' --set design."
    assert tight == f"{kept}avoid_undercut=false --set design.choose=preload"
    assert larger == f"{kept}avoid_undercut=true"


def test_the_cure_of_a_spec_from_standard_input_says_where_to_write(cli, cam):
    page = cli("design", "-", *QUICK, "-o", "out", "-v", stdin=(cli.folder / cam).read_bytes()).out
    assert "cfmkit design - --set design.avoid_undercut=true -o out\n" in page


def test_a_design_whose_rollers_overlap_is_refused_with_the_largest_that_fits(cli, cam):
    narrow = ("--set", "mechanism.rest_half_width=2 mm", "--set", "design.force=5 N")
    done = cli("design", cam, *QUICK, "-o", "out", *narrow)
    assert done.code == 4
    assert "the rollers overlap by 28 mm" in " ".join((done.out + done.err).split())
    assert "--set mechanism.roller_radius=2mm" in done.out
    assert not (cli.folder / "out/geometry").exists()
    export = cli("export", cam, "-o", "cut", *narrow, "--set", "mechanism.profile.force_constant=1 mm")
    assert export.code == 4
    assert "no plate is left between them" in export.err


def test_verbose_shows_every_metric_and_quiet_shows_nothing(cli, cam):
    assert "pressure angle max" not in cli("analyze", cam, *QUICK).out
    assert "pressure angle max" in cli("analyze", cam, *QUICK, "-v").out
    quiet = cli("analyze", cam, *QUICK, "-q")
    assert (quiet.code, quiet.out, quiet.err) == (0, "", "")


def test_quiet_still_says_which_requirement_is_missed(cli, cam):
    done = cli("analyze", cam, *QUICK, "-q", "--set", "requirements.0.max=1 %")
    assert (done.code, done.out) == (5, "")
    assert done.err == "missed   force ripple 1.27 % over 2 ... 240 mm, allowed <= 1 %\n"


def test_a_missed_requirement_stands_out_without_colour(cli, cam):
    page = cli("analyze", cam, *QUICK, "--set", "requirements.0.max=1 %").out
    assert any(line.startswith("  ripple") and "<= 1 %     MISSED" in line for line in page.splitlines())
    assert "1 of 3 requirements missed\n" in page


@pytest.mark.parametrize("name", ["../../etc/x", "/", "a\nb", "[red]bold[/red] {x}", "力 ü"])
def test_a_strange_name_is_only_a_name(cli, cam, name):
    option = f"name={json.dumps(name)}"
    assert cli("analyze", cam, "-o", "out", *QUICK, "--set", option, "--json").document["name"] == name
    assert written(cli.folder) == {cam} | {
        f"out/{item}" for item in ("curve.csv", "metrics.json", "parts.csv", "resolved.yaml", "manifest.json")
    }
    page = cli("analyze", cam, "-o", "out", *QUICK, "--set", option).out
    assert page.splitlines()[0].startswith(f"{' '.join(name.split())}   50.7 N")
