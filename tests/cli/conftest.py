"""The command, run as a user runs it in an empty folder: in the process of the tests, or the installed program.

Most tests call the program's entry in their own process, for an interpreter and its libraries take ten times as long
to start as most runs take. What only a process of its own can show is shown by `Cli.program`: signals and kills,
closed streams and other encodings, permissions, and that each verb works as it is installed.
"""

from __future__ import annotations

import ctypes
import json
import logging
import os
import signal
import subprocess
import sys
import tempfile
import warnings
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from cfmkit.cli import run_command

if TYPE_CHECKING:
    from collections.abc import Iterator

COMMAND = Path(sys.executable).parent / "cfmkit"
CONFIGS = Path(__file__).parents[2] / "configs"
PR_CAPBSET_DROP = 24  # linux/prctl.h
CAPABILITIES = (1, 2)  # CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH of linux/capability.h


@dataclass(frozen=True)
class Outcome:
    """What a command did."""

    code: int
    out: str
    err: str

    @property
    def document(self) -> dict[str, Any]:
        """Standard output as the one JSON document that it must be."""
        return json.loads(self.out)


def as_a_user() -> None:
    """Give up root's right to pass over file permissions, in the process that is about to become the command."""
    if os.geteuid() == 0:
        prctl = ctypes.CDLL(None, use_errno=True).prctl
        for capability in CAPABILITIES:
            if prctl(PR_CAPBSET_DROP, capability, 0, 0, 0):
                raise OSError(ctypes.get_errno(), "cannot give up a capability")


@contextmanager
def as_the_process(folder: Path, environment: dict[str, str], given: bytes) -> Iterator[tuple[Any, Any]]:
    """Make this process look like one that was started for a command, and undo it; yield where it writes to.

    The streams are files in the place of file descriptors 0 to 2, so that what libraries and child processes write is
    seen, too. Put back is whatever a command may change of a process: folder, environment, streams, filters of
    warnings, signal handlers, logging.
    """
    log = logging.getLogger("cfmkit")
    kept = dict(os.environ), Path.cwd(), log.handlers[:], log.level, log.propagate, sys.unraisablehook
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    with ExitStack() as stack:
        out, err = (stack.enter_context(tempfile.TemporaryFile()) for _ in range(2))
        patch = stack.enter_context(pytest.MonkeyPatch.context())
        stack.enter_context(warnings.catch_warnings())
        stack.enter_context(_descriptors(given, out, err))
        warnings.simplefilter("error")
        patch.setattr(sys, "warnoptions", ["error"])
        for name, number, mode in (("stdin", 0, "r"), ("stdout", 1, "w"), ("stderr", 2, "w")):
            stream = stack.enter_context(open(number, mode, encoding="utf-8", closefd=False))
            patch.setattr(sys, name, stream)
        try:
            os.chdir(folder)
            _replace_environment(environment)
            yield out, err
        finally:
            _replace_environment(kept[0])
            os.chdir(kept[1])
            log.handlers, log.propagate, sys.unraisablehook = kept[2], kept[4], kept[5]
            log.setLevel(kept[3])
            for number, handler in handlers.items():
                signal.signal(number, handler)


@contextmanager
def _descriptors(given: bytes, out: Any, err: Any) -> Iterator[None]:
    """Put files in the place of file descriptors 0 to 2."""
    with tempfile.TemporaryFile() as source:
        source.write(given)
        source.seek(0)
        kept = [os.dup(number) for number in range(3)]
        for number, file in enumerate((source, out, err)):
            os.dup2(file.fileno(), number)
        try:
            yield
        finally:
            for number, old in enumerate(kept):
                os.dup2(old, number)
                os.close(old)


def _replace_environment(wanted: dict[str, str]) -> None:
    for name in set(os.environ) - set(wanted):
        del os.environ[name]
    os.environ.update(wanted)


class Cli:
    """Runs commands in one folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(
        self, *arguments: str, stdin: str | bytes = "", timeout: float | None = None, **environment: str
    ) -> Outcome:
        """Run a command in this process; `timeout` is that of `program`, and nothing ends this process."""
        given = stdin.encode() if isinstance(stdin, str) else stdin
        with as_the_process(self.folder, self.environment(**environment), given) as (out, err):
            code = run_command(arguments)
            reported = []
            for stream, file in ((sys.stdout, out), (sys.stderr, err)):
                stream.flush()
                file.seek(0)
                reported.append(file.read().decode())
        return Outcome(int(code), *reported)

    def program(self, *arguments: str, stdin: str | bytes = "", timeout: float = 300, **environment: str) -> Outcome:
        """Run the installed program."""
        done = subprocess.run(
            [COMMAND, *arguments],
            cwd=self.folder,
            input=stdin.encode() if isinstance(stdin, str) else stdin,
            env=self.environment(**environment),
            capture_output=True,
            timeout=timeout,
            check=False,
        )
        return Outcome(done.returncode, done.stdout.decode(), done.stderr.decode())

    @property
    def command(self) -> Path:
        """The installed program."""
        return COMMAND

    def shell(self, script: str) -> subprocess.Popen[bytes]:
        """Start a shell script without waiting for it."""
        return subprocess.Popen(["sh", "-c", script], cwd=self.folder, env=self.environment())

    def start(self, *arguments: str, env_more: dict[str, str] | None = None, **options: Any) -> subprocess.Popen[bytes]:
        """Start a command without waiting for it."""
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
        environment = self.environment(**(env_more or {}))
        return subprocess.Popen([COMMAND, *arguments], cwd=self.folder, env=environment, **pipes)

    def permitted(self, *arguments: str) -> Outcome:
        """Run a command that may read and write what its owner may, root or not."""
        process = self.start(*arguments, preexec_fn=as_a_user)
        out, err = process.communicate(timeout=60)
        return Outcome(process.returncode, out.decode(), err.decode())

    @staticmethod
    def environment(**more: str) -> dict[str, str]:
        """A plain environment in which any warning of a library is an error."""
        wanted = ("PATH", "HOME", "LANG", "SYSTEMROOT", "MPLCONFIGDIR", "TMPDIR", "PYTHONPATH")
        kept = {name: os.environ[name] for name in wanted if name in os.environ}
        return kept | {"PYTHONWARNINGS": "error", "PYTHONUTF8": "1"} | more


@pytest.fixture
def cli(tmp_path: Path) -> Cli:
    """The command, in an empty folder."""
    return Cli(tmp_path)


@pytest.fixture
def cam(tmp_path: Path) -> str:
    """The published cam as ``cam.yaml`` in the folder of `cli`."""
    (tmp_path / "cam.yaml").write_bytes((CONFIGS / "cam.yaml").read_bytes())
    return "cam.yaml"
