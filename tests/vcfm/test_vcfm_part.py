"""What is cut of a mechanism of leaves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shapely import Polygon

import cfmkit
from cfmkit.errors import GeometryError
from cfmkit.families.vcfm import part

CONFIGS = Path(__file__).parents[2] / "configs"


def test_levels_of_cosine_leaves_touch_where_they_are_steepest():
    """The contours of leaves that just do not overlap do not cross, those of a bit less do."""
    mechanism = cfmkit.load(CONFIGS / "vcfm_cosine.yaml")
    with pytest.raises(GeometryError) as refused:
        cfmkit.drawing(mechanism.replace({"mechanism.frame.spacing": "0.5 mm"}))
    least = float(str(refused.value).partition("touch at ")[2].split(" mm")[0])

    def between(spacing: float) -> Any:
        wider = mechanism.replace({"mechanism.frame.spacing": f"{spacing} mm"})
        law, sides = part._leaf_law(wider), ((1.0, 0), (-1.0, 1))
        edges = [np.concatenate([item.points for item in part._edge(law, side, (0.0, level * 1e-3 * spacing))])
                 for side, level in sides]  # fmt: skip
        return Polygon(np.concatenate([edges[0], edges[1][::-1]]))

    assert between(1.01 * least).is_valid
    assert not between(0.99 * least).is_valid
