"""Runs on a Linux from which everything is taken that Windows does not have: `support/windows_like`."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
WITHOUT_POSIX = os.environ | {"PYTHONPATH": str(ROOT / "tests/support/windows_like")}
SWEEP = ("sweep", "configs/cam_friction.yaml", "--vary", "mechanism.roller_radius=6mm:9mm:4", "-j", "2")


def cfmkit(*arguments, out):
    command = [sys.executable, "-m", "cfmkit", *arguments, "--no-plots", "-q", "-o", str(out)]
    return subprocess.run(command, cwd=ROOT, env=WITHOUT_POSIX, capture_output=True, text=True, check=False)


def test_a_study_is_written_and_replaced_without_what_only_posix_has(tmp_path):
    """In several processes, whose pipes and locks differ most; the second run reads the journal of the first."""
    for _ in range(2):
        done = cfmkit(*SWEEP, out=tmp_path / "out")
        assert (done.returncode, done.stderr) == (0, "")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {".cfmkit-journal.sqlite", "manifest.json", "metrics.json", "resolved.yaml", "results.csv"}
