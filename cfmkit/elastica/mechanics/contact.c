/* Contacts of nodes as terms: stops that limit a motion or a rotation, round pads on obstacles; without friction.
 *
 * The formulas are those of `contact_contribution` and `measure` in contact/terms.py and of `ObstacleEdge.distance`, which a
 * test holds equal to these. */
#include <math.h>
#include <string.h>

#include "march.h"

#define BESIDE_END 1e-9 /* share of a part by which the foot of a point may lie beyond its end: rounding */
#define ROUND 6.283185307179586

enum { ROTATION_STOP, MOTION_STOP, PAD };

static double from_segment(const double *part, int first, int last, double x, double y, Distance *d) {
    const double dx = x - part[0], dy = y - part[1], along = dx * part[2] + dy * part[3];
    const double slack = BESIDE_END * (1.0 + part[4]);
    d->normal[0] = -part[3];
    d->normal[1] = part[2];
    d->value = dx * d->normal[0] + dy * d->normal[1];
    d->curvature = 0.0;
    return (first || along >= -slack) && (last || along <= part[4] + slack) ? fabs(d->value) : HUGE_VAL;
}

static double from_arc(const double *part, double x, double y, Distance *d) {
    const double dx = x - part[0], dy = y - part[1], reach = sqrt(dx * dx + dy * dy), safe = reach == 0.0 ? 1.0 : reach;
    d->value = part[5] * (reach - part[2]);
    d->normal[0] = part[5] * dx / safe;
    d->normal[1] = part[5] * dy / safe;
    d->curvature = part[5] / safe;
    if (fabs(part[4]) >= ROUND - BESIDE_END) return fabs(d->value);
    double turned = fmod((part[4] > 0.0 ? 1.0 : -1.0) * (atan2(dy, dx) - part[3]), ROUND);
    if (turned < 0.0) turned += ROUND;
    return turned <= fabs(part[4]) + BESIDE_END || turned >= ROUND - BESIDE_END ? fabs(d->value) : HUGE_VAL;
}

/* Signed distance of a place from an outline, from the nearest of its parts. */
Distance outline_distance(const Outline *o, double x, double y) {
    Distance best = {0.0, {0.0, 0.0}, 0.0}, other;
    double least = HUGE_VAL;
    for (Int k = 0; k < o->segments + o->arcs; k++) {
        const double *part = o->parts + 6 * k;
        const double size = k < o->segments
            ? from_segment(part, k == 0 && !o->closed, k == o->segments - 1 && !o->closed, x, y, &other)
            : from_arc(part, x, y, &other);
        if (k == 0 || size < least) { best = other; least = size; }
    }
    return best;
}

/* Gap of a contact with its first and second derivatives by up to three unknowns; return how many these are. */
static Int measure(const Model *m, const Int *given, const double *value, const double *z, double *gap, Int *at,
                   double *gradient, double *hessian) {
    if (given[0] == ROTATION_STOP) {
        at[0] = m->places[4 * given[1] + 3];
        *gap = value[0] - value[1] * z[at[0]];
        gradient[0] = -value[1];
        hessian[0] = 0.0;
        return 1;
    }
    const Pose p = pose(m, z, given[1]);
    double normal[2], bend = 0.0;
    if (given[0] == MOTION_STOP) {
        const double *origin = m->origin + 2 * given[1], *arm = m->arm + 2 * given[1];
        normal[0] = -value[2];
        normal[1] = -value[3];
        *gap = value[0] + normal[0] * (p.place[0] - (origin[0] + arm[0])) + normal[1] * (p.place[1] - (origin[1] + arm[1]));
    } else {
        const Outline o = {m->edge + 6 * given[4], given[5], given[6], given[7]};
        const Distance d = outline_distance(&o, p.place[0] * value[5], p.place[1] * value[5]);
        normal[0] = d.normal[0];
        normal[1] = d.normal[1];
        *gap = (d.value - value[0]) / value[5];
        bend = d.curvature * value[5];
    }
    for (int i = 0; i < 3; i++) {
        const double across = normal[1] * p.by[0][i] - normal[0] * p.by[1][i];
        at[i] = p.at[i];
        gradient[i] = normal[0] * p.by[0][i] + normal[1] * p.by[1][i];
        for (int j = 0; j < 3; j++)
            hessian[3 * i + j] = bend * across * (normal[1] * p.by[0][j] - normal[0] * p.by[1][j]);
    }
    hessian[8] -= normal[0] * p.arm[0] + normal[1] * p.arm[1];
    return 3;
}

/* P - f g - f^2 c/2 of a closed contact, of an open one -f^2/2: it has no force. */
void contact_term(const Model *m, Int number, const double *z, Term *t) {
    const Int *given = m->contact_at + 8 * number;
    const double *value = m->contact + 6 * number, force = z[given[2]];
    double gap, gradient[3], hessian[9];
    const Int n = measure(m, given, value, z, &gap, t->at, gradient, hessian), count = n + 1;
    const int closed = given[3] < 0 ? force > gap + GAP_ROUNDING : given[3] != 0;
    t->count = count;
    t->at[n] = given[2];
    memset(t->gradient, 0, (size_t)count * sizeof(double));
    memset(t->change, 0, (size_t)count * sizeof(double));
    memset(t->hessian, 0, (size_t)(count * count) * sizeof(double));
    t->gradient[n] = closed ? -gap - value[4] * force : -force;
    t->hessian[count * count - 1] = closed ? -value[4] : -1.0;
    if (!closed) return;
    for (Int i = 0; i < n; i++) {
        t->gradient[i] = -force * gradient[i];
        t->hessian[i * count + n] = t->hessian[n * count + i] = -gradient[i];
        for (Int j = 0; j < n; j++) t->hessian[i * count + j] = -force * hessian[i * n + j];
    }
}

/* Gaps of all contacts of nodes in states (n, size), (contacts, n). */
int contact_gaps(const Model *m, const double *z, Int n, double *gaps) {
    Int at[3];
    double gradient[3], hessian[9];
    for (Int k = 0; k < n; k++, z += m->size)
        for (Int c = 0; c < m->contacts; c++)
            measure(m, m->contact_at + 8 * c, m->contact + 6 * c, z, gaps + c * n + k, at, gradient, hessian);
    return CONVERGED;
}
