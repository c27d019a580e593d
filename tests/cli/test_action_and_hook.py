"""The action and the hook call commands and options that exist."""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import fields
from pathlib import Path

import pytest
import yaml

from cfmkit.cli.verbs.batch import BatchOptions

ROOT = Path(__file__).parents[2]


def test_the_action_and_the_hook_call_commands_that_exist():
    """What a runner would do with the action is done here with the shell of its last step."""
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    (step,) = (one for one in action["runs"]["steps"] if one.get("id") == "batch")
    words = step["run"].replace("\\\n", " ")
    known = {f"--{option.name.replace('_', '-')}" for option in fields(BatchOptions)}
    assert set(re.findall(r"--[a-z-]+", words)) <= known
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
    assert hook["entry"] == "cfmkit check"
    checked = subprocess.run(["bash", "-n", "-c", step["run"]], env=os.environ, check=False)
    assert checked.returncode == 0


def test_the_action_passes_specifications_and_options_on_as_they_were_written(tmp_path):
    """Its step runs in a shell, as a runner runs it, with a cfmkit that notes what it was given and fails."""
    (step,) = (one for one in yaml.safe_load((ROOT / "action.yml").read_text())["runs"]["steps"] if "id" in one)
    (tmp_path / "cfmkit").write_text("#!/bin/sh\nprintf '%s\\n' \"$@\"\nexit 5\n")
    (tmp_path / "cfmkit").chmod(0o755)
    given = {"SPECS": "my parts/**/*.yaml\n\n  b.yaml\n", "OUT": "out dir", "OPTIONS": "--report\n--seed 3\n"}
    runner = {name: str(tmp_path / name) for name in ("GITHUB_STEP_SUMMARY", "GITHUB_OUTPUT")}
    ran = subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
        env=os.environ | given | runner | {"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
    )
    words = ran.stdout.splitlines()
    assert (ran.returncode, ran.stderr) == (5, "")
    assert words[:5] == ["batch", "my parts/**/*.yaml", "b.yaml", "--out", "out dir"]
    assert words[-3:] == ["--report", "--seed", "3"]
    assert (tmp_path / "GITHUB_OUTPUT").read_text() == "exit-code=5\n"


def test_a_batch_that_fails_is_kept_in_the_cache_of_the_action():
    steps = yaml.safe_load((ROOT / "action.yml").read_text())["runs"]["steps"]
    (saved,) = (one for one in steps if one.get("uses", "").startswith("actions/cache/save@"))
    (restored,) = (one for one in steps if one.get("uses", "").startswith("actions/cache/restore@"))
    assert saved["if"] == "always()"
    assert saved["with"] == {name: restored["with"][name] for name in ("path", "key")}


@pytest.mark.parametrize(
    ("name", "left_out"), [(".github/workflows/a.yml", True), (".pre-commit-config.yaml", True), ("a/b.yaml", False)]
)
def test_the_hook_leaves_alone_what_other_tools_read(name, left_out):
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
    assert bool(re.search(hook["exclude"], name)) is left_out
