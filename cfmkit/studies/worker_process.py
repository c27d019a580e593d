"""The worker process of a pool: reads jobs from a pipe, does them, and writes the outcomes to another.

It ends when its parent does, however that ends: a thread waits for the end of a third
pipe, which the operating system closes with the parent; on Linux the kernel is asked to
end the process, too, in case a solver never lets that thread run.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import sys
import threading
import traceback
import warnings
from multiprocessing.connection import Connection
from typing import Any

START = (
    "import json, sys; given = json.loads(sys.argv[1]); sys.path[:] = given['path']; "
    "from cfmkit.studies.worker_process import main; main(given['pipes'], given['parent'])"
)
"""The program of a worker; its only argument says where to find modules and which pipes to use."""

READY, STARTED, DONE, BROKEN = b"r", b"s", b"d", b"b"


def main(pipes: list[int], parent: int) -> None:
    """Serve jobs until there are no more, or the parent has gone.

    Parameters
    ----------
    pipes : list of int
        Descriptors: what to do (pickled), jobs, outcomes, and the pipe that ends with the parent.
    parent : int
        The parent's process id if the kernel may watch it, else 0.
    """
    what, jobs, outcomes, life = pipes
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore")
    threading.Thread(target=_end_with_parent, args=(life,), daemon=True).start()
    _ask_the_kernel(parent)
    # What a library prints must not get between the results of the program.
    os.dup2(sys.stderr.fileno(), 1)
    # All workers share the file and its position; reading at an offset leaves that alone.
    work = pickle.loads(os.pread(what, os.fstat(what).st_size, 0))
    with contextlib.suppress(BrokenPipeError):
        _serve(work, Connection(jobs, writable=False), Connection(outcomes, readable=False))


def _serve(work: Any, jobs: Connection, outcomes: Connection) -> None:
    outcomes.send_bytes(READY)
    while True:
        try:
            job = pickle.loads(jobs.recv_bytes())
        except EOFError:
            return
        outcomes.send_bytes(STARTED)
        outcomes.send_bytes(_outcome(work, job))


def _outcome(work: Any, job: Any) -> bytes:
    try:
        return DONE + pickle.dumps(work(job), pickle.HIGHEST_PROTOCOL)
    except Exception as error:
        reported = " ".join(f"{type(error).__name__}: {error}".split())
        return BROKEN + pickle.dumps((reported, "".join(traceback.format_exception(error))))


def _end_with_parent(life: int) -> None:
    while os.read(life, 1):
        pass
    os._exit(1)


def _ask_the_kernel(parent: int) -> None:
    if not parent or not sys.platform.startswith("linux"):
        return
    import ctypes

    death_signal = 1  # PR_SET_PDEATHSIG
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(death_signal, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
