"""The doors to the compiled code, see `cfmkit.beams.kernels.doors`: compiled once, kept on disk, loaded when used."""

from __future__ import annotations

import contextlib
import ctypes
import logging
import struct
import threading
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.beams.kernels import kept, machine
from cfmkit.beams.kernels.packing import addresses, complexes, flat, floats
from cfmkit.beams.kernels.signatures import DOORS, EACH, FORCES, MARCH, SOLVE, TANGENT
from cfmkit.beams.kernels.workspace import HELD_SLOPES, SLOPES, held_slope_space, slope_space

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.beams.kernels.model import Model, Tilt
    from cfmkit.beams.kernels.workspace import WorkSpace

_Pair = ctypes.c_int64 * 2
_compiling = threading.Lock()


class Door:
    """A compiled function of one block of words, which returns two integers."""

    def __init__(self, name: str) -> None:
        """Be ready to load it."""
        self.name = name
        self._call: Callable[[bytes, Any], int] | None = None

    def __call__(self, *parts: bytes) -> tuple[int, int]:
        """Call it."""
        found = _Pair()
        if (self._call or self._ready())(b"".join(parts), found):
            raise RuntimeError(f"the compiled function '{self.name}' failed")  # none of its operations can
        return found[0], found[1]

    def _ready(self) -> Callable[[bytes, Any], int]:
        with _compiling:
            if self._call is None:
                self._call = _got(self.name)
            return self._call


def _got(name: str) -> Callable[[bytes, Any], int]:
    """Return a door's code: what is kept, else what numba makes of the sources now."""
    with contextlib.suppress(machine.Strange):
        if path := kept.library(name):
            return machine.in_library(path)
    with contextlib.suppress(machine.Strange):
        if found := kept.read(name):
            return machine.loaded(found)
    _announce(name)
    from cfmkit.beams.kernels import build

    try:
        code = build.compiled(name)
        run = machine.loaded(code)
    except (AttributeError, TypeError, machine.Strange) as error:  # another version of numba or of LLVM
        _LOG.info("compiled code of '%s' cannot be kept (%s): it is compiled in every process", name, error)
        return machine.callable_at(build.called(name))
    kept.write(name, code)
    return run


_LOG = logging.getLogger("cfmkit.beams")
_LASTS = dict.fromkeys(DOORS, "a moment") | {"solver": "about 10 s", "slopes": "about 6 s"}
_PARTS = {
    "solver": "equilibria and paths",
    "states": "states along beams",
    "complex_states": "states along beams, complex",
    "slopes": "derivatives of equilibria",
    "row_slopes": "derivatives of states",
    "held_slopes": "derivatives of forces",
}


def _announce(name: str) -> None:
    _LOG.warning("compiling the beam engine, once: %s, %s", _PARTS[name], _LASTS[name])


_doors = {name: Door(name) for name in DOORS}
_solver = _doors["solver"]
_numbers = struct.Struct("qqd").pack
_whole = struct.Struct("q").pack
_SOLVER = (floats(1), floats(2), *(floats(1),) * 3, floats(2), floats(1))


def solve(
    m: Model,
    n_free: int,
    y: Any,
    state: Any,
    border: Any,
    target: float,
    limits: Any,
    tangent: Any,
    scratch: WorkSpace,
) -> tuple[int, int]:
    """Solve for one equilibrium; see `cfmkit.beams.kernels.newton.solve`."""
    arrays = (limits, y[None], border, tangent, state, _NONE, y)
    return _solver(
        _numbers(SOLVE, n_free, target), m.block, addresses(arrays, _SOLVER), scratch.block, scratch.marching
    )


def solve_each(m: Model, n_free: int, ys: Any, drives: Any, limits: Any, solved: Any, scratch: WorkSpace) -> None:
    """Solve at several drives; see `cfmkit.beams.kernels.newton.solve_each`."""
    arrays = (limits, ys, solved, drives, drives, _NONE, drives)
    _solver(_numbers(EACH, n_free, 0.0), m.block, addresses(arrays, _SOLVER), scratch.block, scratch.marching)


def march(
    m: Model,
    n_free: int,
    y: Any,
    drive: float,
    tangent: Any,
    targets: Any,
    options: Any,
    outs: Any,
    scratch: WorkSpace,
) -> tuple[int, int]:
    """Follow a path; see `cfmkit.beams.kernels.march.march`; outs: unknowns, drives, info."""
    arrays = (options, outs[0], targets, tangent, outs[1], outs[2], y)
    return _solver(_numbers(MARCH, n_free, drive), m.block, addresses(arrays, _SOLVER), scratch.block, scratch.marching)


def forces(m: Model, n_free: int, ys: Any, drives: Any, out: Any, scratch: WorkSpace) -> None:
    """Set residual forces and spring energy at points; see `cfmkit.beams.kernels.observe.forces`."""
    arrays = (drives, ys, drives, drives, drives, out, drives)
    _solver(_numbers(FORCES, n_free, 0.0), m.block, addresses(arrays, _SOLVER), scratch.block, scratch.marching)


def tangent(m: Model, n_free: int, y: Any, drive: float, scratch: WorkSpace) -> None:
    """Set the first matrix of the work space to the Jacobian; see `cfmkit.beams.kernels.observe.tangent`."""
    arrays = (y, y[None], y, y, y, _NONE, y)
    _solver(_numbers(TANGENT, n_free, drive), m.block, addresses(arrays, _SOLVER), scratch.block, scratch.marching)


def states(m: Model, n_free: int, ys: Any, drives: Any, out: Any) -> None:
    """Set the states along all beams at points, real or complex; see `cfmkit.beams.kernels.observe.states`."""
    imaginary = ys.dtype.kind == "c"
    door, of = (_doors["complex_states"], complexes) if imaginary else (_doors["states"], floats)
    door(_whole(n_free), m.block, addresses((ys, drives, out), (of(2), of(1), of(3))))


def slopes(m: Model, tilt: Tilt, n_free: int, ys: Any, drives: Any, outs: tuple[Any, Any], scratch: WorkSpace) -> bool:
    """Set the derivatives of solutions; see `cfmkit.beams.kernels.columns.slopes`."""
    room = slope_space(m, tilt, len(scratch[0]) - 1)
    given = addresses((ys, drives, *outs), (floats(2), floats(1), floats(3), floats(2)))
    spaces = addresses(flat(room), flat(SLOPES))
    return _doors["slopes"](_whole(n_free), m.block, tilt.block, given, scratch.block, spaces)[0] == 1


def row_slopes(m: Model, tilt: Tilt, n_free: int, ys: Any, drives: Any, dys: Any, out: Any) -> None:
    """Set the derivatives of states along beams; see `cfmkit.beams.kernels.output_slopes.row_slopes`."""
    room = np.zeros(9 * dys.shape[2])
    given = addresses((ys, drives, dys, out, room), (floats(2), floats(1), floats(3), floats(3), floats(1)))
    _doors["row_slopes"](_whole(n_free), m.block, tilt.block, given)


def held_slopes(m: Model, tilt: Tilt, n_free: int, ys: Any, drives: Any, dys: Any, out: Any) -> None:
    """Set the derivatives of forces; see `cfmkit.beams.kernels.output_slopes.held_slopes`."""
    given = addresses((ys, drives, dys, out), (floats(2), floats(1), floats(3), floats(3)))
    room = held_slope_space(m)
    spaces = addresses(flat(room), flat(HELD_SLOPES))
    _doors["held_slopes"](_whole(n_free), m.block, tilt.block, given, spaces)


_NONE = np.zeros((0, 0))
