"""What the tests of the output folder have in common."""

import os

from cfmkit.errors import FolderInUse
from cfmkit.store import RunFolder

INFO = {"arguments": ["design", "cam.yaml"], "seed": 0, "status": "complete", "exit_code": 0}


def run(path, **files):
    """Do a whole run; names with `__` stand for a slash, `_` for the dot."""
    with RunFolder(path) as folder:
        for name, data in files.items():
            folder.write(name.replace("__", "/").replace("_", "."), data)
        folder.commit(INFO)
    return folder


def listing(path):
    return sorted(str(item.relative_to(path)) for item in path.rglob("*"))


def one_line(error):
    text = str(error.value)
    return "\n" not in text and len(text) < 700


def enter_and_leave(path, count, entered):
    """Begin and end runs over and over; count those that found the folder free."""
    for _ in range(count):
        try:
            with RunFolder(path) as folder:
                folder.write("a.csv", str(os.getpid()).encode())
                with entered.get_lock():
                    entered.value += 1
        except FolderInUse:
            pass
