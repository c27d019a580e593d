/* Sides of beams that touch obstacles, pads and each other at places that are unknowns: elements that end there, and the
 * rows of a contact.
 *
 * The formulas are those of contact/sliding.py, for beams of one thickness whose unloaded angle is a polynomial, and
 * contacts at points; a test holds them equal. The matrix is not symmetric. Unstable directions are counted from another
 * one, with places held, whose rows of a contact have the numbers of its force and its place. */
#include <math.h>
#include <string.h>

#include "march.h"

#define SMALLEST_ELEMENT 1e-9   /* of a beam: shorter ones have no equations */
#define SMALLEST_FORCE 1e-12    /* of a contact that begins, in the curvature of its gap over its force */
#define NEUTRAL_STIFFNESS 1e-6  /* of motions below which a direction counts as stable */

static double polynomial(const double *coefficients, Int count, double t, double *slope) {
    double value = 0.0;
    *slope = 0.0;
    for (Int k = count - 1; k >= 0; k--) {
        *slope = *slope * t + value;
        value = value * t + coefficients[k];
    }
    return value;
}

static double second_slope(const double *coefficients, Int count, double t) {
    double value = 0.0;
    for (Int k = count - 1; k > 1; k--) value = value * t + (double)(k * (k - 1)) * coefficients[k];
    return value;
}

static void cuts_of(const Model *m, const double *z, Int row, double *cuts) {
    for (int end = 0; end < 2; end++) {
        cuts[end] = m->moved_fixed[2 * row + end];
        for (Int k = 0; k < m->sides; k++)
            cuts[end] += m->moved_shares[(2 * row + end) * m->sides + k] * z[m->side_at[SIDE_WIDE * k + 3]];
    }
}

/* Move elements to the places of contacts; return 0 where one would vanish. */
int sides_move(const Model *m, const double *z) {
    const Int q = m->points, triangle = (m->degree + 1) * (m->degree + 2) / 2, wide = N_LAW + m->coefficients;
    double cuts[2], slope;
    for (Int row = 0; row < m->moved; row++) {
        cuts_of(m, z, row, cuts);
        if (!(cuts[1] - cuts[0] > SMALLEST_ELEMENT)) return 0;
    }
    for (Int row = 0; row < m->moved; row++) {
        cuts_of(m, z, row, cuts);
        const Int e = m->moved_at[row];
        const double *law = m->moved_law + row * wide, width = cuts[1] - cuts[0], speed = law[0] * width;
        double *angle = (double *)m->angle + e * q, *weight = (double *)m->weight + e * q;
        double *rigidity = (double *)m->rigidity + e * q, *ahead = (double *)m->ahead + e * q;
        double *bend = (double *)m->bend + e * triangle;
        for (Int k = 0; k < q; k++) {
            angle[k] = polynomial(law + N_LAW, m->coefficients, cuts[0] + width * m->rule[k], &slope);
            weight[k] = speed * m->rule[q + k];
            rigidity[k] = law[1] / (speed * speed);
            ahead[k] = speed * (1.0 - m->rule[k]);
            if (!m->curl) continue;
            ((double *)m->rest)[e * q + k] = slope * width;
            ((double *)m->curl)[e * q + k] = law[2] / (speed * speed);
        }
        ((double *)m->length)[e] = speed;
        for (Int k = 0; k < triangle; k++) bend[k] = law[1] / speed * m->unit_bend[k];
    }
    return 1;
}

/* Change of the gradient of an element by its unknowns as one of its ends moves along the beam. */
static void change_by_end(const Model *m, Int row, int end, const double *cuts, const double *z, Stage at, Term *t) {
    const Int e = m->moved_at[row], shapes = m->degree + 1, count = m->degree + 9, *own = m->unknowns + e * count;
    const double *law = m->moved_law + row * (N_LAW + m->coefficients), width = cuts[1] - cuts[0];
    const double grows = (end ? 1.0 : -1.0) / width, *line = m->line + 4 * e;
    const double load[2] = {at.share * line[0] + at.drive * line[2], at.share * line[1] + at.drive * line[3]};
    double reach[2] = {0.0, 0.0};
    t->count = count;
    memcpy(t->at, own, (size_t)count * sizeof(Int));
    memset(t->gradient, 0, (size_t)count * sizeof(double));
    for (Int q = 0, o = e * m->points; q < m->points; q++, o++) {
        const double *N = m->values + q * shapes, *S = m->slopes + q * shapes, u = m->rule[q];
        const double w = m->weight[o], a = m->axial[o], b = m->shear[o], further = m->ahead[o] * grows;
        double turn = m->angle[o], curvature = 0.0, turned;
        for (Int k = 0; k < shapes; k++) {
            turn += z[own[local_shape(k)]] * N[k];
            curvature += z[own[local_shape(k)]] * S[k];
        }
        const double place = cuts[0] + width * u, share = end ? u : 1.0 - u;
        polynomial(law + N_LAW, m->coefficients, place, &turned);
        const double rest = (end ? turned : -turned) + width * share * second_slope(law + N_LAW, m->coefficients, place);
        turned *= share;
        const double c = cos(turn), s = sin(turn);
        const double nx = z[own[count - 2]] + load[0] * m->ahead[o], ny = z[own[count - 1]] + load[1] * m->ahead[o];
        const double normal = nx * c + ny * s, shear = ny * c - nx * s, f = 1.0 + (a - b) * normal;
        const double more_normal = further * (load[0] * c + load[1] * s) + shear * turned;
        const double more_shear = further * (load[1] * c - load[0] * s) - normal * turned;
        const double bent = w * bending_change(m, o, curvature, grows, rest);
        const double sheared = w * (grows * shear * f + more_shear * f + shear * (a - b) * more_normal);
        const double x = (1.0 + a * normal) * c - b * shear * s, y = (1.0 + a * normal) * s + b * shear * c;
        reach[0] += w * (grows * x + a * more_normal * c - b * more_shear * s - y * turned);
        reach[1] += w * (grows * y + a * more_normal * s + b * more_shear * c + x * turned);
        for (Int k = 0; k < shapes; k++) t->gradient[local_shape(k)] += bent * S[k] - sheared * N[k];
    }
    const Pose start = pose(m, z, m->ends[2 * e]);
    const double longer = m->length[e] * grows;
    for (Int k = 0; k < 3; k++) t->gradient[k] = -longer * (load[0] * start.by[0][k] + load[1] * start.by[1][k]);
    t->gradient[count - 2] = -reach[0];
    t->gradient[count - 1] = -reach[1];
}

/* The side of a beam at a contact: gap, tangency, their derivatives by x, y and rotation of its body and, if the edge that
 * it touches moves, of that one's; and the gap's curvature. */
typedef struct {
    Int count, at[6];
    double gap, tangency, gap_row[6], tangency_row[6], hessian[6][6], along[2], by_place, curvature;
} Side;

/* Curvature of the rotation at an end of an element, by the arc length. */
static double bend_at(const Model *m, const double *z, Int e, int end) {
    const Int *own = m->unknowns + e * (m->degree + 9);
    double slope = z[own[7]] - z[own[3]];
    for (Int k = 2; k <= m->degree; k++)
        slope += 2.0 * sqrt((double)k - 0.5) * (end || k % 2 ? 1.0 : -1.0) * z[own[local_shape(k)]];
    return slope / m->length[e];
}

static Side side_at(const Model *m, Int number, const double *z) {
    const Int *given = m->side_at + SIDE_WIDE * number, *places = m->places + 4 * given[1], row = given[8];
    const double *value = m->side + 3 * number, *law = m->moved_law + row * (N_LAW + m->coefficients), length = value[1];
    double turning, apart[2][6] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}}; /* change of the place, as seen from the edge */
    Side side = {.count = 3, .at = {places[0], places[1], places[2]}};
    Distance d;
    Pose edge;
    const double angle = polynomial(law + N_LAW, m->coefficients, z[given[3]], &turning) + z[places[2]];
    const double x = m->origin[2 * given[1]] + z[places[0]], y = m->origin[2 * given[1] + 1] + z[places[1]];
    if (given[7] < 0) {
        const Outline o = {m->edge + 6 * given[6], given[9], given[10], given[11]};
        d = outline_distance(&o, x * length, y * length);
        d.value /= length;
        d.curvature *= length;
    } else { /* a circle about a place that moves */
        edge = pose(m, z, given[7]);
        const double dx = x - edge.place[0], dy = y - edge.place[1], reach = sqrt(dx * dx + dy * dy);
        d = (Distance){reach - value[2], {dx / reach, dy / reach}, 1.0 / reach};
        side.count = 6;
        for (int j = 0; j < 3; j++) {
            side.at[3 + j] = edge.at[j];
            for (int i = 0; i < 2; i++) apart[i][3 + j] = -edge.by[i][j];
        }
    }
    side.along[0] = cos(angle);
    side.along[1] = sin(angle);
    const double rises = d.normal[1] * side.along[0] - d.normal[0] * side.along[1];
    for (Int i = 0; i < side.count; i++) {
        const double across = d.normal[1] * apart[0][i] - d.normal[0] * apart[1][i];
        side.gap_row[i] = d.normal[0] * apart[0][i] + d.normal[1] * apart[1][i];
        side.tangency_row[i] = d.curvature * rises * across;
        for (Int j = 0; j < side.count; j++)
            side.hessian[i][j] = d.curvature * across * (d.normal[1] * apart[0][j] - d.normal[0] * apart[1][j]);
    }
    if (given[7] >= 0) side.hessian[5][5] += d.normal[0] * edge.arm[0] + d.normal[1] * edge.arm[1];
    side.gap = d.value - value[0];
    side.tangency = d.normal[0] * side.along[0] + d.normal[1] * side.along[1];
    side.tangency_row[2] = rises;
    side.by_place = rises * turning;
    const double bent = turning / law[0] + 0.5 * (bend_at(m, z, given[0], 1) + bend_at(m, z, given[0] + 1, 0));
    side.curvature = bent * rises + d.curvature * rises * rises;
    return side;
}

/* Number of the contact that has gap and force: of two beams one of both, else the contact itself. */
static Int leading(const Model *m, Int number) { return m->side_at[SIDE_WIDE * number + 12]; }

static double force_at(const Model *m, Int number, const double *z) {
    return z[m->side_at[SIDE_WIDE * leading(m, number) + 2]];
}

int side_presses(const Model *m, Int number, const double *z) {
    const Int closed = m->side_at[SIDE_WIDE * number + 5];
    return closed < 0 ? force_at(m, number, z) > 0.0 : closed != 0;
}

/* Rows of a contact at x, y, rotation of one or two bodies (n), force, place, flag, and of the second of two beams the
 * force of the first; `frozen` is the symmetric matrix of the first n + 2. Return n where it presses, else 0. */
Int side_term(const Model *m, Int number, const double *z, Term *t, double *frozen) {
    const Int *given = m->side_at + SIDE_WIDE * number, first = leading(m, number);
    const Side side = side_at(m, number, z);
    const Int n = side.count, force = n, place = n + 1, flag = n + 2, wide = n + 3 + (first != number), small = n + 2;
    double *h = t->hessian;
    t->count = wide;
    for (Int i = 0; i < n; i++) t->at[i] = side.at[i];
    for (Int i = 0; i < 3; i++) t->at[n + i] = given[2 + i];
    if (first != number) t->at[n + 3] = m->side_at[SIDE_WIDE * first + 2];
    memset(t->gradient, 0, (size_t)wide * sizeof(double));
    memset(h, 0, (size_t)(wide * wide) * sizeof(double));
    memset(frozen, 0, (size_t)(small * small) * sizeof(double));
    h[flag * wide + flag] = 1.0;
    if (given[5] >= 0) t->gradient[flag] = z[given[4]];
    h[force * wide + force] = -1.0;
    t->gradient[force] = -z[given[2]];
    if (!side_presses(m, number, z)) {
        h[place * wide + place] = 1.0;
        return 0;
    }
    if (first != number) {
        t->gradient[force] += force_at(m, number, z);
        h[force * wide + n + 3] = 1.0;
    } else {
        t->gradient[force] = -side.gap;
        h[force * wide + force] = 0.0;
        for (Int i = 0; i < n; i++) {
            t->gradient[i] = -z[given[2]] * side.gap_row[i];
            h[i * wide + force] = h[force * wide + i] = frozen[i * small + force] = frozen[force * small + i] = -side.gap_row[i];
            for (Int j = 0; j < n; j++) h[i * wide + j] = frozen[i * small + j] = -z[given[2]] * side.hessian[i][j];
        }
    }
    t->gradient[place] = side.tangency;
    for (Int i = 0; i < n; i++)
        h[place * wide + i] = frozen[i * small + place] = frozen[place * small + i] = side.tangency_row[i];
    h[place * wide + place] = side.by_place;
    frozen[place * small + place] = -larger(side.curvature, 0.0) / larger(z[given[2]], SMALLEST_FORCE);
    return n;
}

/* Couple the places of two beams that press, in the symmetric matrix: by the mixed curvature of their gap. */
int sides_couple(const Model *m, Int number, const double *z, Factors *f) {
    const Int first = leading(m, number);
    if (first == number) return 1;
    const Side side = side_at(m, number, z), other = side_at(m, first, z);
    const double mixed = other.tangency_row[3] * side.along[0] + other.tangency_row[4] * side.along[1];
    const double coupling = -mixed / larger(force_at(m, number, z), SMALLEST_FORCE), matrix[4] = {0.0, coupling, coupling, 0.0};
    const Int slots[2] = {m->slot[m->side_at[SIDE_WIDE * number + 3]], m->slot[m->side_at[SIDE_WIDE * first + 3]]};
    return factors_add(f, slots, 2, matrix);
}

/* Add the change of the residual with the places of contacts that press to the dense matrix. */
void sides_columns(const Model *m, const double *z, Stage at, Term *t, Factors *f) {
    double cuts[2];
    for (Int row = 0; row < m->moved; row++) {
        cuts_of(m, z, row, cuts);
        for (int end = 0; end < 2; end++) {
            const double *shares = m->moved_shares + (2 * row + end) * m->sides;
            int moves = 0;
            for (Int k = 0; k < m->sides; k++) moves |= shares[k] != 0.0 && side_presses(m, k, z);
            if (!moves) continue;
            change_by_end(m, row, end, cuts, z, at, t);
            for (Int k = 0; k < m->sides; k++) {
                if (shares[k] == 0.0 || !side_presses(m, k, z)) continue;
                const Int column = m->slot[m->side_at[SIDE_WIDE * k + 3]];
                for (Int i = 0; i < t->count; i++) {
                    const Int slot = m->slot[t->at[i]];
                    if (slot >= 0) f->dense[slot * f->n + column] += shares[k] * t->gradient[i];
                }
            }
        }
    }
}

/* Stiffen the motions that leave the front with an element, so that what is exactly critical counts as stable. */
int sides_stiffen(const Model *m, Factors *f, const Term *element, Int number) {
    const double stiffness = NEUTRAL_STIFFNESS;
    for (Int i = 0; i < element->count - 2; i++) {
        const Int slot = m->slot[element->at[i]];
        int twice = 0;
        for (Int j = 0; j < i; j++) twice |= element->at[j] == element->at[i];
        if (slot >= 0 && !twice && m->leaves[slot] == number && !factors_add(f, &slot, 1, &stiffness)) return 0;
    }
    return 1;
}

/* Curvatures of the gaps along the beams in states (n, size), (sides, n). Return 0 if an element vanishes. */
int side_curvatures(const Model *m, const double *z, Int n, double *curvatures) {
    for (Int k = 0; k < n; k++, z += m->size) {
        if (!sides_move(m, z)) return 0;
        for (Int c = 0; c < m->sides; c++) curvatures[c * n + k] = side_at(m, c, z).curvature;
    }
    return 1;
}
