"""The explorer on a port of this computer: reachable from this computer only, and only with its token.

The server of the standard library does: one person asks, one answer at a time. What is checked on every request: the
name by which it was reached (a page elsewhere that lets its own name point here is refused), the token, the size.
"""

from __future__ import annotations

import hmac
import json
import secrets
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from cfmkit.errors import CfmError, lines_of

if TYPE_CHECKING:
    from cfmkit.runs.explorer import Explorer

HOST = "127.0.0.1"
LARGEST = 200_000
"""Bytes of a request: a thousand changes are a fifth of that."""

POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'; img-src data:"


class ExplorerServer(ThreadingHTTPServer):
    """The server of one explorer.

    Attributes
    ----------
    explorer : Explorer
        What answers.
    token : str
        What a request must have.
    """

    daemon_threads = True

    def __init__(self, explorer: Explorer, port: int = 0) -> None:
        """Bind to a port of this computer alone; 0 takes a free one.

        Raises
        ------
        OSError
            If the port is taken.
        """
        self.explorer, self.token, self.turn = explorer, secrets.token_urlsafe(24), threading.Lock()
        super().__init__((HOST, port), _Handler)

    @property
    def address(self) -> str:
        """Where the page is, with the token."""
        return f"http://{HOST}:{self.server_port}/?token={self.token}"


class _Handler(BaseHTTPRequestHandler):
    server: ExplorerServer
    server_version = "cfmkit"
    sys_version = ""
    timeout = 30

    def do_GET(self) -> None:
        """Answer with the page, to whoever has its whole address."""
        parts = urlsplit(self.path)
        if not self._is_local() or not self._knows(parse_qs(parts.query).get("token", [""])[0]):
            self._send(403, b"this page needs the address that cfmkit explore printed", "text/plain")
        elif parts.path != "/":
            self._send(404, b"there is no such page", "text/plain")
        else:
            with self.server.turn:
                self._send(200, self.server.explorer.page(self.server.token), "text/html")

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
        with self.server.turn:
            status, found = self._answer(urlsplit(self.path).path, *asked)
        self._send(status, json.dumps(found, allow_nan=False).encode())

    def _asked(self) -> tuple[list[str], str]:
        """Return the changes and the name in a request."""
        size = int(self.headers.get("Content-Length", "0"))
        if not 0 < size <= LARGEST:
            raise ValueError("too large")
        try:
            found = json.loads(self.rfile.read(size))
        except RecursionError:
            raise ValueError("too deep") from None
        changes, name = (found.get("changes"), found.get("name", "")) if isinstance(found, dict) else (None, "")
        if not isinstance(changes, list) or not all(isinstance(one, str) for one in [*changes, name]):
            raise ValueError("no changes")
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
            return 500, {"problem": [f"a bug in cfmkit: {type(error).__name__}: {error}"]}
        return 404, {}

    def _is_local(self) -> bool:
        return self.headers.get("Host", "") in {f"{name}:{self.server.server_port}" for name in (HOST, "localhost")}

    def _knows(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self.server.token.encode())

    def _send(self, status: int, content: bytes, kind: str = "application/json") -> None:
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Content-Security-Policy", POLICY)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("X-Frame-Options", "DENY")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: standard error is for what goes wrong."""
