"""`cfmkit suggest`: three wishes in the quick tests, all fifty in the slow ones."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import cfmkit
from cfmkit.cli.main import main

WISHES = Path(__file__).parents[1] / "wishes"
FEASIBLE = sorted(path.stem for path in (WISHES / "sources").glob("*.yaml"))
UNREACHABLE = sorted(path.stem for path in WISHES.glob("unreachable-*.yaml"))
CONTRADICTIONS = sorted(path.stem for path in WISHES.glob("contradiction-*.yaml"))


def suggested(name, out, *options):
    """Return the exit code of a wish, and the numbers of its proposals."""
    code = main(["suggest", str(WISHES / f"{name}.yaml"), "-o", str(out), "-q", "--no-plots", *options])
    file = out / "metrics.json"
    return code, json.loads(file.read_text()) if file.exists() else None


def check_proposals(found, out):
    """Check that every proposal meets its requirements when it is analysed from its file."""
    assert found["proposals"]
    for one in found["proposals"]:
        result = cfmkit.analyze(out / one["folder"] / "design.yaml")
        assert result.status.key == "complete"
        assert all(outcome.ok for outcome in cfmkit.check(result)), one["folder"]


def test_a_cam_is_suggested_for_a_long_stroke_with_some_loss(tmp_path):
    code, found = suggested("cam-published", tmp_path / "out", "-j", "1")
    assert code == 0
    assert {one["family"] for one in found["proposals"]} == {"cam"}
    check_proposals(found, tmp_path / "out")
    header = (tmp_path / "out" / "suggestions.csv").read_text().splitlines()[0]
    assert header.startswith("number,family,variant,force_mean [N],ripple [1]")


def test_a_wish_beyond_everybody_ends_with_4_and_a_reason_from_each_family(tmp_path):
    """A thousand times the torque that a coin cannot give: nobody begins a design."""
    code, found = suggested("unreachable-torque-of-a-coin", tmp_path / "out", "-j", "1", "--torque", "500 N*m")
    assert (code, found["proposals"]) == (4, [])
    assert len(found["families"]) >= 4
    assert all(one["reason"] for one in found["families"])


@pytest.mark.slow  # the nearest wishes are designed and analysed: some 50 s of processor time
def test_a_wish_beyond_everybody_ends_with_4_and_the_nearest_one(tmp_path):
    code, found = suggested("unreachable-rubber", tmp_path / "out", "-j", "1", "--time-budget", "600s")
    assert code == 4
    assert found["proposals"] == []
    assert all(one["reason"] for one in found["families"])
    assert any(one["nearest"] for one in found["families"])


def test_a_contradiction_ends_with_3_and_writes_nothing(tmp_path, capsys):
    code, found = suggested("contradiction-travel-beyond-room", tmp_path / "out")
    assert (code, found) == (3, None)
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_a_finished_search_is_reused_by_content(tmp_path):
    suggested("cam-small", tmp_path / "out", "-j", "1")
    first = (tmp_path / "out" / "suggestions.csv").read_bytes()
    suggested("cam-small", tmp_path / "out", "-j", "1")
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["run"]["reused"] > 0 if "run" in manifest else manifest["reused"] > 0
    assert (tmp_path / "out" / "suggestions.csv").read_bytes() == first


@pytest.mark.slow
@pytest.mark.parametrize("name", FEASIBLE)
def test_no_proposal_of_a_feasible_wish_misses_it(name, tmp_path):
    code, found = suggested(name, tmp_path / "out", "--time-budget", "600s")
    assert code == 0
    check_proposals(found, tmp_path / "out")


@pytest.mark.slow
@pytest.mark.parametrize("name", UNREACHABLE)
def test_no_wish_beyond_reach_gets_a_proposal(name, tmp_path):
    code, found = suggested(name, tmp_path / "out", "--time-budget", "600s")
    assert (code, found["proposals"]) == (4, [])


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_every_contradiction_is_refused(name, tmp_path):
    assert suggested(name, tmp_path / "out") == (3, None)
