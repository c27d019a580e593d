"""What the tests of the output folder have in common."""

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
