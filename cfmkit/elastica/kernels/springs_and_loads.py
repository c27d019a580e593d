"""Springs and loads at attachments: their forces and exact tangents."""

from __future__ import annotations

import numpy as np

from cfmkit.elastica.kernels.chain import places_of, pose_of
from cfmkit.elastica.kernels.compiler import inlined, kernel
from cfmkit.elastica.kernels.dense import clear
from cfmkit.elastica.kernels.network_array_types import (
    DIRECTION_X,
    DIRECTION_Y,
    REST,
    REST_GAP,
    SLIDE,
    STIFFNESS,
    TIGHTENING,
    TURN,
)
from cfmkit.elastica.kernels.status_codes import BLOCK, JACOBIANS, OF_LOADS, OF_SPRINGS, VECTORS


@kernel
def jacobian(frames, i, arm, jac):
    """Set the 3 x 4 derivative of the pose of attachment i by its degrees of freedom."""
    fc, fs = frames[i, 0], frames[i, 1]
    clear(jac)
    jac[0, 0], jac[0, 1], jac[0, 2] = fc, -fs, -arm[1]
    jac[1, 0], jac[1, 1], jac[1, 2] = fs, fc, arm[0]
    jac[2, 3] = 1.0


@inlined
def wires_of(m):
    """Return where forces and their derivatives go: all that the functions below need (the model is slow to pass)."""
    return m.place_dof, m.slot, m.rate


@inlined
def acts(wires, i):
    """Tell whether a degree of freedom moves: freely or with the drive."""
    return wires[1][i] >= 0 or wires[2][i] != 0.0


@inlined
def add_entry(wires, h, i, j, value):
    """Add d(residual i)/d(dof j) to the system; driven degrees of freedom go to the drive's column."""
    _, slots, rates = wires
    row = slots[i]
    if row >= 0:
        column = slots[j]
        if column >= 0:
            h[row, column] += value
        else:
            h[row, h.shape[0] - 1] += value * rates[j]


@kernel
def add_block(wires, h, i, j, left, block, right):
    """Add left^T block right for the degrees of freedom of attachments i and j."""
    dofs, slots, _ = wires
    for b in range(4):
        if not acts(wires, dofs[j, b]):
            continue
        p = q = t = 0.0
        for s in range(3):
            p += block[0, s] * right[s, b]
            q += block[1, s] * right[s, b]
            t += block[2, s] * right[s, b]
        for a in range(4):
            if slots[dofs[i, a]] >= 0:
                add_entry(wires, h, dofs[i, a], dofs[j, b], left[0, a] * p + left[1, a] * q + left[2, a] * t)


@kernel
def add_force(wires, h, residual, i, arm, jac, force):
    """Add a force (fx, fy, moment) at attachment i to the residual, with the part of the tangent that its arm makes."""
    d = wires[0][i]
    for a in range(4):
        residual[d[a]] += jac[0, a] * force[0] + jac[1, a] * force[1] + jac[2, a] * force[2]
    add_entry(wires, h, d[2], d[2], -(arm[0] * force[0] + arm[1] * force[1]))


@kernel
def add_loads(m, values, drive, h, residual, work):
    """Add the point loads, dead or turning with their node."""
    vectors, jacobians = work[VECTORS], work[JACOBIANS]
    pose, jac, force, column = vectors[OF_LOADS, 0], jacobians[0], vectors[OF_LOADS, 1], vectors[OF_LOADS, 2]
    n = h.shape[0] - 1
    places, wires = places_of(m), wires_of(m)
    for k in range(m.load_place.shape[0]):
        i = m.load_place[k]
        arm = pose_of(places, values, i, pose)
        jacobian(m.place_frame, i, arm, jac)
        for r in range(3):
            force[r] = m.load_value[k, 0, r] + drive * m.load_value[k, 1, r]
            column[r] = m.load_value[k, 1, r]
        if m.load_follows[k]:
            _turn(force, pose[2])
            _turn(column, pose[2])
        add_force(wires, h, residual, i, arm, jac, force)
        d = m.place_dof[i]
        for a in range(4):
            row = m.slot[d[a]]
            if row >= 0:
                h[row, n] += jac[0, a] * column[0] + jac[1, a] * column[1] + jac[2, a] * column[2]
            if m.load_follows[k]:
                add_entry(wires, h, d[a], d[3], -jac[0, a] * force[1] + jac[1, a] * force[0])


@kernel
def _turn(force, angle):
    c, s = np.cos(angle), np.sin(angle)
    force[0], force[1] = c * force[0] - s * force[1], s * force[0] + c * force[1]


@kernel
def spring_law(kind, value, more, pa, pb, force, block):
    """Set the force on place b and its derivative by the pose of b (that by a is opposite); return the energy.

    more: what is added to the free length, angle or gap.
    """
    clear(block)
    force[0] = force[1] = force[2] = 0.0
    k = value[STIFFNESS]
    if kind == TURN:
        gap = pb[2] - pa[2] - value[REST] - more
        force[2] = -k * gap
        block[2, 2] = -k
        return 0.5 * k * gap * gap
    dx, dy = pb[0] - pa[0], pb[1] - pa[1]
    if kind == SLIDE:
        ex, ey = value[DIRECTION_X], value[DIRECTION_Y]
        gap = dx * ex + dy * ey - value[REST_GAP] - more
        across = 0.0
    else:
        length = np.sqrt(dx * dx + dy * dy)
        gap = length - value[REST] - more
        if length > 0.0:
            ex, ey, across = dx / length, dy / length, k * gap / length
        else:
            ex, ey, across = 0.0, 0.0, k
    force[0], force[1] = -k * gap * ex, -k * gap * ey
    block[0, 0] = -k * ex * ex - across * ey * ey
    block[0, 1] = (across - k) * ex * ey
    block[1, 0] = block[0, 1]
    block[1, 1] = -k * ey * ey - across * ex * ex
    return 0.5 * k * gap * gap


@kernel
def _tighten(wires, h, places, jacobians, kind, value, poses):
    """Add to the drive's column what a spring does whose free length, angle or gap changes with it."""
    dofs, slots, _ = wires
    ex = ey = turn = 0.0
    if kind == TURN:
        turn = 1.0
    elif kind == SLIDE:
        ex, ey = value[DIRECTION_X], value[DIRECTION_Y]
    else:
        dx, dy = poses[1][0] - poses[0][0], poses[1][1] - poses[0][1]
        length = np.sqrt(dx * dx + dy * dy)
        if length > 0.0:
            ex, ey = dx / length, dy / length
    pull, n = value[STIFFNESS] * value[TIGHTENING], h.shape[0] - 1
    for side in range(2):
        jac, sign = jacobians[side], 1.0 if side == 1 else -1.0
        for a in range(4):
            row = slots[dofs[places[side], a]]
            if row >= 0:
                h[row, n] += sign * pull * (jac[0, a] * ex + jac[1, a] * ey + jac[2, a] * turn)


@kernel
def add_springs(m, values, drive, h, residual, work):
    """Add the springs; return their energy."""
    vectors, jacobians, block = work[VECTORS], work[JACOBIANS], work[BLOCK]
    pa, pb, force = vectors[OF_SPRINGS, 0], vectors[OF_SPRINGS, 1], vectors[OF_SPRINGS, 2]
    ja, jb = jacobians[0], jacobians[1]
    places, wires = places_of(m), wires_of(m)
    energy = 0.0
    for k in range(m.spring_kind.shape[0]):
        i, j = m.spring_place[k, 0], m.spring_place[k, 1]
        arm_a, arm_b = pose_of(places, values, i, pa), pose_of(places, values, j, pb)
        jacobian(m.place_frame, i, arm_a, ja)
        jacobian(m.place_frame, j, arm_b, jb)
        value = m.spring_value[k]
        energy += spring_law(m.spring_kind[k], value, drive * value[TIGHTENING], pa, pb, force, block)
        if value[TIGHTENING] != 0.0:
            _tighten(wires, h, m.spring_place[k], (ja, jb), m.spring_kind[k], value, (pa, pb))
        add_force(wires, h, residual, j, arm_b, jb, force)
        for r in range(3):
            force[r] = -force[r]
        add_force(wires, h, residual, i, arm_a, ja, force)
        add_block(wires, h, i, i, ja, block, ja)
        add_block(wires, h, j, j, jb, block, jb)
        for r in range(3):
            for s in range(3):
                block[r, s] = -block[r, s]
        add_block(wires, h, i, j, ja, block, jb)
        add_block(wires, h, j, i, jb, block, ja)
    return energy
