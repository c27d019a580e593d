"""The explorer without a browser: sliders for every number, answers, what is saved, and who is answered."""

import http.client
import json
import re
import socket
import threading
import time
import urllib.error
import urllib.request
from contextlib import suppress
from pathlib import Path

import pytest

import cfmkit
from cfmkit.cli import run_command
from cfmkit.errors import OutputError, UsageError
from cfmkit.runs import explorer_server
from cfmkit.runs.explorer import Explorer, suggested_name
from cfmkit.runs.explorer_server import ExplorerServer

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def explorer(tmp_path):
    (tmp_path / "cam.yaml").write_text((CONFIGS / "cam.yaml").read_text())
    return Explorer.from_file(str(tmp_path / "cam.yaml"))


@pytest.mark.parametrize("name", ["cam", "slider_crank_li2019", "vcfm_ding2022", "cam_six_springs"])
def test_every_number_has_a_slider_whose_ends_the_file_takes(name):
    explorer = Explorer.from_file(str(CONFIGS / f"{name}.yaml"))
    sliders = explorer.sliders
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
    assert [one["ok"] for one in found["requirements"]] == [one.ok for one in result.requirements]
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
    with pytest.raises(OutputError, match=r"the file exists|in the way"):
        explorer.save("mine.yaml", ())
    with pytest.raises(OutputError, match=r"the file exists|in the way"):
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
    "data",
    [
        b"no json",
        {"changes": 3},
        {"changes": [3]},
        {},
        [1],
        b"[" * 100_000,
        b" " * 300_000,
        b'{"changes": ["\xff"]}',
        json.dumps({"changes": []}).encode("utf-16"),
        b'{"changes": ["\\ud800"]}',
        {"changes": [], "name": 3},
        b'{"changes": [' + b"9" * 5000 + b"]}",
    ],
)
def test_a_malformed_request_is_refused_and_the_next_one_answered(served, data):
    token = {"X-Token": served.token}
    assert asked(served, data=data, **token)[0] == 400
    assert asked(served, data={"changes": []}, **token)[0] == 200


def broken(*_):
    raise KeyError("analysis.window")


def test_a_bug_is_one_line_for_the_page(served, monkeypatch):
    monkeypatch.setattr(served.explorer.__class__, "answer", broken)
    monkeypatch.setattr(served, "failed", lambda _error: None)
    status, found = asked(served, data={"changes": []}, **{"X-Token": served.token})
    assert status == 500
    assert json.loads(found) == {"problem": ["a bug in cfmkit: KeyError: 'analysis.window'"]}


@pytest.mark.parametrize("options", [(), ("-vv",)])
def test_the_traceback_of_a_bug_is_not_lost(explorer, monkeypatch, capsys, options):
    def serve(server):
        try:
            broken()
        except KeyError as error:
            server.failed(error)

    monkeypatch.setattr("webbrowser.open", lambda _url: True)
    monkeypatch.setattr(ExplorerServer, "serve_forever", serve)
    run_command(["explore", explorer.source, *options])
    err = capsys.readouterr().err
    assert err.endswith("error    this is a bug in cfmkit: KeyError: 'analysis.window'; -vv shows where\n")
    assert ('raise KeyError("analysis.window")' in err) == bool(options)


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
    page = Explorer.from_file(str(tmp_path / "cam.yaml")).page("token").decode()
    assert "<img" not in page
    assert page.count("</script>") == 2


def sent(server, *pieces, close=False):
    """Return all that the server sends back for bytes as they are; None if it closes the connection without a word."""
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=20) as connection:
        for piece in pieces:
            connection.sendall(piece)
        if close:
            connection.shutdown(socket.SHUT_WR)
        found = b""
        while more := connection.recv(65536):
            found += more
        return found or None


def head(server, *lines, request="POST /answer HTTP/1.1"):
    """Return the head of a request that is in order but for some lines."""
    usual = [f"Host: 127.0.0.1:{server.server_port}", f"X-Token: {server.token}"]
    return "\r\n".join([request, *usual, *lines, "", ""]).encode()


BODY = b'{"changes": []}'


@pytest.mark.parametrize(
    "target",
    [
        "http://[",
        "//[",
        "[",
        "*",
        "/%",
        "/%ff%",
        "/?token=%ff%zz",
        "/?token=\xff",
        "/?" + "a&" * 20_000,
        "http://x/",
        "?",
    ],
)
def test_a_strange_address_is_refused_in_silence(served, capsys, target):
    for method in ("GET", "POST"):
        found = sent(served, f"{method} {target} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode("latin-1"))
        assert re.match(rb"HTTP/1.0 4\d\d ", found)
        found = sent(served, head(served, f"Content-Length: {len(BODY)}", request=f"{method} {target} HTTP/1.1"), BODY)
        assert re.match(rb"HTTP/1.0 4\d\d ", found)
    assert capsys.readouterr().err == ""
    assert asked(served, data={"changes": []}, **{"X-Token": served.token})[0] == 200


@pytest.mark.parametrize(
    "lines",
    [
        [f"Content-Length: {len(BODY) + 1}"],
        ["Content-Length: -1"],
        [f"Content-Length: +{len(BODY)}"],
        ["Content-Length: 1_5"],
        ["Content-Length: "],
        ["Content-Length: 99999999999999999999"],
        [],
        [f"Content-Length: {len(BODY)}", "Content-Length: 3"],
        [f"Content-Length: {len(BODY)}", "Transfer-Encoding: chunked"],
        ["Transfer-Encoding: chunked"],
    ],
)
def test_a_body_of_another_length_than_it_says_is_refused(served, lines):
    assert sent(served, head(served, *lines), BODY, close=True).startswith(b"HTTP/1.0 400 ")


@pytest.mark.parametrize(
    "line",
    [
        "Origin: http://evil.example",
        "Origin: null",
        "Origin: http://127.0.0.1:1",
        "Host: evil.example",
        "Host: localhost",
    ],
)
def test_another_page_or_a_second_host_is_refused(served, line):
    found = sent(served, head(served, line, f"Content-Length: {len(BODY)}"), BODY)
    assert found.startswith(b"HTTP/1.0 403 ")


def test_the_page_itself_is_known_by_its_origin(served):
    for name in ("127.0.0.1", "localhost"):
        headers = {"X-Token": served.token, "Origin": f"http://{name}:{served.server_port}"}
        assert asked(served, data={"changes": []}, **headers)[0] == 200


@pytest.mark.parametrize("method", ["HEAD", "OPTIONS", "TRACE", "PUT", "DELETE", "CONNECT", "<script>"])
def test_other_methods_are_refused_and_nothing_is_echoed(served, method):
    found = sent(served, head(served, request=f"{method} /?token={served.token} HTTP/1.1"))
    assert found.startswith(b"HTTP/1.0 405 ")
    assert b"Allow: GET, POST\r\n" in found
    assert b"Access-Control" not in found
    assert served.token.encode() not in found
    assert b"<script>" not in found.partition(b"\r\n\r\n")[2]
    assert (found.partition(b"\r\n\r\n")[2] == b"") == (method == "HEAD")


@pytest.mark.parametrize(
    "request_bytes",
    [
        b"\x16\x03\x01\x02\x00\x01\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 200 + b"\r\n",
        b"GET /" + b"a" * 70_000 + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nX: " + b"a" * 70_000 + b"\r\n\r\n",
        b"\r\n",
        b"",
    ],
)
def test_what_is_no_request_is_refused_in_silence(served, capsys, request_bytes):
    found = sent(served, request_bytes, close=True)
    assert found is None or re.search(rb"HTTP/1.0 [45]\d\d |not a request", found)
    assert capsys.readouterr().err == ""
    assert asked(served, data={"changes": []}, **{"X-Token": served.token})[0] == 200


def test_a_second_request_in_the_body_of_the_first_is_not_answered(served):
    second = head(served, request=f"GET /?token={served.token} HTTP/1.1")
    found = sent(served, head(served, "Connection: keep-alive", f"Content-Length: {len(BODY)}"), BODY + second)
    assert found is None or found.count(b"HTTP/1.0 ") == 1


def test_connections_that_say_nothing_do_not_keep_others_waiting(served):
    silent = [socket.create_connection(("127.0.0.1", served.server_port), timeout=20) for _ in range(100)]
    try:
        assert asked(served, data={"changes": []}, **{"X-Token": served.token})[0] == 200
        end = time.monotonic() + 10
        while threading.active_count() > explorer_server.MAX_CONNECTIONS + 5 and time.monotonic() < end:
            time.sleep(0.01)
        assert threading.active_count() <= explorer_server.MAX_CONNECTIONS + 5
    finally:
        for one in silent:
            one.close()


@pytest.mark.parametrize("start", [b"", b"POST /answer HTTP/1.1\r\n", None])
def test_a_request_that_comes_in_drops_is_ended_in_time(served, monkeypatch, start):
    """However often a further byte arrives, in the head and in the body."""
    monkeypatch.setattr(explorer_server, "MAX_READ_SECONDS", 0.4)
    began = time.monotonic()
    with socket.create_connection(("127.0.0.1", served.server_port), timeout=20) as connection:
        connection.sendall(head(served, "Content-Length: 9999") if start is None else start)
        with suppress(OSError):  # the connection was closed
            while time.monotonic() < began + 10:
                connection.sendall(b"a")
                time.sleep(0.05)
    assert time.monotonic() < began + 5


def test_the_page_runs_no_script_and_no_style_but_its_own(served):
    policies = []
    for _ in range(2):
        found = sent(served, head(served, request=f"GET /?token={served.token} HTTP/1.1"))
        policy = re.search(rb"Content-Security-Policy: (.*)\r\n", found)[1].decode()
        nonce = re.search(r"script-src 'nonce-([\w-]{20,})'", policy)[1]
        assert "unsafe" not in policy
        assert f"style-src 'nonce-{nonce}'" in policy
        markup = found.partition(b"\r\n\r\n")[2].decode()
        assert markup.count(f'nonce="{nonce}"') == 2
        assert not re.search(r"<[^>]* (style|on\w+)=", markup.partition("<script")[0])
        policies.append(policy)
    assert policies[0] != policies[1]


def test_the_token_is_not_on_the_command_line_of_the_browser(explorer, monkeypatch):
    """Every user of the computer can read that; what leads to the page is a file of this user alone."""
    opened = []

    def browse(url):
        path = Path(url.removeprefix("file://"))
        opened.append((url, path, path.stat().st_mode & 0o777, path.read_text()))

    monkeypatch.setattr("webbrowser.open", browse)
    monkeypatch.setattr(ExplorerServer, "serve_forever", lambda self: opened.append(self.token))
    assert run_command(["explore", explorer.source]) == 0
    (url, path, mode, text), token = opened
    assert mode == 0o600
    assert token not in url
    assert f"/?token={token}" in text
    assert not path.exists()


def test_the_file_that_leads_to_the_page_is_removed_when_the_page_is_open(served):
    path = served.write_redirect()
    assert asked(served, "/?token=wrong")[0] == 403
    assert path.exists()
    assert asked(served, f"/?token={served.token}")[0] == 200
    end = time.monotonic() + 5
    while path.exists() and time.monotonic() < end:
        time.sleep(0.01)
    assert not path.exists()


def test_an_explorer_without_room_for_that_file_still_says_its_address(explorer, monkeypatch, capsys):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tempfile.mkstemp", full)
    monkeypatch.setattr("webbrowser.open", lambda _url: pytest.fail("opened"))
    monkeypatch.setattr(ExplorerServer, "serve_forever", lambda self: None)
    assert run_command(["explore", explorer.source]) == 0
    found = capsys.readouterr()
    assert "?token=" in found.out
    assert found.err == "warning  no browser is opened (the disk is full): open the address above\n"
