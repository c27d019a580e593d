"""Linux as far as it can stand in for Windows: what is missing there is missing, what fails there fails.

No file or folder can be replaced or removed while this process has it open, folders cannot be opened, descriptors are
not inherited, there is no `fcntl`, and a signal to another process ends it.
"""

import errno
import os
import signal
import subprocess
import sys

MISSING = [
    "O_DIRECTORY",
    "O_NOFOLLOW",
    "O_TMPFILE",
    "pread",
    "pwrite",
    "getuid",
    "geteuid",
    "killpg",
    "getpgid",
    "setsid",
]
MISSING += ["sched_getaffinity", "statvfs", "mkfifo"]
"""Libraries look at `sys.platform` before they call what else is missing."""

real = {name: getattr(os, name) for name in ("open", "unlink", "remove", "replace", "rename", "rmdir", "kill")}


def denied(path):
    raise PermissionError(errno.EACCES, "the process cannot access the file because it is in use", os.fspath(path))


def is_open(path):
    try:
        wanted = os.stat(path, follow_symlinks=False)
    except OSError:
        return False
    for name in os.listdir("/proc/self/fd"):
        try:
            if os.path.samestat(wanted, os.fstat(int(name))):
                return True
        except OSError:
            continue
    return False


def opened(path, flags, *rest, **more):
    if not isinstance(path, int) and os.path.isdir(path):
        denied(path)
    return real["open"](path, flags, *rest, **more)


def removed(path, **more):
    if not more and is_open(path):
        denied(path)
    return real["unlink"](path, **more)


def replaced(source, target, **more):
    if is_open(source) or is_open(target):
        denied(target)
    return real["replace"](source, target, **more)


def renamed(source, target, **more):
    if os.path.lexists(target):
        raise FileExistsError(errno.EEXIST, "the file exists", os.fspath(target))
    return replaced(source, target, **more)


def killed(process, number):
    return real["kill"](process, signal.Signals(9) if number == 0 else number)


class Popen(subprocess.Popen):
    def __init__(self, *arguments, **more):
        if more.get("pass_fds") or more.get("preexec_fn") or more.get("start_new_session"):
            raise ValueError("not supported on Windows platforms")
        super().__init__(*arguments, **more)


if sys.argv[:1] != ["-m"]:
    import filelock  # takes the place of the locks of Windows  # noqa: F401

    sys.modules["fcntl"] = None
    subprocess.Popen = Popen
    os.open, os.unlink, os.remove, os.replace, os.rename, os.kill = opened, removed, removed, replaced, renamed, killed
    for name in MISSING:
        if hasattr(os, name):
            delattr(os, name)
    for name in ("pthread_sigmask", "SIGHUP", "SIGQUIT", "SIGALRM", "SIGUSR1"):
        delattr(signal, name)
