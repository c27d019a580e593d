"""The changes that docs/extending.md shows in full, applied to a copy of the package."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
CHANGES = re.findall(r"^--- (\S+)\n(.*?)(?=^--- |^```)", PAGE, re.M | re.S)
CODE = f"""
import cfmkit, cfmkit.specs.units as units
for damping in (0, 0.02):
    change = f"mechanism.springs.damping={{damping}} N*s/mm"
    result = cfmkit.analyze(cfmkit.load({str(ROOT / "configs" / "cam_dynamics.yaml")!r}, [change]))
    print(cfmkit.evaluate(result)["force_median"].value)
print(units.read_quantity("2 bar", "stress"), cfmkit.__file__)
"""


def changed(text, hunk):
    """Return a text after a hunk; what the hunk removes and keeps stands there once."""
    lines = hunk.splitlines(keepends=True)
    before, after = ("".join(line[1:] for line in lines if line[0] in signs) for signs in (" -", " +"))
    assert text.count(before) == 1, before
    return text.replace(before, after)


def test_the_changes_on_the_page_do_what_they_say(tmp_path):
    left_out = shutil.ignore_patterns("docs", "configs")
    shutil.copytree(ROOT / "cfmkit", tmp_path / "cfmkit", symlinks=True, ignore=left_out)
    assert len(CHANGES) == 4
    for name, hunks in CHANGES:
        file = tmp_path / "cfmkit" / name
        text = file.read_text(encoding="utf-8")
        for hunk in hunks.split("@@\n"):
            text = changed(text, hunk)
        file.write_text(text, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-c", CODE]
    printed = subprocess.check_output(command, env=environment, cwd=tmp_path, text=True)
    without, damped, bar, place = printed.split()
    assert place.startswith(str(tmp_path))
    assert float(damped) > float(without) > 10.0
    assert float(bar) == 2e5


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no clone")
def test_the_commits_that_the_page_names_exist():
    names = re.findall(r"`(?:git show )?([0-9a-f]{8})`", PAGE)
    assert len(names) == 5
    for name in names:
        subprocess.check_call(["git", "-C", str(ROOT), "cat-file", "-e", f"{name}^{{commit}}"])
