"""The explorer's web server: on a port that only this computer reaches, and only with the explorer's token.

The server of the standard library does: one person asks, one answer at a time. What is checked on every request: the
name by which it was reached (a page elsewhere that lets its own name point here is refused), the page that sent it,
the token, the size. The number of connections is limited, and the time in which a request must have arrived.
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
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs

from cfmkit.errors import CfmError, lines_of
from cfmkit.runs.explorer import Explorer as Explorer  # noqa: TC001 (programs import both from here)
from cfmkit.runs.explorer import suggested_name as suggested_name

if TYPE_CHECKING:
    from collections.abc import Callable

SERVER_HOST = "127.0.0.1"
MAX_BODY_BYTES = 200_000  # of a request: a thousand changes are a fifth of that
MAX_CONNECTIONS = 32  # at a time: several times what a browser opens
MAX_READ_SECONDS = 10.0  # until a request must have arrived: on the computer itself it takes milliseconds
MAX_SEND_SECONDS = 30.0  # until an answer must have been taken
MAX_DRAIN_SECONDS = 0.3  # until a connection is closed whose client goes on sending after its answer
CONTENT_POLICY = (
    "default-src 'none'; style-src 'nonce-{nonce}'; script-src 'nonce-{nonce}'; connect-src 'self'; img-src data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
NO_CONTENT_POLICY = "default-src 'none'; frame-ancestors 'none'"
REDIRECT_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={address}"><title>cfmkit explore</title></head>
<body><p><a href="{address}">cfmkit explore</a></p></body></html>
"""


def ignore_progress(_error: Exception) -> None:
    """Ignore progress: the default for library use."""


class ExplorerServer(ThreadingHTTPServer):
    """The server of one explorer, which answers requests that have its token."""

    daemon_threads = True
    allow_reuse_address = os.name == "posix"  # elsewhere it lets another program listen on the same port
    request_queue_size = MAX_CONNECTIONS

    def __init__(
        self, explorer: Explorer, port: int = 0, failed: Callable[[Exception], object] = ignore_progress
    ) -> None:
        """Bind to a port of this computer alone; 0 takes a free one.

        Raises OSError if the port is taken.
        """
        self.explorer, self.token, self.turn = explorer, secrets.token_urlsafe(24), threading.Lock()
        self.failed = failed
        self._redirect: Path | None = None
        self._connections: dict[socket.socket, float | None] = {}  # when each came; None: its request has arrived
        self._counting = threading.Lock()
        super().__init__((SERVER_HOST, port), _Handler)

    @property
    def address(self) -> str:
        """Address of the page, with the token."""
        return f"http://{SERVER_HOST}:{self.server_port}/?token={self.token}"

    def write_redirect(self) -> Path:
        """Write a page that leads to the address; its path is what a browser is started with.

        Every user of the computer can read the command lines of all programs, but this file is readable by its owner
        alone. It is removed when the page has been opened, or with the server.

        Raises OSError if it cannot be written.
        """
        descriptor, name = tempfile.mkstemp(prefix="cfmkit-explore-", suffix=".html")  # of mode 600
        self._redirect = Path(name)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(REDIRECT_PAGE.format(address=html.escape(self.address)))
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
                oldest = next((connection for connection, came in self._connections.items() if came is not None), None)
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
            for late in [
                connection for connection, came in self._connections.items() if came is not None and came < first
            ]:
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
        """Ignore a page that was closed before it had its answer; report a bug in one line."""
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
        if not self._is_local() or not self._is_token(parse_qs(query).get("token", [""])[0]):
            self._send(403, b"this page needs the address that cfmkit explore printed", "text/plain")
        elif path != "/":
            self._send(404, b"there is no such page", "text/plain")
        else:
            nonce = secrets.token_urlsafe(16)
            with self.server.turn:
                page = self.server.explorer.page(self.server.token, nonce)
            self._send(200, page, "text/html", CONTENT_POLICY.format(nonce=nonce))
            self.server.remove_redirect()

    def do_POST(self) -> None:
        """Answer what the page asks."""
        if not self._is_local() or not self._is_token(self.headers.get("X-Token", "")):
            self._send(403, b"{}")
            return
        try:
            asked = self._read_request()
        except ValueError:
            self._send(400, b"{}")
            return
        self.server.note_arrival(self.connection)
        with self.server.turn:
            status, answer = self._answer(self.path, *asked)
        self._send(status, json.dumps(answer, allow_nan=False).encode())

    def _read_request(self) -> tuple[list[str], str]:
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
            request = json.loads(body.decode())
        except RecursionError:
            raise ValueError("too deep") from None
        changes, name = (request.get("changes"), request.get("name", "")) if isinstance(request, dict) else (None, "")
        if not isinstance(changes, list) or not all(isinstance(text, str) for text in [*changes, name]):
            raise ValueError("no changes")
        for text in [*changes, name]:
            text.encode()  # half of a surrogate pair is no text
        return changes, name

    def _answer(self, path: str, changes: list[str], name: str) -> tuple[int, dict[str, Any]]:
        explorer = self.server.explorer
        answers: dict[str, Callable[[], dict[str, Any]]] = {
            "/answer": lambda: explorer.answer(changes),
            "/influence": lambda: explorer.influence(name),
            "/drawing": lambda: explorer.drawing(changes),
            "/yaml": lambda: {"yaml": explorer.yaml(changes)},
            "/command": lambda: {"command": explorer.command(changes)},
            "/save": lambda: explorer.save(name, changes),
        }
        if path not in answers:
            return 404, {}
        try:
            return 200, answers[path]()
        except CfmError as error:
            return 200, {"problem": [line.removeprefix("error    ") for line in lines_of(error)]}
        except Exception as error:
            self.server.failed(error)
            return 500, {"problem": [f"a bug in cfmkit: {type(error).__name__}: {error}"]}

    def _is_local(self) -> bool:
        """Return whether it was reached by a name of this computer, and from no page but its own."""
        names = {f"{name}:{self.server.server_port}" for name in (SERVER_HOST, "localhost")}
        hosts, origins = self.headers.get_all("Host", []), self.headers.get_all("Origin", [])
        return (
            len(hosts) == 1
            and hosts[0] in names
            and all(origin in {f"http://{name}" for name in names} for origin in origins)
        )

    def _is_token(self, token: str) -> bool:
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
        """Ignore it: standard error is for what goes wrong."""
