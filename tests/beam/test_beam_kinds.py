"""Kinds of shapes, springs and loads are records that build what the engine has."""

from __future__ import annotations

from typing import get_args

import pytest

from cfmkit.families.beam.network_elements_spec import Load, LoadSpec, SpringElement, SpringSpec
from cfmkit.families.beam.shapes_spec import Shape, ShapeSpec

pytestmark = pytest.mark.lists


def test_every_kind_of_shape_spring_and_load_builds_what_the_engine_has():

    for union, base in ((ShapeSpec, Shape), (SpringSpec, SpringElement), (LoadSpec, Load)):
        kinds = get_args(get_args(union)[0])
        assert len(kinds) > 1
        assert all(issubclass(kind, base) and kind.build is not base.build for kind in kinds)
