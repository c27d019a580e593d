"""`cfmkit suggest`: three requests in the quick tests, some more in the slow ones, all fifty in the long ones."""

from __future__ import annotations

import io
import json
import shlex
from contextlib import redirect_stdout
from pathlib import Path

import pytest
from suggest_support import request_of, small_block

import cfmkit
from cfmkit.cli.main import main
from cfmkit.cli.verbs.suggest import keys, make_options, seconds
from cfmkit.errors import UsageError

REQUESTS = Path(__file__).parents[1] / "requests"
FEASIBLE = sorted(path.stem for path in (REQUESTS / "sources").glob("*.yaml"))
UNREACHABLE = sorted(path.stem for path in REQUESTS.glob("unreachable-*.yaml"))
SLOW = "cam-six-springs", "unreachable-torque-of-a-coin"
CONTRADICTIONS = sorted(path.stem for path in REQUESTS.glob("contradiction-*.yaml"))


def marked(names):
    """Return requests as parameters; a search whose proposals are judged as solids takes minutes."""
    return [pytest.param(name, marks=pytest.mark.slow if name in SLOW else pytest.mark.long) for name in names]


def suggested(name, out, *options):
    """Return the exit code of a request, and the numbers of its proposals."""
    code = main(["suggest", str(REQUESTS / f"{name}.yaml"), "-o", str(out), "-q", "--no-plots", *options])
    file = out / "metrics.json"
    return code, json.loads(file.read_text()) if file.exists() else None


def check_proposals(found, out):
    """Check that every proposal meets its requirements when it is analysed from its file."""
    assert found["proposals"]
    for one in found["proposals"]:
        result = cfmkit.analyze(out / one["folder"] / "design.yaml")
        assert result.status.key == "complete"
        assert all(outcome.ok for outcome in result.requirements), one["folder"]


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    """Return the folder of a search for the published cam, and what it printed."""
    out, page = tmp_path_factory.mktemp("a request's") / "out", io.StringIO()
    with redirect_stdout(page):
        code = main(["suggest", str(REQUESTS / "cam-published.yaml"), "-o", str(out), "-j", "1", "--no-plots"])
    assert code == 0
    return out, page.getvalue()


@pytest.mark.slow
def test_a_cam_is_suggested_for_a_long_stroke_with_some_loss(published):
    out, _ = published
    found = json.loads((out / "metrics.json").read_text())
    assert {one["family"] for one in found["proposals"]} == {"cam"}
    check_proposals(found, out)
    header = (out / "suggestions.csv").read_text().splitlines()[0]
    assert header.startswith("number,family,variant,force_mean [N],ripple [1]")


@pytest.mark.slow
def test_the_next_line_is_a_command_that_writes_files_to_cut(published, tmp_path):
    out, page = published
    last = page.splitlines()[-1]  # one line, longer than the page is wide
    assert len(last) > max(map(len, page.splitlines()[:2]))
    label, program, verb, *words = shlex.split(last)
    assert (label, program, verb) == ("next", "cfmkit", "export")
    best = json.loads((out / "metrics.json").read_text())["proposals"][0]
    assert words == [str(out / best["folder"] / "design.yaml")]
    assert (out / best["folder"] / "geometry").is_dir()
    assert main([verb, *words, "--format", "dxf,png", "-o", str(tmp_path / "cut")]) == 0
    assert (tmp_path / "cut" / "figures" / "drawing.png").read_bytes().startswith(b"\x89PNG")
    assert list((tmp_path / "cut").glob("*.dxf"))


def test_a_request_beyond_everybody_ends_with_4_and_a_reason_from_each_family(tmp_path):
    """A thousand times the torque that a coin cannot give: nobody begins a design."""
    code, found = suggested("unreachable-torque-of-a-coin", tmp_path / "out", "-j", "1", "--torque", "500 N*m")
    assert (code, found["proposals"]) == (4, [])
    assert len(found["families"]) >= 4
    assert all(one["reason"] for one in found["families"])


@pytest.mark.slow  # the nearest requests are designed and analysed: some 50 s of processor time
def test_a_request_beyond_everybody_ends_with_4_and_the_nearest_one(tmp_path):
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


@pytest.mark.parametrize("name", marked(FEASIBLE))
def test_no_proposal_of_a_feasible_request_misses_it(name, tmp_path):
    """By beams all are in reach; not all pass as solids, and links of soft materials bend under their springs."""
    code, found = suggested(name, tmp_path / "out", "--time-budget", "600s")
    assert code == (0 if found["proposals"] else 6 if found["unjudged"] else 4)
    assert found["proposals"] or found["unjudged"] or found["near_misses"]
    if found["proposals"]:
        check_proposals(found, tmp_path / "out")


@pytest.mark.parametrize("name", marked(UNREACHABLE))
def test_no_request_beyond_reach_gets_a_proposal(name, tmp_path):
    code, found = suggested(name, tmp_path / "out", "--time-budget", "600s")
    assert (code, found["proposals"]) == (4, [])


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_every_contradiction_is_refused(name, tmp_path):
    assert suggested(name, tmp_path / "out") == (3, None)


def test_a_material_named_again_is_one_more_and_replaces_none():
    assert keys(make_options()(material=["pom", "pla,abs"])) == {"material": "[pom,pla,abs]"}
    assert keys(make_options()(force="19N, 21 N")) == {"force": "[19N, 21 N]"}
    assert keys(make_options()(torque="[1 N*m, 2 N*m]", force="1,5 N")) == {
        "torque": "[1 N*m, 2 N*m]",
        "force": "1,5 N",
    }
    assert keys(make_options()(material=["[pom]"], prefer=[])) == {"material": "[pom]"}
    assert keys(make_options()(material=["[pom, pla]", "abs"])) == {"material": "[pom, pla,abs]"}


def test_a_room_and_a_time_may_be_written_short():

    def write_envelope(text):
        return keys(make_options()(envelope=text))["envelope"]

    assert write_envelope("80x60x6mm") == "[80 mm, 60 mm, 6 mm]"
    assert write_envelope("8cm x 60 mm") == "[8 cm, 60 mm]"
    assert write_envelope("8e1x6E1mm") == "[8e1 mm, 6E1 mm]"
    with pytest.raises(UsageError, match="100x100x20 has no unit; write 100x100x20mm"):
        write_envelope("100x100x20")
    assert seconds("90s") == 90.0
    assert seconds("2 min") == 120.0
    with pytest.raises(UsageError):
        seconds("0s")


def test_every_key_of_a_request_is_an_option_and_reaches_families_under_its_name():
    block = type(small_block())
    assert set(block.options()) == set(block.model_fields)
    stated = {
        "force": "20 N", "travel": "10 mm", "ripple": "3 %", "envelope": "[100 mm, 90 mm, 20 mm]", "process": "laser",
        "adjustable": "[15 N, 25 N]", "hysteresis": "7 %", "springs": "custom", "safety": "1.7", "cycles": "12345",
        "overload": "60 N",
    }  # fmt: skip
    request = request_of(stated)
    assert (request.travel, request.ripple, request.envelope) == (0.01, 0.03, (0.1, 0.09, 0.02))
    assert (request.stated.process, request.adjustable, request.hysteresis) == ("laser", (15.0, 25.0), 0.07)
    assert (request.stated.springs, request.safety, request.stated.cycles, request.stated.overload) == (
        "custom",
        1.7,
        12345,
        60.0,
    )
