"""The families in `plugins`, as if they were installed: for whoever runs the tests without installing them."""

from __future__ import annotations

import atexit
import os
import sys
import tempfile
import tomllib
from importlib.metadata import entry_points
from pathlib import Path

GROUP = "cfmkit.families"
PLUGINS = sorted(path.parent for path in (Path(__file__).parents[2] / "plugins").glob("*/pyproject.toml"))
CONFIGS = [path for plugin in PLUGINS for path in sorted((plugin / "configs").glob("*.yaml"))]


def register() -> None:
    """Put the packages that are not installed on the path, here and in child processes, with their entry points."""
    known = {point.dist.name for point in entry_points(group=GROUP) if point.dist is not None}
    missing = [plugin for plugin in PLUGINS if _project(plugin)["name"] not in known]
    if not missing:
        return
    folder = tempfile.TemporaryDirectory(prefix="cfmkit-plugins-")
    atexit.register(folder.cleanup)
    for plugin in missing:
        project = _project(plugin)
        info = Path(folder.name, f"{project['name'].replace('-', '_')}-{project['version']}.dist-info")
        info.mkdir()
        entries = project["entry-points"][GROUP]
        lines = [f"[{GROUP}]", *(f"{name} = {target}" for name, target in entries.items())]
        (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    added = [folder.name, *map(str, missing)]
    sys.path += added
    os.environ["PYTHONPATH"] = os.pathsep.join([*filter(None, [os.environ.get("PYTHONPATH")]), *added])


def _project(plugin: Path) -> dict:
    return tomllib.loads((plugin / "pyproject.toml").read_text())["project"]
