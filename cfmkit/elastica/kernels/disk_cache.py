"""Compiled code on disk: where, under which name, and what is checked before any of it runs."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import json
import logging
import os
import sys
import tempfile
import time
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from cfmkit.elastica.kernels.machine_code import Code, linked, processor
from cfmkit.store.content_hashes_and_versions import installed
from cfmkit.store.private_cache_folder import place, private_folder, resolve_trusted

if TYPE_CHECKING:
    from collections.abc import Iterator

_LOG = logging.getLogger("cfmkit.elastica")
_HEAD = b"cfmkit code 1\n"


def digest() -> str:
    """Return a digest of the sources of all kernels, and of what compiles them."""
    whole = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        if path.name not in _NOT_COMPILED:
            whole.update(path.read_bytes())
    return whole.hexdigest()


_NOT_COMPILED = ("compiled.py", "disk_cache.py")
"""What calls the code, keeps it and tells of it: the code does not follow from them."""

_SETTINGS = ("NUMBA_BOUNDSCHECK", "NUMBA_CPU_FEATURES", "NUMBA_CPU_NAME", "NUMBA_ENABLE_AVX", "NUMBA_OPT")
"""Variables of the environment that the machine code follows from; those of threads, which differ between the processes
of one study, are none."""


@lru_cache(maxsize=1)
def origin() -> dict[str, str]:
    """Return all that the machine code follows from: sources, compiler, its settings, processor."""
    libraries = {name: str(installed(name)) for name in ("llvmlite", "numba", "numpy")}
    settings = {name: os.environ[name] for name in _SETTINGS if name in os.environ}
    return {
        "sources": digest(),
        "python": sys.version,
        **libraries,
        "settings": json.dumps(settings, sort_keys=True),
        "processor": processor(),
    }


@lru_cache(maxsize=1)
def stamp() -> str:
    """Return a digest of the origin; code is kept in files named after it."""
    return hashlib.sha256(json.dumps(origin(), sort_keys=True).encode()).hexdigest()


_ELSEWHERE = "NUMBA_CACHE_DIR"


def folders() -> tuple[Path, ...]:
    """Return where code may be kept, best first."""
    return (*_lasting(), place("compiled"))


def kept_in() -> Path | None:
    """Return the folder that holds the code compiled from these sources; None if they have not been compiled yet."""
    return next((path.parent for path in _found("solver", "code")), None)


def _lasting() -> Iterator[Path]:
    """Yield the folders that stay: where the user says, else with the package, in the home folder."""
    if elsewhere := os.environ.get(_ELSEWHERE):
        yield Path(elsewhere)
        return
    yield Path(__file__).parent / "__pycache__"
    caches = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME")
    with contextlib.suppress(RuntimeError):  # no home folder
        yield (Path(caches) if caches and os.path.isabs(caches) else Path.home() / ".cache") / "cfmkit"


def _places() -> Iterator[Path]:
    """Yield the folders, and last the one among the temporary files if it is there."""
    yield from _lasting()
    if private := private_folder("compiled", make=False):
        yield private


def _file(name: str, ending: str) -> str:
    return f"{name}-{stamp()[:24]}.{ending}"


def _found(name: str, ending: str) -> Iterator[Path]:
    """Yield the files of a door, links resolved, that only this user or the system's owner can have written."""
    for folder in _places():
        path = folder / _file(name, ending)
        if not os.path.exists(path):  # a folder that may not be looked into holds nothing for us; Path.exists() raises
            continue
        if real := resolve_trusted(path):
            yield real
        else:
            _LOG.info("compiled code in %s is not used: others can write there", folder)


LONGEST_WAIT = 120.0
"""How long a process waits for another one that compiles the same door [s]: several times what the longest takes; a
process that was stopped must not stop all others."""

_POLLED = 0.05
"""Between two looks whether the other process is ready [s]; nobody notices so little after many seconds."""


@contextlib.contextmanager
def one_at_a_time(name: str) -> Iterator[None]:
    """Let one process compile a door while others wait, and then read what it has kept.

    Several workers that begin with an empty cache would each spend the same seconds on the same code, and on few
    cores each would take that many times as long. Where there is no place or no lock for it, nobody waits.
    """
    descriptor = _lock_file(name)
    if descriptor is None:
        yield
        return
    try:
        _wait(descriptor, name)
        yield
    finally:
        os.close(descriptor)  # this unlocks, too


def _lock_file(name: str) -> int | None:
    """Return an open file that processes can lock, beside the code; None where there is none."""
    if importlib.util.find_spec("fcntl") is None:
        return None
    for folder in _lasting():
        with contextlib.suppress(OSError):
            folder.mkdir(mode=0o755, parents=True, exist_ok=True)
            if real := resolve_trusted(folder):
                return os.open(real / _file(name, "lock"), os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
    return None


def _wait(descriptor: int, name: str) -> None:
    """Lock a file; go on without the lock after the longest wait, or where the file system has no locks."""
    import fcntl

    ends = time.monotonic() + LONGEST_WAIT
    waited = False
    while time.monotonic() < ends:
        try:
            return fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if not waited:
                _LOG.warning("another process compiles the beam engine ('%s'): waiting for it", name)
            waited = True
            time.sleep(_POLLED)
        except OSError:
            return None
    return None


def library(name: str) -> Path | None:
    """Return the shared library that is kept for a door, None if there is none that is of this origin and trusted.

    Its seal stands beside it: half a file is none, and a renamed one neither.
    """
    for path in _found(name, "so"):
        with contextlib.suppress(OSError):
            if path.with_suffix(".sha256").read_text() == _seal(path.read_bytes()):
                return path
    return None


def read(name: str) -> Code | None:
    """Return the code that is kept for a door, None if there is none that is of this origin, whole and trusted."""
    for path in _found(name, "code"):
        with contextlib.suppress(OSError, ValueError, KeyError):
            return _parsed(path.read_bytes())
    return None


def write(name: str, code: Code) -> Path | None:
    """Keep the code of a door; return where, None if there is no folder that only this user can write to."""
    for folder in (*_lasting(), None):
        with contextlib.suppress(OSError):
            if folder is not None:
                folder.mkdir(mode=0o755, parents=True, exist_ok=True)  # one user compiles, all of them may read
            own = private_folder("compiled") if folder is None else resolve_trusted(folder)
            if own is None:
                continue
            _replace(own / _file(name, "code"), _written(code))
            _write_library(name, code, own)
            if folder is None:
                _report_private(own)
            return own
    _LOG.info("no folder is writable: compiled code is not kept")
    return None


@lru_cache(maxsize=1)
def _report_private(folder: Path) -> None:
    """Report once where compiled code went: every part of it goes there."""
    _LOG.info("neither the package nor the home folder is writable: compiled code is kept in %s", folder)


def _write_library(name: str, code: Code, folder: Path) -> None:
    with tempfile.TemporaryDirectory(prefix=".", dir=folder) as room:
        data = linked(code, Path(room))
    if data is not None:
        _replace(folder / _file(name, "so"), data)
        _replace(folder / _file(name, "sha256"), _seal(data).encode())


def _seal(library: bytes) -> str:
    """Return what stands beside a shared library: what it follows from, and its own digest."""
    return f"{stamp()} {hashlib.sha256(library).hexdigest()}\n"


def _written(code: Code) -> bytes:
    about = {"origin": origin(), "needs": code.needs, "content": hashlib.sha256(code.content).hexdigest()}
    return _HEAD + json.dumps(about).encode() + b"\n" + code.content


def _parsed(data: bytes) -> Code:
    head, about, content = data.split(b"\n", 2)
    given = json.loads(about)
    if head + b"\n" != _HEAD or given["origin"] != origin() or given["content"] != hashlib.sha256(content).hexdigest():
        raise ValueError("of another origin, or not whole")
    return Code(tuple(given["needs"]), content)


def _replace(path: Path, data: bytes) -> None:
    """Write a file that appears whole or not at all, and that others cannot write to."""
    handle, name = tempfile.mkstemp(prefix=".", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise
