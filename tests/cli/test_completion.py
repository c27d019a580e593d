"""Keys and words that shells complete."""

from __future__ import annotations

import contextlib
from pathlib import Path
from types import SimpleNamespace

import pytest

from cfmkit.cli import options, run_command

pytestmark = pytest.mark.lists


ROOT = Path(__file__).parents[2]


def completed(text, **named):
    return options.changes(SimpleNamespace(params=named), text)


def test_keys_of_set_are_those_of_the_family_on_the_command_line():
    cam = str(ROOT / "configs" / "cam.yaml")
    assert "mechanism.roller_radius=" in completed("mechanism.ro", spec=cam)
    assert all(word.startswith("mechanism.ro") for word in completed("mechanism.ro", spec=cam))
    assert "mechanism.bistable.length=" not in completed("mechanism.", spec=cam)
    assert "mechanism.bistable.length=" in completed("mechanism.b", spec="nowhere.yaml")
    assert "mechanism.bistable.length=" in completed("mechanism.b", specs=(str(ROOT / "configs/vcfm_pla.yaml"),))


@pytest.mark.parametrize("verb", ["sweep", "sensitivity"])
def test_vary_is_completed_with_the_same_keys(verb, monkeypatch, capsys):
    monkeypatch.setenv("_CFMKIT_COMPLETE", "complete_zsh")
    spec = ROOT / "configs" / "cam.yaml"
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", f"cfmkit {verb} {spec} --vary mechanism.roller_r")
    with contextlib.suppress(SystemExit):
        run_command([])
    assert "mechanism.roller_radius=" in capsys.readouterr().out


def test_after_the_sign_of_equality_come_the_words_of_a_closed_choice():
    found = completed("mechanism.positive.structure=", spec=str(ROOT / "configs/vcfm_pla.yaml"))
    assert "mechanism.positive.structure=diamond" in found
    assert completed("mechanism.positive.length=", spec=str(ROOT / "configs/vcfm_pla.yaml")) == []
