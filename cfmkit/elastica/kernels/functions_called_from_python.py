"""The functions that are called from Python: see `cfmkit.elastica.kernels.compiled`. Each returns two integers.

Importing this imports the compiler: only `cfmkit.elastica.kernels.build` does, where there is no compiled code yet.
"""

from __future__ import annotations

from cfmkit.elastica.kernels import design_derivatives as _design
from cfmkit.elastica.kernels import forces_and_beam_states as _observe
from cfmkit.elastica.kernels import march as _march
from cfmkit.elastica.kernels import newton as _newton
from cfmkit.elastica.kernels.signatures import EACH, MARCH, SOLVE, TANGENT

_follow, _solve, _each = _march.march, _newton.solve, _newton.solve_each
_forces, _states, _tangent = _observe.forces, _observe.states, _observe.tangent
_slopes, _row_slopes, _held_slopes = _design.slopes, _design.row_slopes, _design.held_slopes


def solver(task, n_free, one, m, options, arrays, scratch, room):
    """Solve, march, or set what holds at solved points."""
    a, b, c, d, e, f = arrays
    if task == SOLVE:
        return _solve(m, n_free, a[0], d, b, one, (options[0], options[1]), c, scratch)
    if task == MARCH:
        return _follow(m, n_free, f, one, c, b, options, (a, d, e), scratch, room)
    if task == EACH:
        _each(m, n_free, a, d, (options[0], options[1]), e, scratch, room)
    elif task == TANGENT:
        _tangent(m, n_free, f, one, scratch)
    else:
        _forces(m, n_free, a, d, e, scratch)
    return 0, 0


def states(n_free, m, ys, drives, out):
    """Set the states along all beams at points."""
    for p in range(ys.shape[0]):
        _states(m, n_free, ys[p], drives[p], out[p])
    return 0, 0


complex_states = states


def slopes(n_free, m, design, ys, drives, outs, scratch, room):
    """Set the derivatives of solutions; tell whether there are any."""
    regular = _slopes(m, design, n_free, ys, drives, outs[0], outs[1], scratch, room)
    return (1 if regular else 0), 0


def row_slopes(n_free, m, design, ys, drives, dys, wanted, out, room):
    """Set the derivatives of the states along beams at points, in the segments that are wanted there."""
    for p in range(ys.shape[0]):
        _row_slopes(m, design, n_free, ys[p], drives[p], dys[p], wanted[p], out[p], room)
    return 0, 0


def held_slopes(n_free, m, design, ys, drives, dys, out, room):
    """Set the derivatives of the forces on all degrees of freedom at points."""
    _held_slopes(m, design, n_free, ys, drives, dys, out, room)
    return 0, 0
