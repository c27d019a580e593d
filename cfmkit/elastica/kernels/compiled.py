"""The entry points as compiled code: compiled once, kept on disk, loaded when called."""

from __future__ import annotations

import contextlib
import ctypes
import logging
import struct
import sys
import threading
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.kernels import disk_cache, machine_code
from cfmkit.elastica.kernels.passing_arrays_by_address import HEAD, REFUSED, Kind, flat, objects
from cfmkit.elastica.kernels.signatures import DOORS, EACH, FORCES, MARCH, SOLVE, TANGENT
from cfmkit.elastica.kernels.workspace import held_slope_space, slope_space

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from cfmkit.elastica.kernels.network_array_types import DesignSlopes, DiscreteNetwork
    from cfmkit.elastica.kernels.workspace import WorkSpace

_Pair = ctypes.c_int64 * 2
_compiling = threading.Lock()
_LOG = logging.getLogger("cfmkit.elastica")

_PARTS = {
    "solver": "equilibria and paths",
    "states": "states along beams",
    "complex_states": "states along beams, complex",
    "slopes": "derivatives of equilibria",
    "row_slopes": "derivatives of states",
    "held_slopes": "derivatives of forces",
}
_LASTS = {"solver": "about 10 s", "slopes": "about 5 s"}


@contextlib.contextmanager
def reported(name: str) -> Iterator[Callable[[float], None]]:
    """Say that a door is compiled; yield what shows, on a terminal, the share that is done."""
    text = f"compiling the beam engine, once: {_PARTS[name]}, {_LASTS.get(name, 'a moment')}"
    if sys.stderr is None or not sys.stderr.isatty():
        _LOG.warning(text)
        yield lambda _share: None
        return

    def show(share: float) -> None:
        sys.stderr.write(f"\r{text}: {100 * share:.0f} %")
        sys.stderr.flush()

    show(0.0)
    try:
        yield show
    finally:
        sys.stderr.write("\r" + " " * (len(text) + 7) + "\r")
        sys.stderr.flush()


class Door:
    """A compiled function of one block of words, which returns two integers."""

    def __init__(self, name: str) -> None:
        """Be ready to load it."""
        self.name = name
        self._call: Callable[[bytes, Any], int] | None = None

    def __call__(self, *parts: bytes) -> tuple[int, int]:
        """Call it with numbers and places of arrays, which the caller holds.

        Raises
        ------
        TypeError
            If an array is not of the kind that it must be.
        """
        found = _Pair()
        if status := (self._call or self._ready())(HEAD + b"".join(parts), found):
            raise self._error(status)
        return found[0], found[1]

    def _error(self, status: int) -> Exception:
        kinds = [each for each in flat(DOORS[self.name]) if isinstance(each, Kind)]
        if not 0 <= status - REFUSED < len(kinds):
            return RuntimeError(f"the compiled function '{self.name}' failed")  # none of its operations can
        kind, number = kinds[status - REFUSED], status - REFUSED
        return TypeError(f"array {number} of '{self.name}': {kind.dtype}, {kind.ndim} axes, in C order")

    def _ready(self) -> Callable[[bytes, Any], int]:
        with _compiling:
            if self._call is None:
                self._call = _got(self.name)
            return self._call


def _got(name: str) -> Callable[[bytes, Any], int]:
    """Return a door's code: what is kept, else what numba makes of the sources now, in one process at a time."""
    if kept := _kept(name):
        return kept
    with disk_cache.one_at_a_time(name):
        return _kept(name) or _made(name)


def _kept(name: str) -> Callable[[bytes, Any], int] | None:
    """Return a door's code as it is kept; None if it has not been compiled here yet."""
    with contextlib.suppress(machine_code.Strange):
        if path := disk_cache.library(name):
            return machine_code.in_library(path)
    with contextlib.suppress(machine_code.Strange):
        if found := disk_cache.read(name):
            return machine_code.loaded(found)
    return None


def _made(name: str) -> Callable[[bytes, Any], int]:
    """Return a door's code as numba makes it now, and keep it."""
    with reported(name) as report:
        from cfmkit.elastica.kernels import build

        try:
            code = build.compiled(name, report)
            run = machine_code.loaded(code)
        except (AttributeError, TypeError, machine_code.Strange) as error:  # another version of numba or of LLVM
            _LOG.info("compiled code of '%s' cannot be kept (%s): it is compiled in every process", name, error)
            return machine_code.callable_at(build.called(name))
        disk_cache.write(name, code)
    return run


_doors = {name: Door(name) for name in DOORS}
_solver = _doors["solver"]
_numbers = struct.Struct("qqd").pack
_whole = struct.Struct("q").pack


def solve(
    m: DiscreteNetwork,
    n_free: int,
    y: Any,
    state: Any,
    border: Any,
    target: float,
    limits: Any,
    tangent: Any,
    scratch: WorkSpace,
) -> tuple[int, int]:
    """Solve for one equilibrium; see `cfmkit.elastica.kernels.newton.solve`."""
    arrays = (limits, y[None], border, tangent, state, _NONE, y)
    return _solver(_numbers(SOLVE, n_free, target), m.block, objects(arrays), scratch.block, scratch.marching)


def solve_each(
    m: DiscreteNetwork, n_free: int, ys: Any, drives: Any, limits: Any, changes: Any, scratch: WorkSpace
) -> None:
    """Solve at several drives; see `cfmkit.elastica.kernels.newton.solve_each`."""
    arrays = (limits, ys, drives, drives, drives, changes, drives)
    _solver(_numbers(EACH, n_free, 0.0), m.block, objects(arrays), scratch.block, scratch.marching)


def march(
    m: DiscreteNetwork,
    n_free: int,
    y: Any,
    drive: float,
    tangent: Any,
    targets: Any,
    options: Any,
    outs: Any,
    scratch: WorkSpace,
) -> tuple[int, int]:
    """Follow a path; see `cfmkit.elastica.kernels.march.march`; outs: unknowns, drives, info."""
    arrays = (options, outs[0], targets, tangent, outs[1], outs[2], y)
    return _solver(_numbers(MARCH, n_free, drive), m.block, objects(arrays), scratch.block, scratch.marching)


def forces(m: DiscreteNetwork, n_free: int, ys: Any, drives: Any, out: Any, scratch: WorkSpace) -> None:
    """Set residual forces and spring energy at points; see `cfmkit.elastica.kernels.forces_and_beam_states.forces`."""
    arrays = (drives, ys, drives, drives, drives, out, drives)
    _solver(_numbers(FORCES, n_free, 0.0), m.block, objects(arrays), scratch.block, scratch.marching)


def tangent(m: DiscreteNetwork, n_free: int, y: Any, drive: float, scratch: WorkSpace) -> None:
    """Set the first matrix of the work space to the Jacobian; see `forces_and_beam_states.tangent`."""
    arrays = (y, y[None], y, y, y, _NONE, y)
    _solver(_numbers(TANGENT, n_free, drive), m.block, objects(arrays), scratch.block, scratch.marching)


def states(m: DiscreteNetwork, n_free: int, ys: Any, drives: Any, out: Any) -> None:
    """Set the states along all beams at points, real or complex; see `forces_and_beam_states.states`."""
    door = _doors["complex_states" if ys.dtype.kind == "c" else "states"]
    door(_whole(n_free), m.block, objects((ys, drives, out)))


def slopes(
    m: DiscreteNetwork,
    design: DesignSlopes,
    n_free: int,
    ys: Any,
    drives: Any,
    outs: tuple[Any, Any],
    scratch: WorkSpace,
) -> bool:
    """Set the derivatives of solutions; see `cfmkit.elastica.kernels.design_derivatives.slopes`."""
    room = slope_space(m, design, len(scratch[0]) - 1)
    given = objects((ys, drives, *outs))
    return _doors["slopes"](_whole(n_free), m.block, design.block, given, scratch.block, objects(flat(room)))[0] == 1


def row_slopes(
    m: DiscreteNetwork, design: DesignSlopes, n_free: int, ys: Any, drives: Any, dys: Any, wanted: Any, out: Any
) -> None:
    """Set the derivatives of states along beams; see `cfmkit.elastica.kernels.design_derivatives.row_slopes`."""
    room = np.zeros(9 * dys.shape[2])
    _doors["row_slopes"](_whole(n_free), m.block, design.block, objects((ys, drives, dys, wanted, out, room)))


def held_slopes(
    m: DiscreteNetwork, design: DesignSlopes, n_free: int, ys: Any, drives: Any, dys: Any, out: Any
) -> None:
    """Set the derivatives of forces; see `cfmkit.elastica.kernels.design_derivatives.held_slopes`."""
    room = held_slope_space(m)
    given = objects((ys, drives, dys, out, *flat(room)))
    _doors["held_slopes"](_whole(n_free), m.block, design.block, given)


_NONE = np.zeros((0, 0))
