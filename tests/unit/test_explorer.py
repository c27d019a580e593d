"""The explorer without a browser: sliders for every number, answers, what is saved, and who is answered."""

import http.client
import json
import threading
import urllib.error
import urllib.request
from pathlib import Path

import pytest

import cfmkit
from cfmkit.cli.failures import told
from cfmkit.cli.output import Terminal
from cfmkit.errors import OutputError, UsageError
from cfmkit.runs.explorer_server import Explorer, ExplorerServer, suggested_name

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def explorer(tmp_path):
    (tmp_path / "cam.yaml").write_text((CONFIGS / "cam.yaml").read_text())
    return Explorer.of(str(tmp_path / "cam.yaml"))


@pytest.mark.parametrize("name", ["cam", "slider_crank_li2019", "vcfm_ding2022", "cam_six_springs"])
def test_every_number_has_a_slider_whose_ends_the_file_takes(name):
    explorer = Explorer.of(str(CONFIGS / f"{name}.yaml"))
    sliders = explorer.sliders()
    assert len({slider.path for slider in sliders}) == len(sliders) > 10
    document = explorer.document
    for slider in sliders:
        assert slider.low <= slider.value <= slider.high
        assert slider.high > slider.low
        assert slider.step > 0
        written = f"{slider.path}={slider.value:.15g} {slider.unit}"
        assert document.set(written).problems == ()
    same = explorer.spec([f"{slider.path}={slider.value:.15g} {slider.unit}" for slider in sliders])
    assert same.mechanism == explorer.spec().mechanism


def test_an_answer_is_what_analyze_says(explorer):
    changes = ["mechanism.springs.stiffness=0.8 N/mm"]
    found = explorer.answer(changes)
    result = cfmkit.analyze(explorer.spec(changes))
    assert list(found["curve"]["branches"]) == list(dict.fromkeys(result.curve.branches))
    assert found["curve"]["x"] == "displacement [mm]"
    assert [one["ok"] for one in found["requirements"]] == [one.ok for one in cfmkit.check(result)]
    last = found["curve"]["branches"]["load"][1][-1]
    assert last == pytest.approx(result.curve.effort[result.curve.branch == "load"][-1], rel=1e-4)
    assert found["curve"] != explorer.answer(())["curve"]
    assert json.dumps(found, allow_nan=False)


def test_a_value_that_is_not_allowed_is_an_answer_with_its_reason(explorer):
    (reported,) = explorer.answer(["mechanism.springs.stiffness=-1 N/mm"])["problem"]
    assert "stiffness" in reported
    assert "problem" in explorer.answer(["mechanism.nothing=1"])


@pytest.mark.parametrize(
    "name", ["../a.yaml", "/tmp/a.yaml", "a/b.yaml", ".a.yaml", "a.txt", "", "a.yaml\n", "a\0.yaml"]
)
def test_nothing_is_saved_but_a_plain_file_beside_the_spec(explorer, name):
    with pytest.raises(UsageError, match="name a file"):
        explorer.save(name, ())


@pytest.mark.parametrize("stem", ["cam", "träger (2)", "a<img src=x>&\"q' ", "-", "x" * 200])
def test_the_name_that_the_page_offers_can_be_saved(explorer, stem):
    name = suggested_name(stem)
    assert explorer.save(name, ()) == {"saved": name}


def test_what_is_saved_can_be_analysed_and_replaces_nothing(explorer):
    assert explorer.save("mine.yaml", ["mechanism.springs.stiffness=0.8 N/mm"]) == {"saved": "mine.yaml"}
    saved = cfmkit.load(explorer.folder / "mine.yaml")
    assert saved.mechanism.springs.stiffness == pytest.approx(800.0)
    with pytest.raises(OutputError, match="in the way"):
        explorer.save("mine.yaml", ())
    with pytest.raises(OutputError, match="in the way"):
        explorer.save("cam.yaml", ())


@pytest.fixture
def served(explorer):
    server = ExplorerServer(explorer)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    yield server
    server.shutdown()
    server.server_close()
    thread.join()


def asked(server, path="/answer", data=None, **headers):
    """Return (status, content) of a request."""
    body = None if data is None else data if isinstance(data, bytes) else json.dumps(data).encode()
    request = urllib.request.Request(f"http://127.0.0.1:{server.server_port}{path}", body, headers)
    try:
        with urllib.request.urlopen(request, timeout=20) as found:
            return found.status, found.read()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read()


def test_only_this_computer_with_the_token_is_answered(served):
    assert served.server_address[0] == "127.0.0.1"
    token = {"X-Token": served.token}
    assert asked(served, "/")[0] == 403
    assert asked(served, "/?token=wrong")[0] == 403
    status, page = asked(served, f"/?token={served.token}")
    assert status == 200
    assert b"sanchez-salinas-2022" in page
    assert asked(served, f"/?token={served.token}", Host="evil.example")[0] == 403
    assert asked(served, f"/../../etc/passwd?token={served.token}")[0] == 404
    assert asked(served, data={"changes": []})[0] == 403
    assert asked(served, data={"changes": []}, **token, Host="evil.example")[0] == 403
    assert asked(served, data={"changes": []}, **token)[0] == 200
    assert asked(served, "/etc/passwd", data={"changes": []}, **token)[0] == 404


@pytest.mark.parametrize(
    "data", [b"no json", {"changes": 3}, {"changes": [3]}, {}, [1], b"[" * 100_000, b" " * 300_000]
)
def test_a_malformed_request_is_refused_and_the_next_one_answered(served, data):
    token = {"X-Token": served.token}
    assert asked(served, data=data, **token)[0] == 400
    assert asked(served, data={"changes": []}, **token)[0] == 200


@pytest.mark.parametrize("verbose", [0, 2])
def test_a_bug_is_one_line_for_the_page_and_its_traceback_is_not_lost(served, monkeypatch, capsys, verbose):
    def broken(*_):
        raise KeyError("analysis.window")

    terminal = Terminal(verbose=verbose)
    monkeypatch.setattr(served.explorer.__class__, "answer", broken)
    monkeypatch.setattr(served, "failed", lambda error: told(error, terminal))
    status, found = asked(served, data={"changes": []}, **{"X-Token": served.token})
    assert status == 500
    assert json.loads(found) == {"problem": ["a bug in cfmkit: KeyError: 'analysis.window'"]}
    err = capsys.readouterr().err
    assert err.endswith("error    this is a bug in cfmkit: KeyError: 'analysis.window'; -vv shows where\n")
    assert ('raise KeyError("analysis.window")' in err) == (verbose == 2)


def test_a_page_that_is_closed_before_its_answer_leaves_no_traceback(served, monkeypatch, capsys):
    def gone(*_):
        raise BrokenPipeError

    monkeypatch.setattr(served.RequestHandlerClass, "_send", gone)
    with pytest.raises(http.client.RemoteDisconnected):
        asked(served, "/")
    assert capsys.readouterr().err == ""


def test_no_name_of_a_spec_becomes_markup(tmp_path):
    hostile = '</script><img src=x onerror="alert(1)">'
    text = (CONFIGS / "cam.yaml").read_text().replace("name: sanchez-salinas-2022", f"name: '{hostile}'")
    (tmp_path / "cam.yaml").write_text(text)
    page = Explorer.of(str(tmp_path / "cam.yaml")).page("token").decode()
    assert "<img" not in page
    assert page.count("</script>") == 2
