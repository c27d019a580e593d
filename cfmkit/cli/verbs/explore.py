"""``cfmkit explore``: a spec with sliders for its numbers, in the browser."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cfmkit.cli.failures import Stopped, report_failure
from cfmkit.cli.options import SpecOptions, argument, flag, option
from cfmkit.documents.document import Document, line, whole_line
from cfmkit.store.safe_disk_changes import reason

if TYPE_CHECKING:
    from cfmkit.cli.output import Terminal
    from cfmkit.runs.explorer_server import ExplorerServer

HELP_POSITION = 23
HELP_EXAMPLE = "cfmkit explore cam.yaml"


@dataclass(frozen=True, kw_only=True)
class ExploreOptions(SpecOptions):
    """Arguments and options."""

    spec: str = argument("SPEC", "YAML file of one mechanism.")
    port: int = option("N", "Port of this computer to listen on; default: a free one.", low=0, default=0)
    no_browser: bool = flag("Open no browser; print the address only.")


def run(options: ExploreOptions, terminal: Terminal) -> Document:
    """Change the numbers of a spec with sliders in the browser; curve, metrics and requirements follow.

    The page is available on this computer only, at an address with a token. The page saves files in
    the spec's folder only. Ctrl-C ends the server.
    """
    from cfmkit.errors import UsageError
    from cfmkit.runs.explorer import Explorer
    from cfmkit.runs.explorer_server import ExplorerServer
    from cfmkit.runs.specfile import STDIN_PATH

    if options.spec == STDIN_PATH:
        raise UsageError("explore needs a file: it saves new files beside it")
    if options.port > 65535:
        raise UsageError(f"--port: {options.port} is not allowed: must be <= 65535")
    explorer = Explorer.from_file(options.spec, options.changes)
    try:
        server = ExplorerServer(explorer, options.port, lambda error: report_failure(error, terminal))
    except OSError as error:
        raise UsageError(f"--port: {options.port} cannot be listened on: {reason(error)}") from None
    with server:
        if options.json:  # the one document comes at the end
            terminal.complain([f"explore  {server.address}"])
        else:
            terminal.show(whole_line(f"explore  {server.address}"), line("end      with Ctrl-C"))
        if not options.no_browser:
            _open_browser(server, terminal)
        with suppress(Stopped):  # the ordinary end, no failure
            server.serve_forever()
        return Document({"address": server.address.partition("?")[0]})


def _open_browser(server: ExplorerServer, terminal: Terminal) -> None:
    """Start the browser with a file that leads to the page: other users of the computer can read its command line."""
    import webbrowser

    try:
        webbrowser.open(server.write_redirect().as_uri())
    except OSError as error:
        terminal.complain([f"warning  no browser is opened ({reason(error)}): open the address above"])
