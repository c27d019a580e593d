"""Following a path of equilibria: extrapolation from the last points, Newton, steps by the change of rotation."""

from __future__ import annotations

import numpy as np

from cfmkit.elastica.kernels.compiler import kernel
from cfmkit.elastica.kernels.dense import copy
from cfmkit.elastica.kernels.newton import all_slopes, solve
from cfmkit.elastica.kernels.status_codes import (
    BY_DRIVE,
    CHANGE,
    DENIED,
    DONE,
    DRIVE,
    DRIVE_RATE,
    FULL,
    GROWTH,
    HIGHEST,
    INERTIA,
    INERTIA_BEFORE,
    ITERATIONS,
    KEPT,
    KEPT_WITH_SLOPES,
    LANDINGS,
    LEAST_SHORTNESS,
    LOG_DETERMINANT,
    LONG,
    LONGEST,
    LOWEST,
    NO_START,
    OUTSIDE,
    REACHED,
    REQUESTED,
    SENSE,
    SHORT,
    SHORTNESS,
    SMALLEST,
    SOLVED,
    SPENT,
    STALLED,
    STEP,
    TOLERANCE,
    UNSTABLE,
    UNSTABLE_COUNT,
    WATCHED,
    WEIGHT,
)

VEER = 0.5  # cosine of the largest angle between the changes of poses at both ends of a step along the arc, and between
# a step of the drive and those at either end of it: of 256 slightly bent columns two went to the wrong side without it
LOOKED_INTO = 0.01  # share of the longest step along the arc that is short enough to meet several things in
SECANT = 0.25  # of the last step: shorter ones go along the tangent, from which the secants of long ones differ
STRETCH = 1.3  # factor on a step that lands on a requested value: rather than a short one after it
CREEPING = 5e-5  # share of the drive's bounds that is a short step
CREEPS = 400  # short steps in a row that are enough
STRAIGHT = 100.0  # change of forces for one of poses that counts for ten
NOISE = 30.0  # how far off a guess may be where points are solved to a tolerance of one
STILL = 1e-7  # change of a pose that is none: rounding has any direction
AGAIN = 1e-5  # change of a pose between two solutions of one point
SHORTER = 4.0  # in smallest steps: a longer step may yet be shorter
APART = 1e4  # in smallest steps: bifurcations farther apart are met one by one
MISSED = 0.4  # largest share of a step by which it may miss what the points before it, or its slopes, foretell


@kernel
def _predict(times, past, slopes, count, natural, t, y):
    """Extrapolate the kept points (newest first) to t: by their values, in natural steps by their slopes as well."""
    for k in range(y.shape[0]):
        y[k] = 0.0
    for i in range(count):
        weight, change = 1.0, 0.0
        for j in range(count):
            if j != i:
                weight *= (t - times[j]) / (times[i] - times[j])
                change += 1.0 / (times[i] - times[j])
        along = 0.0
        if natural:  # Hermite's polynomial
            along = (t - times[i]) * weight * weight
            weight *= weight * (1.0 - 2.0 * (t - times[i]) * change)
        for k in range(y.shape[0]):
            y[k] += weight * past[i, k] + along * slopes[i, k]


@kernel
def remember(kept, count, t, y, drive, slope, most):
    """Put a point in front of the kept ones; return how many there are."""
    times, past, slopes = kept
    for i in range(most - 1, 0, -1):
        times[i] = times[i - 1]
        copy(past[i], past[i - 1])
        copy(slopes[i], slopes[i - 1])
    times[0] = t
    for k in range(y.shape[0]):
        past[0, k] = y[k]
    past[0, y.shape[0]] = drive
    copy(slopes[0], slope)
    return min(count + 1, most)


@kernel
def changes(y, other, n_free, n):
    """Return the largest difference of the poses of two states."""
    change = 0.0
    for i in range(y.shape[0]):
        if i < n_free or (i >= n and (i - n) % 6 < 3):
            change = max(change, abs(y[i] - other[i]))
    return change


@kernel
def pulls(y, other, n_free, n):
    """Return the largest change of a force at the end of a beam, relative to the largest force."""
    change, largest = 0.0, 0.0
    for i in range(n_free, n):
        change, largest = max(change, abs(y[i] - other[i])), max(largest, abs(y[i]))
    return change / largest if largest > 0.0 else 0.0


@kernel
def misses(old, new, one, other, ahead, n_free, n):
    """Return by how much the mean slope misses the largest change of a pose: a lot where another path was met."""
    most = 0.0
    for i in range(new.shape[0]):
        if i < n_free or (i >= n and (i - n) % 6 < 3):
            most = max(most, abs(new[i] - old[i] - 0.5 * ahead * (one[i] + other[i])))
    return most


@kernel
def set_border(natural, tangent, weight, n_free, border):
    """Set the bordering row: the drive itself, or the weighted tangent."""
    n = border.shape[0] - 1
    for i in range(n + 1):
        border[i] = 0.0
    if natural:
        border[n] = 1.0
        return
    norm = tangent[n] * tangent[n]
    for i in range(n):
        w = 1.0 if i < n_free else weight
        border[i] = w * tangent[i]
        norm += w * tangent[i] * tangent[i]
    border[n] = tangent[n]
    scale = 1.0 / np.sqrt(norm)
    for i in range(n + 1):
        border[i] *= scale
        tangent[i] *= scale


@kernel
def aim(y, state, border, tangent, paths, natural, goal, ahead):
    """Set the first guess of the next point; return the right side of the bordering row.

    paths: kept points, how many, present parameter, the guess. In natural steps the right side is the drive's value.
    """
    (times, past, slopes), count, t, guess = paths
    n, size = border.shape[0] - 1, y.shape[0]
    _predict(times, past, slopes, count, natural, t + ahead, guess)
    if count == 1 and not natural:
        for i in range(n):
            guess[i] += tangent[i] * ahead
        guess[size] += tangent[n] * ahead
    copy(y, guess)
    if natural:
        state[DRIVE] = goal
        return goal
    state[DRIVE] = guess[size]
    level = border[n] * past[0, size] + ahead
    for i in range(n):
        level += border[i] * past[0, i]
    return level


@kernel
def _store(k, y, state, number, t, iterations, along, outs):
    """Store point k; number: index of its value, -1 for none; t: parameter; along: d(drive)/ds."""
    out_y, out_drive, out_info = outs
    copy(out_y[k], y)
    out_drive[k] = state[DRIVE]
    out_info[k, UNSTABLE], out_info[k, REQUESTED], out_info[k, REACHED] = state[UNSTABLE_COUNT], number, t
    out_info[k, SPENT], out_info[k, DRIVE_RATE], out_info[k, SHORTNESS] = iterations, along, state[LEAST_SHORTNESS]


@kernel
def _next_step(natural, step, old, targets, number):
    """Return the advance to the next point, whether it lands on a requested value, and that value of the drive."""
    if not natural:
        return abs(step), False, 0.0
    left = targets[number] - old
    if abs(left) <= STRETCH * abs(step):
        return left, True, targets[number]
    ahead = step if left * step > 0.0 else -step
    return ahead, False, old + ahead


@kernel
def _forward(border, tangent):
    """Tell whether a tangent exists and goes the way of the bordering row."""
    along = 0.0
    for i in range(border.shape[0]):
        along += border[i] * tangent[i]
    return along > 0.0


@kernel
def _begin(m, n_free, y, drive, natural, spaces, options, outs, scratch):
    """Solve for the start where it is only near an equilibrium, and store it; in natural steps set the slopes there.

    Returns how many points are stored, -1 where there is no start, and whether the slopes are known. The tangent gets
    the path's sense.
    """
    state, unit, new, tangent, slope = spaces
    n, fresh = unit.shape[0] - 1, options[SENSE] != 0.0
    if not (natural or fresh):
        return 0, False
    copy(new, y)
    state[DRIVE] = drive
    code, iterations = solve(
        m, n_free, new, state, unit, drive, (options[TOLERANCE], options[ITERATIONS]), tangent, scratch
    )
    if fresh:
        if code != SOLVED:
            return -1, False
        copy(y, new)
        _store(0, y, state, -1, 0.0, iterations, tangent[n], outs)
        for i in range(n + 1):
            tangent[i] *= 1.0 if natural else options[SENSE]
    known = natural and code == SOLVED and changes(new, y, n_free, n) < AGAIN
    if known:
        all_slopes(m, n_free, tangent, slope, scratch)
    return (1 if fresh else 0), known


@kernel
def _longer(moved, missed, turn, count, landing, tolerance):
    """Tell whether the next step may be longer; the guess has the errors of the points that it comes from, enlarged."""
    well = missed < 0.1 * moved + NOISE * tolerance
    return well and (landing or (count > 2 and moved < 0.5 * turn))


@kernel
def _creeps(slow, ahead, moved, new, old, options, n_free, n):
    """Count the short steps in a row, those tenfold in which only forces grow: beams pulled straight get no further."""
    if abs(ahead) >= CREEPING * (options[HIGHEST] - options[LOWEST]):
        return 0
    return slow + (10 if pulls(new, old, n_free, n) > STRAIGHT * moved else 1)


@kernel
def _refused(code, moved, missed, bent, turn, count):
    """Tell whether a step led to no equilibrium, too far, or off what the points before it or its slopes foretell."""
    off = max(bent, missed if count > 1 else 0.0)
    return code != SOLVED or not (moved <= turn and off <= MISSED * moved + STILL)


@kernel
def _passed(state, index, count, natural, watched, length):
    """Tell whether a step has gone past more than one loss of stability, or into loads that its segments do not bear.

    Behind one bifurcation the next ones are near: the first one is to be met first, by shorter steps. Those that are
    nearer than APART are met together: very short steps would follow the corner that errors of integration round off.
    length: of the step, in units of the smallest one.
    """
    if length <= SHORTER:
        return False
    lost = state[UNSTABLE_COUNT] - index if watched and natural else 0.0
    unborne = state[LEAST_SHORTNESS] < SHORT and (lost > 0.0 or (natural and count == 1))
    return (lost > 1.0 and length > APART) or state[UNSTABLE_COUNT] < min(index, 0.0) or unborne


@kernel
def _slopes_behind(code, m, n_free, natural, weight, tangent, slope, room, scratch):
    """Set the slopes behind a step; along the arc those per unit of its length. room (n + 1): for `set_border`."""
    if code == SOLVED:
        if not natural:
            set_border(natural, tangent, weight, n_free, room)
        all_slopes(m, n_free, tangent, slope, scratch)


@kernel
def _veers(old, new, one, other, ahead, n_free, n):
    """Tell whether a step by the drive leads away from where the poses go by their slopes before or behind it.

    A jump across a corner to the mirror image of a path may have the right mean slope by chance.
    """
    along, across, size, first, last = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(new.shape[0]):
        if i < n_free or (i >= n and (i - n) % 6 < 3):
            change = new[i] - old[i]
            along += change * one[i]
            across += change * other[i]
            size += change * change
            first += one[i] * one[i]
            last += other[i] * other[i]
    if changes(new, old, n_free, n) <= STILL:
        return False
    sense = np.sign(ahead)
    return sense * along < VEER * np.sqrt(size * first) or sense * across < VEER * np.sqrt(size * last)


@kernel
def _strays(code, known, ahead, options, points, both, state, index, n_free, n):
    """Tell whether in a step along the arc that led somewhere more happened than one limit point or one bifurcation.

    Or, from the slopes before and behind it, whether poses change in another direction: behind a sharp turn lie other
    paths. points, both: before and behind a step, and the slopes there.
    """
    if code != SOLVED:
        return False
    old, new = both
    if options[BY_DRIVE] > 0.5:
        calm = known and state[UNSTABLE_COUNT] == index and abs(ahead) > SHORTER * options[SMALLEST]
        return calm and _veers(points[0], points[1], old, new, ahead, n_free, n)
    changed, last = abs(state[UNSTABLE_COUNT] - index), new.shape[0] - 1
    several = changed > 1.0 or (known and changed == 0.0 and old[last] * new[last] < 0.0)
    if several and options[WATCHED] > 0.5 and ahead > LOOKED_INTO * options[LONGEST]:
        return True
    if not known or ahead <= SHORTER * options[SMALLEST]:
        return False
    along, one, other = 0.0, 0.0, 0.0
    for i in range(last):
        if i < n_free or (i >= n and (i - n) % 6 < 3):
            along += old[i] * new[i]
            one += old[i] * old[i]
            other += new[i] * new[i]
    return along < VEER * np.sqrt(one * other)


@kernel
def march(m, n_free, y, drive, tangent, targets, options, outs, scratch, room):
    """Follow the path from (y, drive) through the targets.

    options: tolerance, iterations, by the drive (1) or the arc length (0), first, smallest and longest step, largest
    change of a pose in a step, weight of forces in the arc length, lowest and highest drive, whether to stop where the
    inertia changes, inertia at the start, sense, how often a landing on a target may be refused. A sense of 1 or -1
    says that the start is only near an equilibrium, which is solved for and stored first. A step that lands on a
    target may be longer than the longest by STRETCH. room: see `cfmkit.elastica.kernels.workspace`.
    Returns why the march ended and the number of points stored.
    """
    natural, step, smallest = options[BY_DRIVE] > 0.5, options[STEP], options[SMALLEST]
    greatest, turn, most = options[LONGEST], options[CHANGE], KEPT_WITH_SLOPES if natural else KEPT
    n, size = tangent.shape[0] - 1, y.shape[0]
    kept, (new, guess, slope), state, (border, new_tangent, unit, unused), between = room
    times, past, slopes = kept
    for i in range(state.shape[0]):
        state[i] = 0.0
    stored, known = _begin(m, n_free, y, drive, natural, (state, unit, new, tangent, slope), options, outs, scratch)
    if stored < 0:
        return NO_START, 0
    t, number = (drive if natural else 0.0), 0
    index = state[UNSTABLE_COUNT] if stored == 1 else options[INERTIA_BEFORE]
    count, slow, denied = remember(kept, 0, t, y, drive, slope, most), 0, 0
    while number < targets.shape[0]:
        if stored + targets.shape[0] - number + 1 >= outs[0].shape[0]:
            return FULL, stored
        old = past[0]
        set_border(natural, tangent, options[WEIGHT], n_free, border)
        ahead, landing, goal = _next_step(natural, step, old[size], targets, number)
        goal = aim(new, state, border, tangent, (kept, count, t, guess), natural, goal, ahead)
        code, iterations = solve(
            m, n_free, new, state, border, goal, (options[TOLERANCE], options[ITERATIONS]), new_tangent, scratch
        )
        moved, missed = changes(new, old, n_free, n), changes(new, guess, n_free, n)
        _slopes_behind(code, m, n_free, natural, options[WEIGHT], new_tangent, slope, unused, scratch)
        bent = misses(old, new, slopes[0], slope, ahead, n_free, n) if known else 0.0
        refused = _refused(code, moved, missed, bent, turn, count)
        passed = _passed(state, index, count, natural, options[WATCHED] > 0.5, abs(ahead) / smallest)
        passed = passed or _strays(code, known, ahead, options, (old, new), (slopes[0], slope), state, index, n_free, n)
        if refused or passed or not (natural or _forward(border, new_tangent)):
            step, denied = (0.5 * ahead if natural else 0.5 * step), denied + (1 if landing else 0)
            if abs(step) < smallest or denied >= options[LANDINGS]:
                return (STALLED if abs(step) < smallest else DENIED), stored
            if count > 1 and abs(step) < SECANT * abs(times[0] - times[1]):
                count = 1
            continue
        if state[LEAST_SHORTNESS] < SHORT:
            return LONG, stored
        slow = _creeps(slow, ahead, moved, new, old, options, n_free, n) if natural and not landing else 0
        if slow > CREEPS:
            return STALLED, stored
        if not natural:
            spaces = (scratch, between)
            number, stored = _between(m, n_free, old, new, state, targets, number, stored, options, outs, unit, spaces)
            if number >= targets.shape[0]:
                return DONE, stored
        t += ahead
        _store(stored, new, state, number if landing else -1, t, iterations, new_tangent[n], outs)
        stored, number, denied = stored + 1, number + (1 if landing else 0), (0 if landing else denied)
        count = remember(kept, count if known or not natural else 0, t, new, state[DRIVE], slope, most)
        known = True
        copy(tangent, new_tangent)
        if options[WATCHED] > 0.5 and state[UNSTABLE_COUNT] != index:
            return INERTIA, stored
        index = state[UNSTABLE_COUNT]
        if state[DRIVE] < options[LOWEST] or state[DRIVE] > options[HIGHEST]:
            return OUTSIDE, stored
        if _longer(moved, missed, turn, count, landing, options[TOLERANCE]):
            step = np.sign(step) * min(greatest, 1.6 * abs(step))
    return DONE, stored


@kernel
def _between(m, n_free, old, new, state, targets, number, stored, options, outs, unit, spaces):
    """Solve at the requested values of the drive that a step of arc length has passed; return (number, stored).

    Values in the direction of the first target count as requested once each; a value passed again on the way back
    after a fold is stored again.
    """
    size = new.shape[0]
    n_all = targets.shape[0]
    scratch, (y, s, tangent) = spaces
    s[GROWTH] = s[LOG_DETERMINANT] = 0.0
    before, after = old[size], state[DRIVE]
    rising = after > before
    first = 0 if (rising == (targets[n_all - 1] > targets[0]) or n_all == 1) else n_all - 1
    for i in range(n_all):
        k = i if first == 0 else n_all - 1 - i
        value = targets[k]
        inside = (before < value <= after) if rising else (after <= value < before)
        if not inside or stored >= outs[0].shape[0] - 2:
            continue
        share = (value - before) / (after - before)
        for r in range(size):
            y[r] = old[r] + share * (new[r] - old[r])
        s[DRIVE] = value
        code, iterations = solve(
            m, n_free, y, s, unit, value, (options[TOLERANCE], options[ITERATIONS]), tangent, scratch
        )
        n = unit.shape[0] - 1
        if code == SOLVED and changes(y, new, n_free, n) <= 1.5 * changes(new, old, n_free, n) + STILL:
            _store(stored, y, s, k, -1.0, iterations, 1.0 if rising else -1.0, outs)
            stored += 1
            if k == n_all - 1:
                return n_all, stored
            number = max(number, k + 1) if number < n_all - 1 else number
        elif k == n_all - 1:
            return n_all, stored
    return number, stored
