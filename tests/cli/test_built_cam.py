"""A cam with measured flanks as a user runs it."""

from __future__ import annotations

import json

import pytest
from flanks import Errors, measured


@pytest.fixture
def built(cli, cam):
    """The published cam with measured points beside its spec."""
    text = (cli.folder / cam).read_text()
    text = text.replace("stroke: 240 mm}", "stroke: 240 mm, file: points.csv, noise: 0.002 mm}", 1)
    (cli.folder / "built.yaml").write_text(text.replace("window: [2 mm, 100 %]", "window: [40 mm, 120 mm]"))
    points = measured(Errors(waviness=0.01e-3, noise=0.002e-3))
    rows = [
        f"{side};{x:.6f};{y:.6f}" for side, item in zip(("right", "left"), points, strict=True) for x, y in item * 1e3
    ]
    (cli.folder / "points.csv").write_text("side;x [mm];y [mm]\n" + "\n".join(rows) + "\n")
    return "built.yaml"


def test_analyze_writes_errors_forces_and_figures_and_takes_its_own_resolved_spec(cli, built):
    done = cli("analyze", built, "-o", "out", "--set", "requirements=[]")
    assert (done.code, done.err) == (0, "")
    names = {path.name for path in (cli.folder / "out/figures").iterdir()}
    assert names == {"loop.png", "profile.png", "shares.png"}
    found = json.loads((cli.folder / "out/metrics.json").read_text())
    assert found["metrics"]["profile_sd"]["unit"] == "mm"
    assert found["metrics"]["profile_sd"]["value"] == pytest.approx(0.0074, abs=0.0004)
    assert "added_by_profile [N]" in (cli.folder / "out/curve.csv").read_text().partition("\n")[0]
    again = cli("analyze", "out/resolved.yaml", "-o", "again", "--no-plots")
    assert again.code == 0
    assert (cli.folder / "out/curve.csv").read_bytes() == (cli.folder / "again/curve.csv").read_bytes()


def test_a_file_that_is_not_there_is_told_with_its_place(cli, built):
    (cli.folder / "points.csv").unlink()
    done = cli("check", built)
    assert done.code == 3
    assert "built.yaml:" in done.err
    assert "there is no file 'points.csv' in the folder of the specification" in done.err
