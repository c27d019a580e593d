"""Tracing: from a network and a drive to the path of its equilibria."""

from __future__ import annotations

from dataclasses import replace
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from cfmkit.beams.discretise import Mesh
from cfmkit.beams.drive import Control, Drive
from cfmkit.beams.layout import Layout
from cfmkit.curves import read_only

if TYPE_CHECKING:
    from cfmkit.beams.network import Network
    from cfmkit.beams.path import Path
    from cfmkit.beams.run import Run

_EARLY = 0.1  # share of the drive's range: segments that are too long before it are cut in four, later in two
_ROUNDS = 8  # meshes tried before giving up on the tolerance
_GAIN = 0.005  # share of the drive's range, or of the constant loads, that is some
_SURE = 1e-3  # error of a path that ends early from which on that may be the mesh's fault
_COILED = (
    4.0  # turn of an unloaded shape in one step [rad] up to which the step sees it: 14 kicks for two thirds of a turn
)
_STARTS = 4  # of them where nothing bears the constant loads, if each bears more of them than the one before


def trace(network: Network, drive: Drive, control: Control | None = None) -> Path:
    """Return the path of equilibria of a network under a drive, from rest through all points asked for.

    Parameters
    ----------
    network : Network
        What it is.
    drive : Displacement, Rotation or Loading
        What is done to it.
    control : Control, optional
        Accuracy, folds, branches.

    Returns
    -------
    Path
        Converged points only. `Path.status` says whether the path reaches all points asked for, and if not, why.
    """
    control = control or Control()
    if control.imperfection == 0.0:
        return _solved(network, drive, control).path()
    from cfmkit.beams.imperfection import imperfect

    perfect = replace(control, imperfection=0.0)
    bent, name = imperfect(_solved(network, drive, replace(perfect, branch="primary"), True), control.imperfection)
    path = _solved(bent, drive, perfect).path()
    branch = path.branch if bent is network else np.where(path.branch == "primary", "imperfect", path.branch)
    return replace(path, imperfection=name, branch=read_only(branch, np.str_))


def _solved(network: Network, drive: Drive, control: Control, to_first: bool = False) -> Run:
    """Return the run on the first mesh that reaches the tolerance, or on the last that is tried.

    to_first: only as far as the first bifurcation.
    """
    from cfmkit.beams import endings
    from cfmkit.beams.accuracy import estimate  # loads the compiler, as do the next two
    from cfmkit.beams.kernels.codes import STALLED
    from cfmkit.beams.path import PathStatus
    from cfmkit.beams.run import Run

    layout = Layout(network, drive)
    mesh, before, borne = first_mesh(layout, control.tolerance), None, -1.0
    for round_ in range(_ROUNDS):
        run = Run(layout, mesh, control, to_first)
        run.follow()
        if run.too_long and before is not None and not _further(run, before):
            endings.stop(run, STALLED)
        elif run.too_long and round_ < _ROUNDS - 1:
            before = run
            mesh = mesh.shorter(4 if _early(run) else 2)
            continue
        if run.status is PathStatus.NO_START and round_ < _STARTS and run.share > borne + _GAIN:
            mesh, borne = mesh.shorter(), run.share
            continue
        run.error = estimate(run)
        limit = control.tolerance if run.status is PathStatus.COMPLETE else min(control.tolerance, _SURE)
        if run.error <= limit or round_ == _ROUNDS - 1:
            break
        mesh = mesh.finer()
    return run


def _early(run: Run) -> bool:
    """Tell whether a run ended in the first part of the drive's range."""
    return not len(run.points) or abs(float(run.points.drive[-1])) < _EARLY * run.span


def _further(run: Run, before: Run) -> bool:
    """Tell whether shorter segments lead any further: a path drawn taut is followed by them just nearer to its end."""
    from cfmkit.beams.steady import taut

    if not taut(run) or not len(before.points) or run.asked() != before.asked():
        return True
    return abs(float(run.points.drive[-1] - before.points.drive[-1])) > _GAIN * run.span


def first_mesh(layout: Layout, tolerance: float) -> Mesh:
    """Return the mesh that is tried first for a tolerance: straight beams need fewer segments than curved ones.

    Coils need more steps than their loads do.
    """
    if tolerance >= 4e-6:
        mesh = Mesh(3 if tolerance < 2e-5 and layout.bundle.curved else 2, 1)
    else:
        mesh = Mesh(2, 2 if tolerance >= 1e-7 else 4)
    return replace(mesh, steps=max(mesh.steps, ceil(layout.turn / (mesh.segments * _COILED))))
