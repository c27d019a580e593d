/* Sides of beams that touch obstacles at places that are unknowns: elements that end there, and the rows of a contact.
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

enum { N_LAW = 2 }; /* numbers of a moving element before the coefficients of its angle: length and rigidity of its beam */

static double polynomial(const double *coefficients, Int count, double t, double *slope) {
    double value = 0.0;
    *slope = 0.0;
    for (Int k = count - 1; k >= 0; k--) {
        *slope = *slope * t + value;
        value = value * t + coefficients[k];
    }
    return value;
}

static void cuts_of(const Model *m, const double *z, Int row, double *cuts) {
    for (int end = 0; end < 2; end++) {
        cuts[end] = m->moved_fixed[2 * row + end];
        for (Int k = 0; k < m->sides; k++)
            cuts[end] += m->moved_shares[(2 * row + end) * m->sides + k] * z[m->side_at[12 * k + 3]];
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
        polynomial(law + N_LAW, m->coefficients, cuts[0] + width * u, &turned);
        turned *= end ? u : 1.0 - u;
        const double c = cos(turn), s = sin(turn);
        const double nx = z[own[count - 2]] + load[0] * m->ahead[o], ny = z[own[count - 1]] + load[1] * m->ahead[o];
        const double normal = nx * c + ny * s, shear = ny * c - nx * s, f = 1.0 + (a - b) * normal;
        const double more_normal = further * (load[0] * c + load[1] * s) + shear * turned;
        const double more_shear = further * (load[1] * c - load[0] * s) - normal * turned;
        const double bent = -w * m->rigidity[o] * grows * curvature;
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

/* The side of a beam at a contact: gap, tangency, their derivatives by x, y and rotation, and the gap's curvature. */
typedef struct { double gap, tangency, gap_row[3], tangency_row[3], bulge[2][2], by_place, curvature; Int at[3]; } Side;

/* Curvature of the rotation at an end of an element, by the arc length. */
static double bend_at(const Model *m, const double *z, Int e, int end) {
    const Int *own = m->unknowns + e * (m->degree + 9);
    double slope = z[own[7]] - z[own[3]];
    for (Int k = 2; k <= m->degree; k++)
        slope += 2.0 * sqrt((double)k - 0.5) * (end || k % 2 ? 1.0 : -1.0) * z[own[local_shape(k)]];
    return slope / m->length[e];
}

static Side side_at(const Model *m, Int number, const double *z) {
    const Int *given = m->side_at + 12 * number, *places = m->places + 4 * given[1], row = given[8];
    const double *value = m->side + 2 * number, *law = m->moved_law + row * (N_LAW + m->coefficients), length = value[1];
    double turning;
    Side side;
    const double angle = polynomial(law + N_LAW, m->coefficients, z[given[3]], &turning) + z[places[2]];
    const double along[2] = {cos(angle), sin(angle)}, x = m->origin[2 * given[1]] + z[places[0]];
    const double y = m->origin[2 * given[1] + 1] + z[places[1]];
    const Outline o = {m->edge + 6 * given[6], given[9], given[10], given[11]};
    const Distance d = outline_distance(&o, x * length, y * length);
    const double sideways[2] = {d.normal[1], -d.normal[0]}, bend = d.curvature * length;
    const double rises = d.normal[1] * along[0] - d.normal[0] * along[1];
    for (int i = 0; i < 2; i++) {
        for (int j = 0; j < 2; j++) side.bulge[i][j] = bend * sideways[i] * sideways[j];
        side.gap_row[i] = d.normal[i];
        side.tangency_row[i] = side.bulge[i][0] * along[0] + side.bulge[i][1] * along[1];
    }
    for (int i = 0; i < 3; i++) side.at[i] = places[i];
    side.gap = d.value / length - value[0];
    side.tangency = d.normal[0] * along[0] + d.normal[1] * along[1];
    side.gap_row[2] = 0.0;
    side.tangency_row[2] = rises;
    side.by_place = rises * turning;
    const double bent = turning / law[0] + 0.5 * (bend_at(m, z, given[0], 1) + bend_at(m, z, given[0] + 1, 0));
    side.curvature = bent * rises + side.tangency_row[0] * along[0] + side.tangency_row[1] * along[1];
    return side;
}

int side_presses(const Model *m, Int number, const double *z) {
    const Int *given = m->side_at + 12 * number;
    return given[5] < 0 ? z[given[2]] > 0.0 : given[5] != 0;
}

/* Rows of a contact at x, y, rotation, force, place, flag; `frozen` is the symmetric matrix of the first five. */
int side_term(const Model *m, Int number, const double *z, Term *t, double *frozen) {
    const Int *given = m->side_at + 12 * number;
    const Side side = side_at(m, number, z);
    const double force = z[given[2]];
    double *h = t->hessian;
    t->count = 6;
    for (int i = 0; i < 3; i++) t->at[i] = side.at[i];
    for (int i = 0; i < 3; i++) t->at[3 + i] = given[2 + i];
    memset(t->gradient, 0, 6 * sizeof(double));
    memset(t->change, 0, 6 * sizeof(double));
    memset(h, 0, 36 * sizeof(double));
    memset(frozen, 0, 25 * sizeof(double));
    h[35] = 1.0;
    if (given[5] >= 0) t->gradient[5] = z[given[4]];
    if (!side_presses(m, number, z)) {
        t->gradient[3] = -force;
        h[21] = -1.0;
        h[28] = 1.0;
        return 0;
    }
    t->gradient[3] = -side.gap;
    t->gradient[4] = side.tangency;
    for (int i = 0; i < 3; i++) {
        t->gradient[i] = -force * side.gap_row[i];
        h[6 * i + 3] = h[18 + i] = frozen[5 * i + 3] = frozen[15 + i] = -side.gap_row[i];
        h[24 + i] = frozen[5 * i + 4] = frozen[20 + i] = side.tangency_row[i];
        for (int j = 0; i < 2 && j < 2; j++) h[6 * i + j] = frozen[5 * i + j] = -force * side.bulge[i][j];
    }
    h[28] = side.by_place;
    frozen[24] = -larger(side.curvature, 0.0) / larger(force, SMALLEST_FORCE);
    return 1;
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
                const Int column = m->slot[m->side_at[12 * k + 3]];
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
