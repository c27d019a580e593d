/* Tables of plain beams, and their equilibria beside those with a higher degree, by which the error of a path is estimated.
 *
 * numpy's way: `plain_tables` of element_tables.py; `raise_degree`, `embed` and `compare_states` of error_estimate.py. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "march.h"

#define N_COMPARED 7 /* numbers of a state, see `compare` */
#define SHORTEST_CHORD 1e-9 /* of a shape of length 1 that can be fitted, as in beam_fits.py */

/* As in accuracy.py. */
#define N_PICKED 6 /* points at which the error of a path is estimated */
#define NEXT_CORRECTION 1e-10
#define LARGEST_CHANGE 0.3
#define ERROR_SAFETY 2.0
#define ROUNDING_ERROR 1e-13
#define ROUNDED_PLACES 4.0
#define NO_FORCE 1e-6
#define SMALL_MOTION 1e-3

static Int n_ends(const Model *m) { return m->size - m->elements * (m->degree + 1); } /* unknowns that move ends */

/* Row k of the tables (6, elements, q) of elements of plain beams: angle, weight, rigidity, axial, shear, ahead. `law` is
 * where the element begins on the shape of its beam, its width there; `angle` the coefficients of the shape. */
static void fill(const Model *shapes, Int elements, Int k, const double *law, const double *angle, Int powers, double length,
                 double rigidity, double axial, double shear, double *tables) {
    const Int q = shapes->points, next = elements * q;
    for (Int i = 0; i < q; i++) {
        const double place = shapes->rule[i], t = law[0] + law[1] * place;
        double *cell = tables + k * q + i, value = 0.0;
        for (Int power = powers - 1; power >= 0; power--) value = value * t + angle[power];
        cell[0] = value;
        cell[next] = length * shapes->rule[q + i];
        cell[2 * next] = rigidity;
        cell[3 * next] = axial;
        cell[4 * next] = shear;
        cell[5 * next] = length * (1.0 - place);
    }
}

/* Arrays of a network of plain beams, one element each, that is like the one whose row is given: to `block` what the two do
 * not share, whose addresses replace those in the row. `at` (elements + attachments, 2): nodes of both ends, then node and
 * master; `rule` (2, count): places and weights along a whole beam; `spots` (nodes, 2) [m]; `beams` (elements, 8 + powers):
 * bending, compliances by stretching and shearing, floor, offsets of both ends [m], angle. 0 if a beam cannot be fitted. */
int fill_network(Model *m, const Int *at, Int attachments, const double *rule, Int count, const double *spots, const double *beams,
                 Int powers, double *block) {
    const Int e = m->elements, wide = 8 + powers, all = e * m->points, triangle = (m->degree + 1) * (m->degree + 2) / 2;
    double *bend = block + 6 * all, *length = bend + e * triangle, *origin = length + e, *arm = origin + 2 * attachments;
    double *unit = arm + 2 * attachments, *laws = unit + m->free, *scales = laws + e * (2 + powers), sum = 0.0;
    for (Int k = 0; k < e; k++) {
        const double *own = beams + k * wide, *first = spots + 2 * at[2 * k], *last = spots + 2 * at[2 * k + 1];
        const double dx = last[0] + own[6] - (first[0] + own[4]), dy = last[1] + own[7] - (first[1] + own[5]);
        double *law = laws + k * (2 + powers), cx = 0.0, cy = 0.0;
        law[0] = 0.0; law[1] = 1.0;
        memcpy(law + 2, own + 8, (size_t)powers * sizeof(double));
        for (Int i = 0; i < count; i++) {
            double angle = 0.0;
            for (Int power = powers - 1; power >= 0; power--) angle = angle * rule[i] + own[8 + power];
            cx += rule[count + i] * cos(angle);
            cy += rule[count + i] * sin(angle);
        }
        const double far = dx * dx + dy * dy, chord = cx * cx + cy * cy;
        if (!(far > 0.0 && chord > SHORTEST_CHORD * SHORTEST_CHORD)) return 0;
        law[2] += atan2(dy * cx - dx * cy, dx * cx + dy * cy);
        length[k] = sqrt(far / chord);
        sum += length[k];
    }
    const double unit_length = sum / (double)e, unit_force = beams[0] / (unit_length * unit_length), square = unit_length * unit_length;
    for (Int k = 0; k < 2 * attachments; k++) {
        const Int *own = at + 2 * e + 2 * (k / 2);
        origin[k] = spots[2 * own[1] + k % 2] / unit_length;
        arm[k] = (spots[2 * own[0] + k % 2] - spots[2 * own[1] + k % 2]) / unit_length;
    }
    for (Int a = 0; a < m->free; a++) unit[a] = HUGE_VAL;
    for (Int k = 0; k < e; k++) {
        const double *own = beams + k * wide, *law = laws + k * (2 + powers), speed = length[k] / unit_length;
        const double rigidity = own[0] / (unit_force * square) / (speed * speed);
        const double axial = own[1] * unit_force + own[3] * unit_force * square / own[0];
        double bending = 0.0;
        fill(m, e, k, law, law + 2, powers, speed, rigidity, axial, own[2] * unit_force, block);
        length[k] = speed;
        for (Int i = 0; i < triangle; i++) bend[k * triangle + i] = speed * rigidity * m->unit_bend[i];
        for (Int i = 0; i < 4; i++) arm[2 * m->ends[2 * k + i / 2] + i % 2] += own[4 + i] / unit_length;
        for (Int i = 0; i < m->points; i++) bending += rigidity * block[all + k * m->points + i];
        for (Int i = 1; i <= 2; i++) {
            const Int slot = m->slot[m->unknowns[(k + 1) * (m->degree + 9) - i]];
            if (slot >= 0) unit[slot] = bending * speed / (speed * speed);
        }
    }
    m->angle = block; m->weight = block + all; m->rigidity = block + 2 * all;
    m->axial = block + 3 * all; m->shear = block + 4 * all; m->ahead = block + 5 * all;
    m->bend = bend; m->length = length; m->origin = origin; m->arm = arm; m->unit = unit;
    scales[0] = unit_length;
    scales[1] = unit_force;
    return 1;
}

/* The tables at other points: what is even along an element is its first value there. */
static void raise_tables(const Model *m, Model *fine, const double *laws, Int powers, double *room) {
    const Int all = m->elements * fine->points, triangle = (fine->degree + 1) * (fine->degree + 2) / 2;
    double *bend = room + 6 * all;
    for (Int e = 0; e < m->elements; e++, laws += powers + 2) {
        const Int from = e * m->points;
        const double rigidity = m->rigidity[from], length = m->length[e];
        fill(fine, m->elements, e, laws, laws + 2, powers, length, rigidity, m->axial[from], m->shear[from], room);
        for (Int k = 0; k < triangle; k++) bend[e * triangle + k] = length * rigidity * fine->unit_bend[k];
    }
    fine->angle = room; fine->weight = room + all; fine->rigidity = room + 2 * all;
    fine->axial = room + 3 * all; fine->shear = room + 4 * all; fine->ahead = room + 5 * all; fine->bend = bend;
}

/* Numbers of unknowns, as those of numbering.py: ends, bubbles of every element, forces. Every bubble and force is free. */
static void raise_numbers(const Model *m, Model *fine, Int *unknowns, Int *slot, Int *leaves, double *base, double *rate,
                          double *unit) {
    const Int ends = n_ends(m), each = fine->degree - 1, forces = ends + m->elements * each, wide = fine->degree + 9;
    const Int free_ends = m->free - m->elements * (m->degree + 1);
    for (Int e = 0; e < m->elements; e++) {
        Int *own = unknowns + e * wide;
        memcpy(own, m->unknowns + e * (m->degree + 9), 8 * sizeof(Int));
        for (Int k = 0; k < each; k++) own[8 + k] = ends + e * each + k;
        for (Int k = 0; k < 2; k++) own[8 + each + k] = forces + 2 * e + k;
        for (Int k = 8; k < wide; k++) leaves[free_ends + own[k] - ends] = e;
    }
    for (Int i = 0; i < fine->size; i++) slot[i] = i < ends ? m->slot[i] : free_ends + i - ends;
    memcpy(leaves, m->leaves, (size_t)free_ends * sizeof(Int));
    memcpy(base, m->base, (size_t)ends * sizeof(double));
    memcpy(rate, m->rate, (size_t)ends * sizeof(double));
    for (Int k = 0; k < fine->free; k++) unit[k] = HUGE_VAL;
    for (Int k = 1; k <= 2 * m->elements; k++) unit[fine->free - k] = m->unit[m->free - k];
    fine->unknowns = unknowns; fine->slot = slot; fine->leaves = leaves;
    fine->base = base; fine->rate = rate; fine->unit = unit;
}

/* The same network with the degree of `shapes`, which has the tables of its shape functions; memory to free, NULL if none.
 * `laws` (elements, 2 + powers): where an element begins on the shape of its beam, its width, the shape's coefficients. */
static void *raise_model(const Model *m, const Model *shapes, const double *laws, Int powers, Model *fine) {
    const Int e = m->elements, degree = shapes->degree, q = shapes->points, more = e * (degree - m->degree);
    const Int size = m->size + more, free = m->free + more, tables = e * (6 * q + (degree + 1) * (degree + 2) / 2);
    double *room = calloc((size_t)(tables + 3 * size + 2 * free + e * (degree + 9)), sizeof(double));
    if (!room) return NULL;
    double *base = room + tables, *rate = base + size, *unit = rate + size;
    Int *unknowns = (Int *)(unit + free), *slot = unknowns + e * (degree + 9), *leaves = slot + size;
    *fine = *m;
    fine->degree = degree; fine->points = q; fine->size = size; fine->free = free;
    fine->values = shapes->values; fine->slopes = shapes->slopes;
    fine->values_by_shape = shapes->values_by_shape; fine->slopes_by_shape = shapes->slopes_by_shape;
    fine->products = shapes->products; fine->rule = shapes->rule; fine->unit_bend = shapes->unit_bend;
    raise_tables(m, fine, laws, powers, room);
    raise_numbers(m, fine, unknowns, slot, leaves, base, rate, unit);
    return room;
}

/* A state in the unknowns of a higher degree: shapes are hierarchical. */
static void embed(const Model *m, const Model *fine, const double *z, double *out) {
    const Int ends = n_ends(m), old = m->degree - 1, new = fine->degree - 1, e = m->elements;
    memset(out, 0, (size_t)fine->size * sizeof(double));
    memcpy(out, z, (size_t)ends * sizeof(double));
    for (Int k = 0; k < e; k++) memcpy(out + ends + k * new, z + ends + k * old, (size_t)old * sizeof(double));
    memcpy(out + ends + e * new, z + ends + e * old, (size_t)(2 * e) * sizeof(double));
}

/* The largest force or moment in a beam. */
static double largest_force(const Model *m, const double *z) {
    double largest = 0.0;
    for (Int e = 0; e < m->elements; e++) {
        const Int *own = m->unknowns + e * (m->degree + 9);
        for (Int k = 0; k < m->points; k++) {
            double curvature = 0.0;
            for (Int i = 0; i <= m->degree; i++) curvature += z[own[local_shape(i)]] * m->slopes[k * (m->degree + 1) + i];
            largest = larger(largest, fabs(m->rigidity[e * m->points + k] * m->length[e] * curvature));
        }
        for (Int k = 1; k <= 2; k++) largest = larger(largest, fabs(z[own[m->degree + 9 - k]]));
    }
    return largest;
}

/* Compare states (designs, count, size) with equilibria of a higher degree near them, or what they are there if none is.
 * To `ends` the unknowns that move ends (designs, count, ends), to `found` (designs, count, 7): 0 if there is one,
 * unstable directions, how far it is, change of the gradient by those unknowns, effort of the drive, largest force, change
 * of those unknowns. */
int compare(const Model *models, Int designs, const Model *shapes, const double *laws, Int powers, const double *z,
            const double *drive, Int count, double tolerance, double *ends, double *found) {
    const Goal goal = {NULL, 0.0, tolerance, 1};
    for (const Model *m = models; m < models + designs; laws += m->elements * (powers + 2), m++) {
        Model fine;
        const Int same = n_ends(m);
        void *room = raise_model(m, shapes, laws, powers, &fine);
        Work *w = room ? work_open(&fine, 0) : NULL;
        double *state = w ? malloc((size_t)(3 * fine.size + fine.free) * sizeof(double)) : NULL;
        int good = state != NULL;
        for (Int k = 0; good && k < count; k++, z += m->size, ends += same, found += N_COMPARED) {
            double *gradient = state + fine.size, *coarse = gradient + fine.size, *x = coarse + fine.size;
            double way = drive[k], moved = 0.0, force = 0.0, effort = 0.0, motion = 0.0;
            Found end = {0, 0, 0.0};
            embed(m, &fine, z, state);
            for (Int i = 0; i < fine.size; i++) if (fine.slot[i] >= 0) x[fine.slot[i]] = state[i];
            const int code = newton(&fine, w, x, &way, &goal, &end);
            for (Int i = 0; i < fine.size && code == CONVERGED; i++) {
                const Int a = fine.slot[i];
                if (a >= 0 && fine.unit[a] == HUGE_VAL) moved = larger(moved, fabs(x[a] - state[i]));
                if (a >= 0) state[i] = x[a];
            }
            good = evaluate(&fine, state, &way, 1.0, 1, gradient, NULL) == CONVERGED
                   && evaluate(m, z, &way, 1.0, 1, coarse, NULL) == CONVERGED;
            for (Int i = 0; i < same; i++) {
                force = larger(force, fabs(gradient[i] - coarse[i]));
                motion = larger(motion, fabs(state[i] - z[i]));
                effort += gradient[i] * m->rate[i];
            }
            memcpy(ends, state, (size_t)same * sizeof(double));
            const double row[N_COMPARED] = {code, (double)end.told, moved, force, effort, largest_force(&fine, state), motion};
            memcpy(found, row, sizeof(row));
        }
        free(state);
        work_close(w);
        free(room);
        if (!good) return 0;
    }
    return 1;
}

/* The largest of the last two coefficients of the rotation of any element. */
static double last_coefficients(const Model *m, const double *z) {
    const Int wide = m->degree + 9;
    double largest = 0.0;
    for (Int e = 0; e < m->elements; e++)
        for (Int k = wide - 4; k < wide - 2; k++) largest = larger(largest, fabs(z[m->unknowns[e * wide + k]]));
    return largest;
}

static Int largest_of(const double *values, const Int *at, Int first, Int end) {
    Int best = first;
    for (Int k = first + 1; k < end; k++) if (fabs(values[at[k]]) > fabs(values[at[best]])) best = k;
    return at[best];
}

/* Put the points at which the error is estimated first in `at`, in order; return their number: `pick_points` of accuracy.py. */
static Int pick(const double *effort, const double *last, Int *at, Int count, char *chosen) {
    Int kept = 0;
    chosen[at[count - 1]] = chosen[largest_of(effort, at, 0, count)] = 1;
    for (Int k = 0; count > N_PICKED && k < N_PICKED - 2; k++)
        chosen[largest_of(last, at, count * k / (N_PICKED - 2), count * (k + 1) / (N_PICKED - 2))] = 1;
    for (Int k = 0; k < count; k++) if (count <= N_PICKED || chosen[at[k]]) at[kept++] = at[k];
    return kept;
}

/* Estimated error of a path on which all is stable: its start and points as rows of `march`, free unknowns, slopes, drive,
 * effort, stability, target. Not a number if that is not certain. `point_errors` of accuracy.py is the specification. */
double path_error(const Model *m, const Model *shapes, const double *laws, Int powers, const double *rows, Int total) {
    const Int n = m->free, wide = 2 * n + 4, same = n_ends(m), size = m->size;
    double *z = malloc((size_t)(total * (size + 3) + N_PICKED * (size + 1 + same + N_COMPARED)) * sizeof(double));
    Int *at = calloc((size_t)(2 * total), sizeof(Int)), targets = 0;
    if (!z || !at) { free(z); free(at); return NAN; }
    double *effort = z + total * size, *last = effort + total, *drive = last + total, *picked = drive + total;
    double *ways = picked + N_PICKED * size, *ends = ways + N_PICKED, *found = ends + N_PICKED * same;
    double reach = 0.0, most = 0.0, largest = 0.0, error = 0.0;
    int by_loads = 1;
    for (Int i = 0; i < size; i++) by_loads = by_loads && m->rate[i] == 0.0;
    for (Int p = 0; p < total; p++) {
        const double *row = rows + p * wide;
        double *own = z + p * size;
        drive[p] = row[2 * n];
        for (Int i = 0; i < size; i++) own[i] = m->slot[i] >= 0 ? row[m->slot[i]] : m->base[i] + drive[p] * m->rate[i];
        effort[p] = by_loads ? load_work(m, own) : row[2 * n + 1];
        last[p] = last_coefficients(m, own);
        if (row[2 * n + 3] >= 0.0) at[targets++] = p;
        most = larger(most, fabs(effort[p]));
        for (Int i = 0; i < same; i++) reach = larger(reach, fabs(own[i]));
    }
    const Int chosen = targets ? pick(effort, last, at, targets, (char *)(at + total)) : 0;
    for (Int k = 0; k < chosen; k++) {
        memcpy(picked + k * size, z + at[k] * size, (size_t)size * sizeof(double));
        ways[k] = drive[at[k]];
    }
    int good = chosen && compare(m, 1, shapes, laws, powers, picked, ways, chosen, NEXT_CORRECTION, ends, found);
    for (Int k = 0; good && k < chosen; k++) largest = larger(largest, found[k * N_COMPARED + 5]);
    const double load = larger(larger(largest, NO_FORCE * reach), ROUNDING_ERROR);
    const double unit = larger(most, NO_FORCE * larger(load, reach));
    for (Int k = 0; good && k < chosen; k++) {
        const double *other = found + k * N_COMPARED;
        double rise = 0.0, work = other[4];
        good = other[0] == CONVERGED && other[1] == 0.0 && other[2] <= LARGEST_CHANGE;
        for (Int p = larger(at[k], 1); p <= at[k] + 1 && p < total; p++)
            if (drive[p] != drive[p - 1]) rise = larger(rise, fabs((effort[p] - effort[p - 1]) / (drive[p] - drive[p - 1])));
        if (by_loads) { memcpy(picked, ends + k * same, (size_t)same * sizeof(double)); work = load_work(m, picked); }
        const double bearing = larger(fabs(work - effort[at[k]]) / unit, other[3] / load) - ROUNDED_PLACES * DBL_EPSILON * rise / unit;
        error = larger(error, ERROR_SAFETY * larger(bearing, other[6] / larger(reach, SMALL_MOTION)) + ROUNDING_ERROR);
    }
    free(z);
    free(at);
    return good && most <= DBL_MAX ? (larger(reach, largest) <= ROUNDING_ERROR ? ROUNDING_ERROR : error) : NAN;
}
