"""Curves, results and axes to draw, and readers of what was drawn."""

from __future__ import annotations

from io import BytesIO

import numpy as np

from cfmkit.curves import Curve
from cfmkit.plots import axes_mm, new_figure
from cfmkit.results import Result, Status
from cfmkit.specs import Requirement, Spec


def axes():
    return axes_mm(new_figure(), (17, 12, 138, 80))


def picture(figure):
    """Return a figure as the bytes of a PNG."""
    file = BytesIO()
    figure.savefig(file, format="png", metadata={"Software": None})
    return file.getvalue()


def loop_curve(kind="force", gap=0.02):
    """Return a curve that rises within 10 mm (or 0.01 rad) and then falls by 4 % up to 100 mm."""
    motion = np.linspace(0.0, 0.1, 201)
    up = 50.0 * np.minimum(motion / 0.01, 1.0) * (1.0 - 0.4 * np.maximum(motion - 0.01, 0.0))
    effort = np.concatenate([up * (1 + gap), up[::-1] * (1 - gap)])
    branch = np.repeat(["load", "unload"], 201)
    return Curve(np.concatenate([motion, motion[::-1]]), effort, branch, np.ones(402, dtype=bool), kind=kind)


def result_of(*requirements, curve=None, target=50.0, name="test", **options):
    spec = Spec(family="any", name=name, requirements=tuple(Requirement(**item) for item in requirements))
    curves = (loop_curve() if curve is None else curve,)
    return Result(spec, options.pop("status", Status.COMPLETE), curves=curves, target=target, **options)


def data_lines(ax):
    """Return the points of the curves, without marks and leaders."""
    return [line for line in ax.lines if line.get_transform() == ax.transData and len(line.get_xdata()) > 2]


def band_boxes(ax):
    """Return (left, low, right, high) of every band that is shaded, in border units."""
    boxes = [item.get_paths()[0].get_extents().extents for item in ax.collections if item.get_gid() == "band"]
    return [tuple(float(value) for value in box) for box in boxes]


def flipped():
    curve = loop_curve()
    return Curve(curve.motion, -curve.effort, curve.branch, curve.stable)
