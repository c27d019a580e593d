"""`analyze --data` and `calibrate` as a user runs them."""

from __future__ import annotations

import hashlib
import json
import re

import numpy as np
import pytest

import cfmkit
import cfmkit.api

FIT = ("--fit", "mechanism.rolling_friction,mechanism.rest_half_width")


@pytest.fixture
def rig(cli, cam):
    """A recording that the model made with mu = 0.00225 and 0.5 mm more rest length, and 0.1 N of normal noise."""
    spec = cfmkit.api.resolve(cfmkit.load(cli.folder / cam))
    spec = spec.replace({"mechanism.rolling_friction": 0.00225, "mechanism.rest_half_width": 0.06825})
    curve = cfmkit.analyze(spec).curve
    good = np.isfinite(curve.force)
    force = curve.force[good] + np.random.default_rng(0).normal(0, 0.1, good.sum())
    lines = [f"{s * 1e3:.4f};{f:.4f}" for s, f in zip(curve.motion[good], force, strict=True)]
    (cli.folder / "rig.csv").write_text("s [mm];F [N]\n" + "\n".join(lines) + "\n")
    return "rig.csv"


def metrics(cli, folder):
    return json.loads((cli.folder / folder / "metrics.json").read_text())


def test_analyze_with_data_adds_errors_a_figure_and_the_measured_curve(cli, cam, rig):
    done = cli("analyze", cam, "--data", rig, "-o", "out")
    assert (done.code, done.err) == (0, "")
    assert "residual rms " in " ".join(done.out.split())
    document = metrics(cli, "out")
    assert list(document)[:5] == ["status", "message", "metrics", "requirements", "warnings"]
    offset = document["metrics"]["data_offset"]
    assert offset["unit"] == "N"
    assert 0.2 < offset["branches"]["load"]["value"] < 0.4
    assert document["data"]["window"] == {"from": 2.0, "to": pytest.approx(240.0), "unit": "mm"}
    assert (cli.folder / "out/figures/data.png").read_bytes().startswith(b"\x89PNG")
    assert (cli.folder / "out/data.csv").read_text().startswith("branch,displacement [mm],force [N]")


@pytest.mark.parametrize("link", [False, True], ids=["file", "link"])
@pytest.mark.parametrize("verb", ["analyze", "calibrate"])
def test_the_manifest_has_the_hash_of_the_measurement(cli, cam, rig, verb, link):
    if link:
        (cli.folder / "link.csv").symlink_to(cli.folder / rig)
        rig = "link.csv"
    options = ("--data", rig) if verb == "analyze" else (rig, "--fit", "mechanism.rolling_friction")
    cli(verb, cam, *options, "-o", "out", "--no-plots")
    manifest = json.loads((cli.folder / "out/manifest.json").read_text())
    content = (cli.folder / "rig.csv").read_bytes()
    assert manifest["data"] == {"source": rig, "sha256": hashlib.sha256(content).hexdigest()}


def test_analyze_without_data_says_nothing_about_data(cli, cam):
    cli("analyze", cam, "-o", "out", "--no-plots")
    assert "data" not in metrics(cli, "out")
    assert cli("analyze", cam, "--units", "s=mm").code == 2


def test_calibrate_writes_a_complete_spec_that_analyses_to_the_fitted_errors(cli, cam, rig):
    done = cli("calibrate", cam, rig, *FIT, "-o", "fit", "--no-plots")
    assert done.code == 5  # the mechanism as it was built misses what the design had to keep
    assert "fitted mechanism.rolling_friction = 0.00225" in " ".join(done.out.split())
    assert cli("analyze", "fit/calibrated.yaml", "--data", rig, "-o", "again", "--no-plots").code == 5
    one, two = metrics(cli, "fit"), metrics(cli, "again")
    assert one["metrics"]["data_rmse"]["value"] == pytest.approx(two["metrics"]["data_rmse"]["value"], rel=1e-9)
    friction, rest = one["parameters"]
    assert (friction["path"], friction["unit"], rest["unit"]) == ("mechanism.rolling_friction", "1", "mm")
    for found, truth in ((friction, 0.00225), (rest, 68.25)):
        assert found["value"] == pytest.approx(truth, abs=1.6 * (found["high_95"] - found["value"]))
        assert found["low_95"] < found["value"] < found["high_95"]
    assert np.array(one["correlation"]) == pytest.approx(np.array(one["correlation"]).T)
    names = {path.name for path in (cli.folder / "fit").iterdir()}
    assert {"calibrated.yaml", "parameters.csv", "residuals.csv", "data.csv", "metrics.json", "curve.csv"} <= names


def test_calibrate_draws_the_fit(cli, cam, rig):
    cli("calibrate", cam, rig, *FIT, "-o", "fit", "-q", "--report")
    assert "mechanism.rolling_friction" in (cli.folder / "fit" / "report.html").read_text(encoding="utf-8")
    assert (cli.folder / "fit/figures/data.png").read_bytes().startswith(b"\x89PNG")


def test_a_tare_is_fitted_and_the_page_says_how_to_take_it_off(cli, cam, rig):
    head, *lines = (cli.folder / rig).read_text().splitlines()
    moved = [f"{s};{float(f) + 0.4:.4f}" for s, f in (line.split(";") for line in lines)]
    (cli.folder / "tare.csv").write_text("\n".join([head, *moved]) + "\n")
    warned = cli("calibrate", cam, "tare.csv", *FIT, "-o", "one", "--no-plots")
    assert "lack_of_fit" in warned.out
    fitted = cli("calibrate", cam, "tare.csv", "--fit", f"{FIT[1]},data.force_offset", "--bounds",
                 "data.force_offset=-1 N:1 N", "-o", "two", "--no-plots")  # fmt: skip
    assert "lack_of_fit" not in fitted.out
    offset = metrics(cli, "two")["parameters"][2]
    assert (offset["path"], offset["unit"]) == ("data.force_offset", "N")
    assert offset["value"] == pytest.approx(0.4, abs=0.02)
    assert 'data --tare "0.' in " ".join(fitted.out.split())
    again = cli("analyze", "two/calibrated.yaml", "--data", "tare.csv", "--tare", f"{offset['value']} N", "-o", "three",
                "--no-plots", "--json")  # fmt: skip
    value = again.document["metrics"]["data_rmse"]["value"]
    assert value == pytest.approx(metrics(cli, "two")["metrics"]["data_rmse"]["value"], rel=1e-9)


@pytest.mark.parametrize(("sign", "options"), [(1.0, ("--tare", "1 N")), (-1.0, ("--tare", "1 N", "--flip", "force"))])
def test_the_tare_on_the_page_replaces_the_one_that_was_given(cli, cam, rig, sign, options):
    """The sensor shows 1.4 N without load, 1 N of which was known, and its sign may be turned."""
    head, *lines = (cli.folder / rig).read_text().splitlines()
    moved = [f"{s};{sign * float(f) + 1.4:.4f}" for s, f in (line.split(";") for line in lines)]
    (cli.folder / "tare.csv").write_text("\n".join([head, *moved]) + "\n")
    fitted = cli("calibrate", cam, "tare.csv", "--fit", f"{FIT[1]},data.force_offset,data.drift", *options, "-o", "fit",
                 "--no-plots")  # fmt: skip
    page = " ".join(fitted.out.split())
    tare, rest = re.search(r'data --tare "(\S+) N"( --flip force)? gives the recording the zeros', page).groups()
    assert float(tare) == pytest.approx(1.4, abs=0.05)
    assert (rest is not None) == (sign < 0)
    assert "no option subtracts the fitted drift" in page


@pytest.mark.parametrize(
    ("arguments", "code", "complaint"),
    [
        (("--fit", "mechanism.springs.stiffnes"), 2, "did you mean 'mechanism.springs.stiffness'"),
        (("--fit", "mechanism.rolling_friction", "--loss", "least"), 2, "--loss: there is no 'least'"),
        (("--fit", "mechanism.rolling_friction", "--bounds", "x"), 2, "--bounds: 'x' is not 'a.b=low:high'"),
        (("--fit", "mechanism.plate.top_margin"), 4, "does not determine mechanism.plate.top_margin"),
        (
            ("--fit", "mechanism.springs.stiffness,mechanism.profile.force_constant",
             "--set", "mechanism.rolling_friction=0"),
            4, "cannot distinguish mechanism.springs.stiffness and mechanism.profile.force_constant",
        ),
        (("--fit", "mechanism.rolling_friction", "--units", "F=kN"), 3, "the header gives 'F' in N, --units in kN"),
    ],
)  # fmt: skip
def test_what_cannot_be_fitted_is_said_in_one_line_and_nothing_is_written(cli, cam, rig, arguments, code, complaint):
    done = cli("calibrate", cam, rig, *arguments, "-o", "out", "--no-plots")
    assert done.code == code
    assert complaint in done.err
    assert done.err.count("\n") == 1
    assert not (cli.folder / "out").exists()


def test_json_holds_the_parameters(cli, cam, rig):
    done = cli("calibrate", cam, rig, *FIT, "-o", "fit", "--no-plots", "--json")
    assert [item["path"] for item in done.document["parameters"]] == FIT[1].split(",")


def test_specimen_and_cycles_are_chosen_as_for_measure_and_a_hole_ends_with_6(cli, cam, rig):
    head, *lines = (cli.folder / rig).read_text().splitlines()
    both = [f"{name};{line}" for name in "AB" for line in lines]
    (cli.folder / "both.csv").write_text("\n".join([f"Part;{head}", *both]) + "\n")
    for verb in (("analyze", cam, "--data", "both.csv"), ("calibrate", cam, "both.csv", *FIT)):
        refused = cli(*verb, "-o", "out", "--no-plots")
        assert refused.code == 3
        assert '--group "Part=A" or --group "Part=B"' in refused.err
        assert cli(*verb, "--cycles", "2", "--group", "Part=B", "-o", "out", "--no-plots").code == 3
        assert cli(*verb, "--cycles", "1", "--group", "Part=B", "-o", "out", "--no-plots").code in (0, 5)
    kept = [line for line in lines if not 80 < float(line.split(";")[0]) < 140]
    (cli.folder / "hole.csv").write_text("\n".join([head, *kept]) + "\n")
    done = cli("analyze", cam, "--data", "hole.csv", "-o", "hole")
    assert done.code == 6
    document = metrics(cli, "hole")
    assert document["metrics"]["data_rmse"]["branches"]["load"]["value"] is None
    assert "not recorded: 80" in document["message"]
    assert "holes" in [item["name"] for item in document["warnings"]]
