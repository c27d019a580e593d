"""Every configuration through the installed command: exit 0, with or without a design."""

from __future__ import annotations

from pathlib import Path

import pytest

import cfmkit
from cfmkit import families

CONFIGS = sorted((Path(__file__).parents[2] / "configs").glob("*.yaml"))


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_a_config_is_analysed_and_designed_with_exit_0(cli, path):
    spec = cfmkit.load(path)
    assert cli("analyze", str(path), "-o", "one", "-q", "--no-plots").code == 0
    if families.family(spec.family).design is None or spec.design is None:
        return
    assert cli("design", str(path), "-o", "two", "-q", "--no-plots").code == 0
    assert cli("analyze", "two/design.yaml", "-o", "three", "-q", "--no-plots").code == 0
    for name in ("metrics.json", "curve.csv"):
        assert (cli.folder / "two" / name).read_bytes() == (cli.folder / "three" / name).read_bytes(), name
