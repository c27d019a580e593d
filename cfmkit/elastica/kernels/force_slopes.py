"""Derivatives of the forces on degrees of freedom: of supports' frames and arms, loads, springs and ends of beams."""

from __future__ import annotations

import numpy as np

from cfmkit.elastica.kernels.chain import places_of, pose_of
from cfmkit.elastica.kernels.compiler import inlined, kernel
from cfmkit.elastica.kernels.springs import LINE, TURN, spring_law


@inlined
def value_slopes(m, design, k, drive, dz, values):
    """Set the derivatives of all degrees of freedom: dz of the free ones, the held ones as prescribed."""
    for i in range(values.shape[0]):
        slot = m.slot[i]
        values[i] = dz[slot, k] if slot >= 0 else design.base[k, i] + drive * design.rate[k, i]


@inlined
def value_changes(m, design, k, drive, values):
    """Set the derivatives of all degrees of freedom at unchanged unknowns."""
    for i in range(values.shape[0]):
        values[i] = 0.0 if m.slot[i] >= 0 else design.base[k, i] + drive * design.rate[k, i]


@inlined
def turned_force(m, design, k, i, pose, fx, fy, out):
    """Set the changes that an unchanged force at a place makes as its frame and arm turn; pose: see `pose_slope`."""
    dc, ds = design.frame[k, i, 0], design.frame[k, i, 1]
    out[0], out[1], out[2] = dc * fx + ds * fy, dc * fy - ds * fx, pose[5] * fy - pose[6] * fx


@inlined
def pose_slope(m, design, k, i, values, dvalues, out):
    """Set the derivative of a place's pose (out[:3]), its turned arm (out[3:5]) and that arm's derivative (out[5:])."""
    d = m.place_dof[i]
    fc, fs = m.place_frame[i, 0], m.place_frame[i, 1]
    dc, ds = design.frame[k, i, 0], design.frame[k, i, 1]
    a, b, da, db, turn = values[d[0]], values[d[1]], dvalues[d[0]], dvalues[d[1]], dvalues[d[2]]
    ct, st = np.cos(values[d[2]]), np.sin(values[d[2]])
    ax, ay, px, py = m.place_arm[i, 0], m.place_arm[i, 1], design.arm[k, i, 0], design.arm[k, i, 1]
    ox, oy = ct * ax - st * ay, st * ax + ct * ay
    sx, sy = ct * px - st * py - oy * turn, st * px + ct * py + ox * turn
    out[0] = design.origin[k, i, 0] + fc * da - fs * db + dc * a - ds * b + sx
    out[1] = design.origin[k, i, 1] + fs * da + fc * db + ds * a + dc * b + sy
    out[2] = dvalues[d[3]]
    out[3], out[4], out[5], out[6] = ox, oy, sx, sy


@kernel
def _spread(m, design, k, i, pose, force, dforce, sign, out):
    """Add the derivative of the forces that a force at a place makes on its degrees of freedom; pose: as set above."""
    d = m.place_dof[i]
    fc, fs = m.place_frame[i, 0], m.place_frame[i, 1]
    dc, ds = design.frame[k, i, 0], design.frame[k, i, 1]
    out[d[0]] += sign * (fc * dforce[0] + fs * dforce[1] + dc * force[0] + ds * force[1])
    out[d[1]] += sign * (fc * dforce[1] - fs * dforce[0] + dc * force[1] - ds * force[0])
    out[d[2]] += sign * (pose[3] * dforce[1] - pose[4] * dforce[0] + pose[5] * force[1] - pose[6] * force[0])
    out[d[3]] += sign * dforce[2]


@kernel
def load_slopes(m, design, k, values, dvalues, drive, w, out):
    """Add the derivatives of the point loads."""
    pose, force, dforce = w[0], w[1], w[2]
    for q in range(m.load_place.shape[0]):
        i = m.load_place[q]
        pose_slope(m, design, k, i, values, dvalues, pose)
        for r in range(3):
            force[r] = m.load_value[q, 0, r] + drive * m.load_value[q, 1, r]
            dforce[r] = design.load[k, q, 0, r] + drive * design.load[k, q, 1, r]
        if m.load_follows[q]:
            turn, by = values[m.place_dof[i, 3]], dvalues[m.place_dof[i, 3]]
            c, s = np.cos(turn), np.sin(turn)
            fx, fy = c * force[0] - s * force[1], s * force[0] + c * force[1]
            dx, dy = c * dforce[0] - s * dforce[1], s * dforce[0] + c * dforce[1]
            force[0], force[1], dforce[0], dforce[1] = fx, fy, dx - by * fy, dy + by * fx
        _spread(m, design, k, i, pose, force, dforce, 1.0, out)


@kernel
def _law_slope(kind, value, change, gap, force, dforce):
    """Add to `dforce` the derivative of a spring's force on its second place by its own values at unchanged places.

    gap: vector from the first place to the second; force: on the second.
    """
    k = value[0]
    if kind == TURN:
        dforce[2] += -change[0] * (gap[2] - value[1]) + k * change[1]
        return
    dx, dy = gap[0], gap[1]
    if kind == LINE:
        length = np.sqrt(dx * dx + dy * dy)
        if length > 0.0:
            pull = k * change[1] - change[0] * (length - value[1])
            dforce[0] += pull * dx / length
            dforce[1] += pull * dy / length
        return
    ex, ey = value[1], value[2]
    far = dx * ex + dy * ey - value[3]
    pull = -change[0] * far - k * (dx * change[1] + dy * change[2] - change[3])
    dforce[0] += pull * ex - k * far * change[1]
    dforce[1] += pull * ey - k * far * change[2]


@kernel
def spring_slopes(m, design, k, values, dvalues, w, out):
    """Add the derivatives of the springs' forces; return that of their energy."""
    pa, pb, force, dforce, block, gap = w[0], w[1], w[2], w[3], w[4:7, :3], w[7]
    sa, sb = w[8], w[9]
    places, energy = places_of(m), 0.0
    for q in range(m.spring_kind.shape[0]):
        i, j = m.spring_place[q, 0], m.spring_place[q, 1]
        pose_of(places, values, i, pa)
        pose_of(places, values, j, pb)
        pose_slope(m, design, k, i, values, dvalues, sa)
        pose_slope(m, design, k, j, values, dvalues, sb)
        spring_law(m.spring_kind[q], m.spring_value[q], 0.0, pa, pb, force, block)
        for r in range(3):
            gap[r] = pb[r] - pa[r]
            dforce[r] = 0.0
            for s in range(3):
                dforce[r] += block[r, s] * (sb[s] - sa[s])
            energy -= force[r] * (sb[r] - sa[r])
        value, change = m.spring_value[q], design.spring[k, q]
        _law_slope(m.spring_kind[q], value, change, gap, force, dforce)
        energy += _energy_slope(m.spring_kind[q], value, change, gap)
        _spread(m, design, k, i, sa, force, dforce, -1.0, out)
        _spread(m, design, k, j, sb, force, dforce, 1.0, out)
    return energy


@kernel
def _energy_slope(kind, value, change, gap):
    """Return the derivative of a spring's energy by its own values at unchanged places."""
    if kind == TURN:
        far, by = gap[2] - value[1], -change[1]
    elif kind == LINE:
        far, by = np.sqrt(gap[0] * gap[0] + gap[1] * gap[1]) - value[1], -change[1]
    else:
        far = gap[0] * value[1] + gap[1] * value[2] - value[3]
        by = gap[0] * change[1] + gap[1] * change[2] - change[3]
    return 0.5 * change[0] * far * far + value[0] * far * by


@kernel
def beam_slopes(m, design, k, y, n_free, values, dvalues, dstart, dend, w, out):
    """Add the derivatives of the forces at the ends of all beams; dstart, dend (beams, 3): those of the forces."""
    n = n_free + 3 * m.beam_end.shape[0]
    pose, force = w[0], w[1]
    for e in range(m.beam_end.shape[0]):
        own, last = n + 6 * m.beam_segment[e] + 3, n_free + 3 * e
        for r in range(3):
            force[r] = y[own + r]
        pose_slope(m, design, k, m.beam_end[e, 0], values, dvalues, pose)
        _spread(m, design, k, m.beam_end[e, 0], pose, force, dstart[e], 1.0, out)
        for r in range(3):
            force[r] = y[last + r]
        pose_slope(m, design, k, m.beam_end[e, 1], values, dvalues, pose)
        _spread(m, design, k, m.beam_end[e, 1], pose, force, dend[e], -1.0, out)
