"""Every configuration through the installed command: exit 0, with or without a design."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import cfmkit
from cfmkit import families

CONFIGS = sorted((Path(__file__).parents[2] / "configs").glob("*.yaml"))
LONG = ("beam_design_lan",)


def _cases():
    return [pytest.param(path, marks=pytest.mark.slow) if path.stem in LONG else path for path in CONFIGS]


def metrics(folder):
    """Return what metrics.json holds, its numbers and its warnings; a design may add to both what it alone knows."""
    document = json.loads((folder / "metrics.json").read_text())
    return document, document.pop("metrics"), {item["name"] for item in document.pop("warnings")}


@pytest.mark.parametrize("path", _cases(), ids=lambda path: path.stem)
def test_a_config_is_analysed_and_designed_with_exit_0(cli, path):
    spec = cfmkit.load(path)
    assert cli("analyze", str(path), "-o", "one", "-q", "--no-plots").code == 0
    if families.family(spec.family).design is None or spec.design is None:
        return
    assert cli("design", str(path), "-o", "two", "-q", "--no-plots").code == 0
    assert cli("analyze", "two/design.yaml", "-o", "three", "-q", "--no-plots").code == 0
    (designed, more, told), (analysed, numbers, found) = (metrics(cli.folder / name) for name in ("two", "three"))
    assert designed == analysed
    assert numbers == {name: more[name] for name in numbers}
    assert found <= told
    assert (cli.folder / "two/curve.csv").read_bytes() == (cli.folder / "three/curve.csv").read_bytes()
