"""The worker process of a pool: reads what to register, the work and then jobs from standard input.

It writes the outcomes to standard output, each with its length in front.

It ends when its parent does, however that ends: the thread that reads finds the end of the pipe, which the operating
system closes with the parent; on Linux the kernel is asked to end the process, too, in case a solver never lets that
thread run.
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
from queue import SimpleQueue
from typing import IO, Any

from cfmkit.studies.serial_and_cluster_executors import garbage_collector

WORKER_PROGRAM = (
    "import json, sys; given = json.loads(sys.argv[1]); sys.path[:] = given['path']; "
    "from cfmkit.studies.worker_process import main; main(given['parent'])"
)
"""The program of a worker; its only argument says where to find modules and whose process it is."""
READY_MESSAGE, STARTED_MESSAGE, DONE_MESSAGE, BROKEN_MESSAGE = b"r", b"s", b"d", b"b"
LENGTH_BYTES = 8


def send(pipe: IO[bytes] | None, message: bytes) -> None:
    """Write a message to a pipe."""
    assert pipe is not None
    pipe.write(len(message).to_bytes(LENGTH_BYTES, "little"))
    pipe.write(message)
    pipe.flush()


def receive(pipe: IO[bytes] | None) -> bytes | None:
    """Return the next message of a pipe; None if the process at its other end has gone."""
    assert pipe is not None
    head = pipe.read(LENGTH_BYTES)
    length = int.from_bytes(head, "little")
    message = pipe.read(length) if len(head) == LENGTH_BYTES else b""
    return message if head and len(message) == length else None


def main(
    parent: int,  # the parent's process id if the kernel may watch it, else 0
) -> None:
    """Serve jobs until the parent ends this process, or has gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore")
    _ask_the_kernel(parent)
    inlet, outlet = _pipes()
    received: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_read_on, args=(inlet, received), daemon=True).start()
    for register, added in pickle.loads(received.get()):
        register(added)
    work = pickle.loads(received.get())
    with contextlib.suppress(BrokenPipeError):
        _do_received_jobs(work, received, outlet)


def _pipes() -> tuple[IO[bytes], IO[bytes]]:
    """Return the pipes from and to the parent, which nothing else in this process or below it reads or writes.

    What a library prints must not get between the outcomes: it goes to standard error.
    """
    pipes = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nowhere, 0)
    os.dup2(sys.stderr.fileno(), 1)
    os.close(nowhere)
    return pipes


def _do_received_jobs(work: Any, received: SimpleQueue[bytes], outlet: IO[bytes]) -> None:
    send(outlet, READY_MESSAGE)
    with garbage_collector() as collect:
        while True:
            job = pickle.loads(received.get())
            send(outlet, STARTED_MESSAGE)
            send(outlet, _do_job(work, job))
            collect()


def _do_job(work: Any, job: Any) -> bytes:
    try:
        return DONE_MESSAGE + pickle.dumps(work(job), pickle.HIGHEST_PROTOCOL)
    except Exception as error:
        reported = " ".join(f"{type(error).__name__}: {error}".split())
        return BROKEN_MESSAGE + pickle.dumps((reported, "".join(traceback.format_exception(error))))


def _read_on(inlet: IO[bytes], received: SimpleQueue[bytes]) -> None:
    """Read on; end the process with its parent."""
    while (message := receive(inlet)) is not None:
        received.put(message)
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
