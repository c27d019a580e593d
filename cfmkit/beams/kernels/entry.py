"""The doors to the compiled code, cached on disk.

The kernels stand in several files: the kept code is named after a digest of all of them. Change any, and nothing old
is used.
"""

from __future__ import annotations

import contextlib
import logging
from pathlib import Path
from typing import Any

import numpy as np

from cfmkit.beams.kernels import columns as _columns
from cfmkit.beams.kernels import march as _march
from cfmkit.beams.kernels import newton as _newton
from cfmkit.beams.kernels import observe as _observe
from cfmkit.beams.kernels import output_slopes as _outputs
from cfmkit.beams.kernels.compiler import door
from cfmkit.beams.kernels.kept import digest

_follow, _solve, _each = _march.march, _newton.solve, _newton.solve_each
_forces, _states = _observe.forces, _observe.states
_tangent = _observe.tangent
_slopes, _row_slopes, _held_slopes = _columns.slopes, _outputs.row_slopes, _outputs.held_slopes


def _doors(stamp: str) -> tuple[Any, ...]:
    @door(stamp)
    def real(task, m, n_free, one, options, arrays, scratch):
        a, b, c, d, e, f = arrays
        if task == SOLVE:
            return _solve(m, n_free, a[0], d, b, one, (options[0], options[1]), c, scratch)
        if task == MARCH:
            return _follow(m, n_free, f, one, c, b, options, (a, d, e), scratch)
        if task == EACH:
            _each(m, n_free, a, d, (options[0], options[1]), b, scratch)
        elif task == TANGENT:
            _tangent(m, n_free, f, one, scratch)
        else:
            _forces(m, n_free, a, d, e, scratch)
        return 0, 0

    @door(stamp)
    def states(m, n_free, ys, drives, out):
        for p in range(ys.shape[0]):
            _states(m, n_free, ys[p], drives[p], out[p])

    @door(stamp)
    def slopes(m, tilt, n_free, ys, drives, outs, scratch):
        return _slopes(m, tilt, n_free, ys, drives, outs[0], outs[1], scratch)

    @door(stamp)
    def row_slopes(m, tilt, n_free, ys, drives, dys, out):
        for p in range(ys.shape[0]):
            _row_slopes(m, tilt, n_free, ys[p], drives[p], dys[p], out[p])

    @door(stamp)
    def held_slopes(m, tilt, n_free, ys, drives, dys, out):
        _held_slopes(m, tilt, n_free, ys, drives, dys, out)

    return real, states, slopes, row_slopes, held_slopes


SOLVE, MARCH, FORCES, TANGENT, EACH = range(5)
STAMP = digest()
_real, states, slopes, row_slopes, held_slopes = _doors(STAMP)


def announce() -> None:
    """Say so, once, where the engine has not been compiled yet from these sources."""
    kept = _real.stats.cache_path
    mark = None if kept is None else Path(kept) / f"beams-{STAMP[:16]}.compiled"
    if mark is not None and mark.exists():
        return
    often = "in every process, nothing can be kept on disk" if mark is None else "once"
    logging.getLogger("cfmkit.beams").warning("compiling the beam engine: %s, about half a minute", often)
    if mark is None:
        return
    with contextlib.suppress(OSError):
        mark.parent.mkdir(parents=True, exist_ok=True)
        mark.touch()


announce()


def solve(
    m: Any, n_free: int, y: Any, state: Any, border: Any, target: float, limits: Any, tangent: Any, scratch: Any
) -> tuple[int, int]:
    """Solve for one equilibrium; see `cfmkit.beams.kernels.newton.solve`."""
    result: tuple[int, int] = _real(
        SOLVE, m, n_free, target, limits, (y[None], border, tangent, state, _NONE, y), scratch
    )
    return result


def solve_each(m: Any, n_free: int, ys: Any, drives: Any, limits: Any, solved: Any, scratch: Any) -> None:
    """Solve at several drives; see `cfmkit.beams.kernels.newton.solve_each`."""
    _real(EACH, m, n_free, 0.0, limits, (ys, solved, drives, drives, _NONE, drives), scratch)


def march(
    m: Any, n_free: int, y: Any, drive: float, tangent: Any, targets: Any, options: Any, outs: Any, scratch: Any
) -> tuple[int, int]:
    """Follow a path; see `cfmkit.beams.kernels.march.march`; outs: unknowns, drives, info."""
    result: tuple[int, int] = _real(
        MARCH, m, n_free, drive, options, (outs[0], targets, tangent, outs[1], outs[2], y), scratch
    )
    return result


def forces(m: Any, n_free: int, ys: Any, drives: Any, out: Any, scratch: Any) -> None:
    """Set residual forces and spring energy at points; see `cfmkit.beams.kernels.observe.forces`."""
    _real(FORCES, m, n_free, 0.0, drives, (ys, drives, drives, drives, out, drives), scratch)


def tangent(m: Any, n_free: int, y: Any, drive: float, scratch: Any) -> None:
    """Set the first matrix of the work space to the Jacobian; see `cfmkit.beams.kernels.observe.tangent`."""
    _real(TANGENT, m, n_free, drive, y, (y[None], y, y, y, _NONE, y), scratch)


_NONE = np.zeros((0, 0))
