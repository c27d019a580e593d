"""The initial-value problem of a Reissner beam, with its exact derivatives.

With psi the reference angle plus the rotation phi, (h, v) the force and M the moment that the part after a
section exerts on the part before it, N = h cos psi + v sin psi and Q = v cos psi - h sin psi [beam theory of
Reissner (1972)]:

    phi' = M/EI,   x' = (1 + N/EA) cos psi - Q/GA sin psi,   y' = (1 + N/EA) sin psi + Q/GA cos psi,
    M' = y' h - x' v,   (h, v)' = -w

by the arc length; w is a dead load per reference length. The equations are integrated by the symmetric splitting of
`cfmkit.elastica.kernels.symplectic_splitting_coefficients`, from a table that does not depend on the state: see
`cfmkit.elastica.kernels.network_array_types.DiscreteNetwork`.

Derivatives are those of the discrete solution. That by the rotation at the start follows from the others, since the
whole segment may be turned together with its force.
"""

from __future__ import annotations

import numpy as np

from cfmkit.elastica.kernels.compiler import inlined, kernel
from cfmkit.elastica.kernels.network_array_types import ANGLE, BENDING, LENGTH, RUN, SHEAR, STRETCH, TABLE_COLUMNS
from cfmkit.elastica.kernels.symplectic_splitting_coefficients import ROWS
from cfmkit.elastica.kernels.wide_strip import strip_drift

COLUMNS = 5  # of a row of a segment's outcome: a value, then its derivatives by the start's rotation, h, v and M
BY_ROTATION, BY_H, BY_V, BY_M = range(1, COLUMNS)
PHI, MOMENT, X, Y = range(0, 4 * COLUMNS, COLUMNS)  # where the rows of a segment's outcome begin
FORCE, DRIVEN = 20, 22  # of a segment's outcome: h and v at its end, derivatives by the drive; see `flow`
WX, WY, WX_RATE, WY_RATE = range(4)  # a line load, and by how much it grows with the drive
_CLOSING = ROWS - 1


@inlined
def sincos(x):
    """Return sine and cosine to rounding, without branches: as in fdlibm, reduced by two words of pi/2."""
    n = np.floor(x * 0.6366197723675814 + 0.5)
    r = (x - n * 1.5707963267341256) - n * 6.077100506506192e-11
    z = r * r
    s = 1.58969099521155e-10 * z - 2.5050760253406863e-08
    s = ((s * z + 2.7557313707070068e-06) * z - 1.984126982985795e-04) * z + 8.33333333332249e-03
    s = r + r * z * (s * z - 1.6666666666666632e-01)
    c = -1.1359647557788195e-11 * z + 2.0875723212981748e-09
    c = ((c * z - 2.7557314351390663e-07) * z + 2.480158728947673e-05) * z - 1.388888888887411e-03
    c = 1.0 - 0.5 * z + z * z * (c * z + 4.1666666666666602e-02)
    q = int(n) & 3
    odd = (q & 1) != 0
    first, second = c if odd else s, s if odd else c
    return (1.0 - (q & 2)) * first, (1.0 - ((q + 1) & 2)) * second


@inlined
def _drift(w, q):
    """Return (phi, M, x, y), or a derivative of them, after a drift."""
    return q[0] + w * q[1], q[1], q[2], q[3]


@inlined
def _drift_all(w, a):
    """Return a segment's state and its derivatives by h, v and M after a drift."""
    return _drift(w, a[0]), _drift(w, a[1]), _drift(w, a[2]), _drift(w, a[3])


@inlined
def _carry(q, by, dm, dx, dy):
    """Return a derivative after a kick: `by` says how M, x and y change with the rotation, the rest is its own."""
    return q[0], q[1] + (by[0] * q[0] + dm), q[2] + (by[1] * q[0] + dx), q[3] + (by[2] * q[0] + dy)


@inlined
def _kick(table, step, i, h, v, a):
    """Return a segment's state and derivatives after the kick of a row, and what `_carry` needs for further ones.

    That is how M, x and y change with the rotation, and how x and y change with the force: by h, by both, by v.
    """
    phi, moment, px, py = a[0]
    s, c = sincos(table[step, i, ANGLE] + phi)
    length, pull, slide = table[step, i, LENGTH], table[step, i, STRETCH], table[step, i, SHEAR]
    normal, shear = h * c + v * s, v * c - h * s
    along, across = length + pull * normal, slide * shear
    x, y = along * c - across * s, along * s + across * c
    less, more = along - slide * normal, (pull - slide) * shear
    xt, yt = more * c - less * s, less * c + more * s
    by = (h * yt - v * xt, xt, yt)
    hh, hv, vv = pull * c * c + slide * s * s, (pull - slide) * c * s, pull * s * s + slide * c * c
    after = (
        (phi, moment + (h * y - v * x), px + x, py + y),
        _carry(a[1], by, -xt, hh, hv),
        _carry(a[2], by, -yt, hv, vv),
        _carry(a[3], by, 0.0, 0.0, 0.0),
    )
    return after, by, (hh, hv, vv)


@inlined
def _begin(start):
    """Return a segment's state and derivatives at its start: rotation, h, v, M."""
    none = (0.0, 0.0, 0.0, 0.0)
    return (start[0], start[3], 0.0, 0.0), none, none, (0.0, 1.0, 0.0, 0.0)


@inlined
def _end(h, v, a, out):
    """Store the outcome of a segment without a line load; its turn as a whole tells the derivative by the rotation."""
    for k in range(4):
        row = COLUMNS * k
        out[row], out[row + BY_H], out[row + BY_V], out[row + BY_M] = a[0][k], a[1][k], a[2][k], a[3][k]
        out[row + BY_ROTATION] = v * a[1][k] - h * a[2][k]
    out[PHI + BY_ROTATION] += 1.0
    out[X + BY_ROTATION] -= a[0][3]
    out[Y + BY_ROTATION] += a[0][2]
    out[FORCE], out[FORCE + 1] = h, v


@inlined
def _acts(load):
    """Tell whether there is a line load, or will be one as the drive grows."""
    return load[WX] != 0.0 or load[WY] != 0.0 or load[WX_RATE] != 0.0 or load[WY_RATE] != 0.0


@kernel
def flow(table, steps, starts, loads, outs):
    """Integrate over two segments with derivatives, side by side: each waits for its own results half of the time.

    steps: the first of each and how many both have; starts: rotation, h, v, M at the start of each; loads: (wx, wy)
    of the line load on each, and by how much it grows with the drive. The outcome of each goes to its row of outs
    (2 of 28): phi, M, X, Y in rows of 5: value, then derivatives by rotation, h, v, M; then the force h, v at the
    end, and the derivatives of X, Y, phi, h, v, M by the drive. X and Y count from the start.
    """
    (one, other), (p, q) = starts, loads
    if table.shape[2] > TABLE_COLUMNS or _acts(p) or _acts(q):
        _loaded(table, steps[0], steps[2], one, p, outs[0])
        _loaded(table, steps[1], steps[2], other, q, outs[1])
        return
    a, b = _begin(one), _begin(other)
    for step in range(steps[2]):
        for i in range(_CLOSING):
            a = _drift_all(table[steps[0] + step, i, BENDING], a)
            b = _drift_all(table[steps[1] + step, i, BENDING], b)
            a, _, _ = _kick(table, steps[0] + step, i, one[1], one[2], a)
            b, _, _ = _kick(table, steps[1] + step, i, other[1], other[2], b)
        a = _drift_all(table[steps[0] + step, _CLOSING, BENDING], a)
        b = _drift_all(table[steps[1] + step, _CLOSING, BENDING], b)
    _end(one[1], one[2], a, outs[0])
    _end(other[1], other[2], b, outs[1])


@inlined
def _wide_drift(table, step, i, a):
    """Return a segment's state and its derivatives after the drift of a row, and the slope of its turn by the moment.

    Where no beam is a wide strip the turn is the moment times that slope.
    """
    if table.shape[2] == TABLE_COLUMNS:
        w = table[step, i, BENDING]
        return _drift_all(w, a), w
    phi, moment, x, y = a[0]
    turn, slope, _ = strip_drift(table, step, i, moment)
    return ((phi + turn, moment, x, y), _drift(slope, a[1]), _drift(slope, a[2]), _drift(slope, a[3])), slope


@kernel
def _loaded(table, first, count, start, load, out):
    """Integrate over one segment, a wide strip or one under a line load, with derivatives; loads keep direction."""
    # the latter two are the derivatives by the rotation at the start and by the drive
    a, turned, driven = _begin(start), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)
    h, v, dh, dv = start[1], start[2], 0.0, 0.0
    for step in range(first, first + count):
        for i in range(_CLOSING):
            run = table[step, i, RUN]
            a, w = _wide_drift(table, step, i, a)
            a, by, (hh, hv, vv) = _kick(table, step, i, h - load[WX] * run, v - load[WY] * run, a)
            turned = _carry(_drift(w, turned), by, 0.0, 0.0, 0.0)
            p, q = dh - load[WX_RATE] * run, dv - load[WY_RATE] * run
            driven = _carry(_drift(w, driven), by, -by[1] * p - by[2] * q, hh * p + hv * q, hv * p + vv * q)
        run = table[step, _CLOSING, RUN]
        a, w = _wide_drift(table, step, _CLOSING, a)
        turned, driven = _drift(w, turned), _drift(w, driven)
        h, v = h - load[WX] * run, v - load[WY] * run
        dh, dv = dh - load[WX_RATE] * run, dv - load[WY_RATE] * run
    _end(h, v, a, out)
    for k in range(4):
        out[COLUMNS * k + BY_ROTATION] = turned[k]
    out[DRIVEN], out[DRIVEN + 1], out[DRIVEN + 2] = driven[2], driven[3], driven[0]
    out[DRIVEN + 3], out[DRIVEN + 4], out[DRIVEN + 5] = dh, dv, driven[1]


@kernel
def plain_flow(table, steps, start, load, states):
    """Integrate without derivatives; works on complex numbers too (derivatives by complex steps).

    start: phi, h, v, M; states (n + 1, 7): phi, M, X, Y, h, v and strain energy at the step boundaries, or (1, 7)
    those at the end alone.
    """
    first, last = steps
    every, wide = (1 if states.shape[0] > 1 else 0), table.shape[2] > TABLE_COLUMNS
    zero = start[0] * 0.0
    phi, moment, x, y, energy = start[0] + zero, start[3] + zero, zero, zero, zero
    begin_h, begin_v = start[1] + zero, start[2] + zero
    for step in range(first, last):
        _set_row(states[every * (step - first)], phi, moment, x, y, begin_h, begin_v, energy)
        for i in range(ROWS):
            w, run = table[step, i, BENDING], table[step, i, RUN]
            h, v = begin_h - load[WX] * run, begin_v - load[WY] * run
            if wide:
                turn, _, stored = strip_drift(table, step, i, moment)
                phi += turn
                energy += stored
            else:
                phi += w * moment
                energy += 0.5 * w * moment * moment
            if i < _CLOSING:
                length, pull, slide = table[step, i, LENGTH], table[step, i, STRETCH], table[step, i, SHEAR]
                c, s = np.cos(table[step, i, ANGLE] + phi), np.sin(table[step, i, ANGLE] + phi)
                normal, shear = h * c + v * s, v * c - h * s
                along, across = length + pull * normal, slide * shear
                dx, dy = along * c - across * s, along * s + across * c
                moment += h * dy - v * dx
                x += dx
                y += dy
                energy += 0.5 * (pull * normal * normal + slide * shear * shear)
            else:
                begin_h, begin_v = h, v
    _set_row(states[every * (last - first)], phi, moment, x, y, begin_h, begin_v, energy)


@kernel
def _set_row(row, phi, moment, x, y, h, v, energy):
    row[0], row[1], row[2], row[3], row[4], row[5], row[6] = phi, moment, x, y, h, v, energy


__all__ = ["COLUMNS", "DRIVEN", "FORCE", "flow", "plain_flow", "sincos"]
