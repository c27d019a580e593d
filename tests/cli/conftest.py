"""The installed command, run as a user runs it: in an empty folder, in a process of its own."""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

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


class Cli:
    """Runs commands in one folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(self, *arguments: str, stdin: str | bytes = "", timeout: float = 300, **environment: str) -> Outcome:
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
