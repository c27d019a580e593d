"""A specification whose numbers are moved by sliders, with everything computed again as they move.

`Explorer` holds the file as it was written and answers changes of it as data for a page. Changes are those of
``--set``: a page can say no more than a command line.

`ExplorerServer` puts it on a port of this computer: reachable from this computer only, and only with its token. The
server of the standard library does: one person asks, one answer at a time. What is checked on every request: the name
by which it was reached (a page elsewhere that lets its own name point here is refused), the page that sent it, the
token, the size. The number of connections is limited, and the time in which a request must have arrived.
"""

from __future__ import annotations

import hmac
import html
import json
import os
import re
import secrets
import socket
import sys
import tempfile
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs

import numpy as np

from cfmkit import api
from cfmkit.errors import CfmError, OutputError, UsageError, lines_of, visible
from cfmkit.runs.html_report_of_run import ENDS, escaped_json, part, template
from cfmkit.runs.specfile import bind, changed, read_spec
from cfmkit.specs.units.strict_decimal_number import NUMBER

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from cfmkit.curves import Curve
    from cfmkit.results import Result
    from cfmkit.specs.spec import Spec
    from cfmkit.specs.yamlio import Document


LEFT_OUT = ("cfmkit", "family", "name", "description", "design", "sweep", "sensitivity")
"""Blocks without sliders: what is analysed does not depend on them."""

MOST_POINTS = 600
"""Points of a branch that the page draws: more than there are pixels across its diagram."""

SPAN = 0.5
"""Share of a value by which its slider goes down and up: far enough to see a trend, near enough to stay a mechanism."""

PAIRS = {name: ("x", "y") for name in ("at", "mirror")} | {
    name: ("from", "to") for name in ("window", "over", "travel")
}
"""What the two numbers of a list are called."""

OWN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._ -]{0,80}\.ya?ml")
"""Names of files that the page may save: no folder, nothing hidden."""


@dataclass(frozen=True)
class Slider:
    """A number of the specification that can be moved.

    Attributes
    ----------
    path : str
        Dotted, as ``--set`` takes it.
    value, low, high, step : float
        In its unit.
    unit : str
        As the file has it; empty for a plain number.
    about : str
        What it is.
    whole : bool
        Whether it is a whole number.
    """

    path: str
    value: float
    low: float
    high: float
    step: float
    unit: str
    about: str
    whole: bool

    @property
    def label(self) -> str:
        """What stands beside it: the key, or what a number of a list is."""
        *_, group, key = ("", *self.path.split("."))
        if not key.isdecimal():
            return key.replace("_", " ")
        pair = PAIRS.get(group, ())
        return pair[int(key)] if int(key) < len(pair) else f"number {int(key) + 1}"


@dataclass
class Explorer:
    """A specification to be explored.

    Attributes
    ----------
    source : str
        The file.
    document : Document
        What it says.
    folder : Path
        That of the file; what the page saves is written there, and nowhere else.
    """

    source: str
    document: Document
    folder: Path = field(init=False)

    def __post_init__(self) -> None:
        """Note the folder beside which nothing is read or written."""
        self.folder = Path(self.source).absolute().parent

    @classmethod
    def of(cls, source: str, changes: tuple[str, ...] = ()) -> Explorer:
        """Return the explorer of a file.

        Raises
        ------
        cfmkit.errors.UsageError
            If it cannot be read.
        cfmkit.errors.SpecError
            With every problem in it.
        """
        document = read_spec(source, changes)
        bind(document)
        return cls(source, document)

    def spec(self, changes: Sequence[str] = ()) -> Spec:
        """Return the specification with changes."""
        return bind(changed(self.document, changes))

    def sliders(self) -> tuple[Slider, ...]:
        """Return a slider for every number of the specification, those that it leaves to their defaults included."""
        from cfmkit.specs.keys_and_schema import keys
        from cfmkit.specs.yamlio import read_document

        spec = self.spec()
        known = {key.path: key for key in keys(type(spec))}
        tree = read_document(api.dumps(spec, complete=True), "spec").tree
        found = []
        for path, value in _leaves({key: tree[key] for key in tree if key not in LEFT_OUT}):
            key = known.get(re.sub(r"\.\d+", "[]", path)) or known.get(re.sub(r"\.\d+$", "", path))
            about, whole = (key.description, key.kind == "whole number") if key else ("", False)
            if (slider := _slider(path, value, about, whole)) is not None:
                found.append(slider)
        return tuple(found)

    def answer(self, changes: Sequence[str]) -> dict[str, Any]:
        """Return what a page shows of the changed specification: curve, metrics, requirements, or what is wrong."""
        start = time.perf_counter()
        try:
            result = api.analyze(self.spec(changes))
            found = _shown(result)
        except CfmError as error:
            found = {"problem": [line.removeprefix("error    ") for line in lines_of(error)]}
        return found | {"seconds": time.perf_counter() - start}

    def drawing(self, changes: Sequence[str]) -> dict[str, Any]:
        """Return the mechanism in the middle of its travel as SVG; empty where its family draws none."""
        from cfmkit.families import family
        from cfmkit.plots.figures import moving_of
        from cfmkit.plots.poses_in_one_svg import still

        try:
            result = api.analyze(self.spec(changes))
            moving = moving_of(family(result.spec.family), result)
        except CfmError:
            moving = None
        drawn = "" if moving is None else still(moving, len(moving.motion) // 2, "the mechanism to scale, half way")
        return {"svg": drawn}

    def yaml(self, changes: Sequence[str]) -> str:
        """Return the specification with changes as YAML."""
        return api.dumps(self.spec(changes))

    def save(self, name: str, changes: Sequence[str]) -> dict[str, Any]:
        """Write the specification with changes beside its file; nothing is replaced.

        Raises
        ------
        cfmkit.errors.UsageError
            If it is not the plain name of a YAML file.
        cfmkit.errors.OutputError
            If there is such a file, or it cannot be written.
        """
        from cfmkit.store.safe_disk_changes import reporting, write_new

        if not OWN_NAME.fullmatch(name):
            raise UsageError(f"{visible(name)!r}: name a file such as mine.yaml, without a folder")
        target = self.folder / name
        if target.exists() or target.is_symlink():
            raise OutputError(f"cannot write {visible(name)}: a file of that name is in the way")
        with reporting(name):
            write_new(target, self.yaml(changes).encode())
        return {"saved": name}

    def page(self, token: str, nonce: str = "") -> bytes:
        """Return the page; its script reports with a token who it is, and runs only with the nonce of this answer."""
        spec = self.spec()
        groups: dict[str, list[Slider]] = {}
        for slider in self.sliders():
            groups.setdefault(slider.path.rpartition(".")[0], []).append(slider)
        data = {"token": token, "source": self.source, "first": self.answer(())}
        text: str = template("explorer.html.j2").render(
            title=spec.name,
            family=spec.family,
            groups={name: (_legend(name, spec), sliders) for name, sliders in groups.items()},
            data=escaped_json(data),
            nonce=nonce,
            style=part("report.css") + part("explorer.css"),
            script=part("explorer.js"),
            suggestion=suggested_name(Path(self.source).stem),
        )
        return text.encode()


def suggested_name(stem: str) -> str:
    """Return the name under which the page offers to save: that of the file, as far as `OWN_NAME` has such letters.

    Examples
    --------
    >>> suggested_name("cam 2"), suggested_name("träger<b>"), suggested_name(".-")
    ('cam 2-explored.yaml', 'tr-ger-b-explored.yaml', 'explored.yaml')
    """
    plain = re.sub(r"[^A-Za-z0-9._ -]+", "-", stem).strip("._ -")[:60].rstrip("._ -")
    return f"{plain}-explored.yaml" if plain else "explored.yaml"


def _legend(group: str, spec: Spec) -> str:
    """Return what stands above a group of sliders: its path; of a requirement, also which metric it is about."""
    match = re.match(r"requirements\.(\d+)", group)
    return f"{group}: {spec.requirements[int(match[1])].metric}" if match else group


def _leaves(tree: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(tree, dict):
        for key, value in tree.items():
            if "." not in key:
                yield from _leaves(value, f"{path}.{key}" if path else key)
    elif isinstance(tree, tuple | list):
        for number, value in enumerate(tree):
            yield from _leaves(value, f"{path}.{number}")
    else:
        yield path, tree


def _slider(path: str, value: Any, about: str, whole: bool) -> Slider | None:
    """Return the slider of a leaf; None if it is not a number."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    unit = ""
    number = value
    if isinstance(value, str):
        match = NUMBER.match(value)
        if match is None or not re.fullmatch(r" ?[^\s\d].*", value[match.end() :]):
            return None
        number, unit = float(match[0]), value[match.end() :].strip()
    number = float(number)
    if not np.isfinite(number):
        return None
    low, high = sorted((number * (1 - SPAN), number * (1 + SPAN))) if number else (0.0, 1.0)
    if whole:
        low, high = float(np.floor(low)), float(np.ceil(high)) + (not number)
    step = 1.0 if whole else 10.0 ** np.round(np.log10((high - low) / 200))
    return Slider(path, number, float(f"{low:.6g}"), float(f"{high:.6g}"), float(f"{step:.1e}"), unit, about, whole)


def _shown(result: Result) -> dict[str, Any]:
    """Return a result as data for the page."""
    from cfmkit.families import family
    from cfmkit.runs.run_outcome import report_on
    from cfmkit.specs.units import border_unit, format_short

    report = report_on(result)
    tone, words = ENDS.get(int(report.exit_code), ("warn", "the run ended early"))
    first = (*family(result.spec.family).leading, "force_mean", "torque_mean", "force_ripple", "torque_ripple")
    known = {name: report.metrics[name] for name in dict.fromkeys(first) if name in report.metrics}
    found: dict[str, Any] = {
        "tone": tone,
        "verdict": words,
        "message": report.message,
        "requirements": [{"sentence": one.sentence, "ok": one.ok} for one in report.requirements],
        "warnings": [{"name": one.name, "message": one.message} for one in report.warnings],
        "metrics": [
            [name.replace("_", " "), one.word or format_short(one.value, one.dimension), one.definition]
            for name, one in known.items()
            if one.value is not None
        ],
    }
    if result.curves:
        curve = result.curves[0]
        found["curve"] = {
            "x": f"{curve.motion_name} [{border_unit(curve.motion_dimension)}]",
            "y": f"{curve.kind} [{border_unit(curve.kind)}]",
            "branches": dict(_branches(curve)),
        }
    return found


def _branches(curve: Curve) -> Iterator[tuple[str, list[list[float | None]]]]:
    from cfmkit.specs.units import to_border

    for name in dict.fromkeys(curve.branches):
        on = np.flatnonzero(curve.branch == name)
        on = on[np.unique(np.linspace(0, len(on) - 1, min(len(on), MOST_POINTS)).round().astype(int))]
        motion = to_border(curve.motion[on], curve.motion_dimension)
        effort = to_border(curve.effort[on], curve.kind)
        yield name, [[_number(value) for value in side] for side in (motion, effort)]


def _number(value: float) -> float | None:
    return float(f"{value:.5g}") if np.isfinite(value) else None


HOST = "127.0.0.1"
MAX_BODY_BYTES = 200_000
"""Of a request: a thousand changes are a fifth of that."""

MAX_CONNECTIONS = 32
"""At a time: several times what a browser opens."""

MAX_READ_SECONDS = 10.0
"""Until a request must have arrived: on the computer itself it takes milliseconds."""

MAX_SEND_SECONDS = 30.0
"""Until an answer must have been taken."""

MAX_DRAIN_SECONDS = 0.3
"""Until a connection is closed whose client goes on sending after its answer."""

POLICY = (
    "default-src 'none'; style-src 'nonce-{nonce}'; script-src 'nonce-{nonce}'; connect-src 'self'; img-src data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
NO_CONTENT_POLICY = "default-src 'none'; frame-ancestors 'none'"

REDIRECT = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={address}"><title>cfmkit explore</title></head>
<body><p><a href="{address}">cfmkit explore</a></p></body></html>
"""


def ignored(_error: Exception) -> None:
    """Tell nobody: the default for library use."""


class ExplorerServer(ThreadingHTTPServer):
    """The server of one explorer.

    Attributes
    ----------
    explorer : Explorer
        What answers.
    token : str
        What a request must have.
    failed : callable
        Is told the exception of an answer that a bug ended; the page has one line of it.
    """

    daemon_threads = True
    allow_reuse_address = os.name == "posix"  # elsewhere it lets another program listen on the same port
    request_queue_size = MAX_CONNECTIONS

    def __init__(self, explorer: Explorer, port: int = 0, failed: Callable[[Exception], object] = ignored) -> None:
        """Bind to a port of this computer alone; 0 takes a free one.

        Raises
        ------
        OSError
            If the port is taken.
        """
        self.explorer, self.token, self.turn = explorer, secrets.token_urlsafe(24), threading.Lock()
        self.failed = failed
        self._redirect: Path | None = None
        self._connections: dict[socket.socket, float | None] = {}  # when each came; None: its request has arrived
        self._counting = threading.Lock()
        super().__init__((HOST, port), _Handler)

    @property
    def address(self) -> str:
        """Where the page is, with the token."""
        return f"http://{HOST}:{self.server_port}/?token={self.token}"

    def write_redirect(self) -> Path:
        """Write a page that leads to the address; its path is what a browser is started with.

        Every user of the computer can read the command lines of all programs, but this file is readable by its owner
        alone. It is removed when the page has been opened, or with the server.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        descriptor, name = tempfile.mkstemp(prefix="cfmkit-explore-", suffix=".html")  # of mode 600
        self._redirect = Path(name)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(REDIRECT.format(address=html.escape(self.address)))
        return self._redirect

    def remove_redirect(self) -> None:
        """Remove the page that leads here, if there is one."""
        if self._redirect is not None:
            with suppress(OSError):
                self._redirect.unlink()

    def server_close(self) -> None:
        """Close the port; nothing is left on the disk."""
        self.remove_redirect()
        super().server_close()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread; if there are too many, the one that has waited longest without a request is closed."""
        with self._counting:
            if len(self._connections) >= MAX_CONNECTIONS:
                oldest = next((one for one, came in self._connections.items() if came is not None), None)
                if oldest is None:
                    super().shutdown_request(request)
                    return
                self._hang_up(oldest)
            self._connections[request] = time.monotonic()
        super().process_request(request, client_address)

    def note_arrival(self, request: socket.socket) -> None:
        """Note that a request has arrived as a whole: what follows is the answer."""
        with self._counting:
            if request in self._connections:
                self._connections[request] = None

    def service_actions(self) -> None:
        """Close the connections whose request has not arrived in time, however steadily its pieces come."""
        with self._counting:
            first = time.monotonic() - MAX_READ_SECONDS
            for late in [one for one, came in self._connections.items() if came is not None and came < first]:
                self._hang_up(late)

    def shutdown_request(self, request: Any) -> None:
        """Close a connection; what was sent and not read is taken first, or the system would discard the answer."""
        end = time.monotonic() + MAX_DRAIN_SECONDS
        with self._counting:
            if self._connections.pop(request, "ended") != "ended":
                self._connections[request] = time.monotonic()  # if there are too many, this one may be ended
        with suppress(OSError):
            request.shutdown(socket.SHUT_WR)
            request.settimeout(MAX_DRAIN_SECONDS)
            while request.recv(65536) and time.monotonic() < end:
                pass
        with self._counting:
            self._connections.pop(request, None)
        super().shutdown_request(request)

    def _hang_up(self, connection: socket.socket) -> None:
        """End the reading of a connection; its thread closes it."""
        del self._connections[connection]
        with suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a page that was closed before it had its answer, and one line of a bug."""
        error = sys.exc_info()[1]
        if isinstance(error, Exception) and not isinstance(error, (ConnectionError, TimeoutError)):
            self.failed(error)


class _Handler(BaseHTTPRequestHandler):
    server: ExplorerServer
    server_version = "cfmkit"
    sys_version = ""
    timeout = MAX_SEND_SECONDS

    def do_GET(self) -> None:
        """Answer with the page, to whoever has its whole address."""
        self.server.note_arrival(self.connection)
        path, _, query = self.path.partition("?")
        if not self._is_local() or not self._knows(parse_qs(query).get("token", [""])[0]):
            self._send(403, b"this page needs the address that cfmkit explore printed", "text/plain")
        elif path != "/":
            self._send(404, b"there is no such page", "text/plain")
        else:
            nonce = secrets.token_urlsafe(16)
            with self.server.turn:
                page = self.server.explorer.page(self.server.token, nonce)
            self._send(200, page, "text/html", POLICY.format(nonce=nonce))
            self.server.remove_redirect()

    def do_POST(self) -> None:
        """Answer what the page asks."""
        if not self._is_local() or not self._knows(self.headers.get("X-Token", "")):
            self._send(403, b"{}")
            return
        try:
            asked = self._asked()
        except ValueError:
            self._send(400, b"{}")
            return
        self.server.note_arrival(self.connection)
        with self.server.turn:
            status, found = self._answer(self.path, *asked)
        self._send(status, json.dumps(found, allow_nan=False).encode())

    def _asked(self) -> tuple[list[str], str]:
        """Return the changes and the name in a request."""
        lengths = self.headers.get_all("Content-Length", [])
        if len(lengths) != 1 or "Transfer-Encoding" in self.headers or not re.fullmatch("[0-9]{1,9}", lengths[0]):
            raise ValueError("the length must be said once")
        size = int(lengths[0])
        if not 0 < size <= MAX_BODY_BYTES:
            raise ValueError("too large")
        body = self.rfile.read(size)
        if len(body) < size:
            raise ValueError("shorter than it said")
        try:
            found = json.loads(body.decode())
        except RecursionError:
            raise ValueError("too deep") from None
        changes, name = (found.get("changes"), found.get("name", "")) if isinstance(found, dict) else (None, "")
        if not isinstance(changes, list) or not all(isinstance(one, str) for one in [*changes, name]):
            raise ValueError("no changes")
        for text in [*changes, name]:
            text.encode()  # half of a surrogate pair is no text
        return changes, name

    def _answer(self, path: str, changes: list[str], name: str) -> tuple[int, dict[str, Any]]:
        explorer = self.server.explorer
        try:
            if path == "/answer":
                return 200, explorer.answer(changes)
            if path == "/drawing":
                return 200, explorer.drawing(changes)
            if path == "/yaml":
                return 200, {"yaml": explorer.yaml(changes)}
            if path == "/save":
                return 200, explorer.save(name, changes)
        except CfmError as error:
            return 200, {"problem": [line.removeprefix("error    ") for line in lines_of(error)]}
        except Exception as error:
            self.server.failed(error)
            return 500, {"problem": [f"a bug in cfmkit: {type(error).__name__}: {error}"]}
        return 404, {}

    def _is_local(self) -> bool:
        """Return whether it was reached by a name of this computer, and from no page but its own."""
        names = {f"{name}:{self.server.server_port}" for name in (HOST, "localhost")}
        hosts, origins = self.headers.get_all("Host", []), self.headers.get_all("Origin", [])
        return (
            len(hosts) == 1
            and hosts[0] in names
            and all(one in {f"http://{name}" for name in names} for one in origins)
        )

    def _knows(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self.server.token.encode())

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Refuse what is no request that can be understood; nothing of it is repeated."""
        unknown_method = code == 501
        self._send(405 if unknown_method else code, b"this is not a request of the explorer's page", "text/plain")
        self.close_connection = True

    def _send(
        self, status: int, content: bytes, kind: str = "application/json", policy: str = NO_CONTENT_POLICY
    ) -> None:
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Content-Security-Policy", policy)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("X-Frame-Options", "DENY")
        if status == 405:
            self.send_header("Allow", "GET, POST")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: standard error is for what goes wrong."""
