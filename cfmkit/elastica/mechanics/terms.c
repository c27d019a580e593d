/* Terms of the functional: elements, springs, point loads; each its gradient, Hessian and change along the way.
 *
 * The formulas are those of energy.py and terms.py, which a test holds equal to these. */
#include <math.h>
#include <string.h>

#include "march.h"

enum { LINE_SPRING, SLIDE_SPRING, TORSION_SPRING };

Pose pose(const Model *m, const double *z, Int k) {
    Pose p;
    p.at = m->places + 4 * k;
    const double c = m->frame[2 * k], s = m->frame[2 * k + 1], x = z[p.at[0]], y = z[p.at[1]];
    const double cos_r = cos(z[p.at[2]]), sin_r = sin(z[p.at[2]]), ax = m->arm[2 * k], ay = m->arm[2 * k + 1];
    p.arm[0] = cos_r * ax - sin_r * ay;
    p.arm[1] = sin_r * ax + cos_r * ay;
    p.place[0] = m->origin[2 * k] + c * x - s * y + p.arm[0];
    p.place[1] = m->origin[2 * k + 1] + s * x + c * y + p.arm[1];
    p.by[0][0] = c; p.by[0][1] = -s; p.by[0][2] = -p.arm[1];
    p.by[1][0] = s; p.by[1][1] = c; p.by[1][2] = p.arm[0];
    return p;
}

/* The share of its curling that a wide strip can do, g, and two derivatives by z = th^4: see wide_strip.py. */
static void curling_share(double z, double *g, double *first, double *second) {
    static const double series[] = {  /* SERIES of wide_strip.py */
        1.0, -0.005555555555555555, 4.4091710758377414e-05, -3.522589501425479e-07,
        2.8148759863668038e-09, -2.2493633758277303e-11, 1.7974634993836147e-13,
        -1.4363508775581866e-15, 1.1477862247352577e-17};
    *g = *first = *second = 0.0;
    if (z < 1.0) {
        for (int k = (int)(sizeof series / sizeof *series) - 1; k >= 0; k--) {
            *second = *second * z + 2.0 * *first;
            *first = *first * z + *g;
            *g = *g * z + series[k];
        }
        return;
    }
    const double th = sqrt(sqrt(z)), e = exp(-th), c = cos(th), s = sin(th), below = 1.0 + 2.0 * e * s - e * e;
    const double f = 2.0 * e * (1.0 - e * e) * s / (below * below);
    const double grows = 2.0 * e * ((1.0 + e * e) * s + (1.0 - e * e) * c) / (below * below)
                         - 2.0 * f * (1.0 + 2.0 * e * c + e * e) / below;
    *g = 2.0 / th * (1.0 - 2.0 * e * c + e * e) / below;
    const double once = (4.0 * f - *g) / th, twice = (4.0 * grows - 2.0 * once) / th, cube = th * th * th;
    *first = once / (4.0 * cube);
    *second = (twice - 3.0 * once / th) / (16.0 * cube * cube);
}

/* Moment and stiffness of bending at a point. */
static void bending(const Model *m, Int o, double curvature, double *moment, double *stiffness) {
    const double rigidity = m->rigidity[o];
    *moment = rigidity * curvature;
    *stiffness = rigidity;
    if (!m->curl || m->hindrance[o] == 0.0) return;
    const double n = m->hindrance[o], whole = curvature + m->rest[o], by = 2.0 * m->curl[o] * whole;
    double g, first, second;
    curling_share(m->curl[o] * whole * whole, &g, &first, &second);
    const double stiff = 1.0 + n * (1.0 - g), rising = -n * first * by;
    const double curved = -n * (second * by * by + 2.0 * m->curl[o] * first);
    *moment = rigidity * (curvature * stiff + 0.5 * curvature * curvature * rising);
    *stiffness = rigidity * (stiff + 2.0 * curvature * rising + 0.5 * curvature * curvature * curved);
}

/* Change of the moment of bending times the weight of a point, over that weight, where its element grows by a share of its
 * length and its curvature at rest changes. */
double bending_change(const Model *m, Int o, double curvature, double grows, double rest) {
    double moment, stiffness, g, first, second;
    bending(m, o, curvature, &moment, &stiffness);
    if (!m->curl || m->hindrance[o] == 0.0) return -grows * moment;
    const double n = m->hindrance[o], curl = m->curl[o], whole = curvature + m->rest[o], by = 2.0 * curl * whole;
    const double half = 0.5 * curvature * curvature;
    curling_share(curl * whole * whole, &g, &first, &second);
    const double by_rest = -n * (curvature * first * by + half * (second * by * by + 2.0 * curl * first));
    const double by_curl = -n * whole * (curvature * first * whole + half * (second * by * whole + 2.0 * first));
    return -grows * moment + m->rigidity[o] * (by_rest * rest - 2.0 * grows * curl * by_curl);
}

/* Sums over the Gauss points of an element; stiffness: lower triangle of the rotations' Hessian, by rows. */
typedef struct {
    double rotation[MAX_SHAPES], change[MAX_SHAPES], by_x[MAX_SHAPES], by_y[MAX_SHAPES];
    double reach[2], reach_change[2], xx, yy, xy;
    double stiffness[MAX_SHAPES * (MAX_SHAPES + 1) / 2];
} Sums;

/* Rotations and their slopes at the Gauss points. */
FAST static void rotations(const Model *m, Int e, const double *restrict phi, double *restrict turn, double *restrict curvature) {
    const Int points = m->points;
    memcpy(turn, m->angle + e * points, (size_t)points * sizeof(double));
    memset(curvature, 0, (size_t)points * sizeof(double));
    for (Int k = 0; k <= m->degree; k++) {
        const double *restrict N = m->values_by_shape + k * points, *restrict S = m->slopes_by_shape + k * points;
        for (Int q = 0; q < points; q++) {
            turn[q] += phi[k] * N[q];
            curvature[q] += phi[k] * S[q];
        }
    }
}

/* Add what one point gives to the rotations: bending and shear, and to their Hessian unless `triangle` is 0. */
FAST static void add_point(Int shapes, Int triangle, const double *restrict N, const double *restrict S,
                           const double *restrict products, double bent, double turned, double stiff, double ux, double uy,
                           Sums *restrict sum) {
    for (Int k = 0; k < shapes; k++) sum->rotation[k] += bent * S[k] - turned * N[k];
    if (!triangle) return;
    for (Int k = 0; k < shapes; k++) { sum->by_x[k] -= ux * N[k]; sum->by_y[k] -= uy * N[k]; }
    for (Int k = 0; k < triangle; k++) sum->stiffness[k] += stiff * products[k];
}

static void gauss_points(const Model *m, Int e, const double *phi, const double *n1, const double *load,
                         const double *growth, Sums *sum, int with_hessian) {
    const Int shapes = m->degree + 1, triangle = with_hessian ? shapes * (shapes + 1) / 2 : 0;
    const int grows = growth[0] != 0.0 || growth[1] != 0.0;
    double turn[MAX_POINTS], curvature[MAX_POINTS];
    rotations(m, e, phi, turn, curvature);
    for (Int q = 0, o = e * m->points; q < m->points; q++, o++) {
        const double *N = m->values + q * shapes, *S = m->slopes + q * shapes;
        const double c = cos(turn[q]), s = sin(turn[q]), w = m->weight[o], a = m->axial[o], b = m->shear[o];
        const double ahead = m->ahead[o], nx = n1[0] + load[0] * ahead, ny = n1[1] + load[1] * ahead;
        const double normal = nx * c + ny * s, shear = ny * c - nx * s;
        const double f = 1.0 + (a - b) * normal, g = (a - b) * shear;
        double moment, stiffness;
        bending(m, o, curvature[q], &moment, &stiffness);
        sum->reach[0] += w * ((1.0 + a * normal) * c - b * shear * s);
        sum->reach[1] += w * ((1.0 + a * normal) * s + b * shear * c);
        add_point(shapes, triangle, N, S, m->products + q * triangle, w * moment, w * shear * f,
                  w * (normal * f - g * shear), w * (g * c - f * s), w * (g * s + f * c), sum);
        if (grows) {
            const double gx = growth[0] * ahead, gy = growth[1] * ahead;
            const double more_normal = gx * c + gy * s, more_shear = gy * c - gx * s;
            const double more = w * (more_shear * f + g * more_normal);
            for (Int k = 0; k < shapes; k++) sum->change[k] -= more * N[k];
            sum->reach_change[0] += w * (a * more_normal * c - b * more_shear * s);
            sum->reach_change[1] += w * (a * more_normal * s + b * more_shear * c);
        }
        if (!with_hessian) continue;
        const double stiffer = w * (stiffness - m->rigidity[o]);
        double *row = sum->stiffness;
        for (Int i = 0; stiffer != 0.0 && i < shapes; row += ++i)
            for (Int j = 0; j <= i; j++) row[j] += stiffer * S[i] * S[j];
        sum->xx -= w * (a * c * c + b * s * s);
        sum->yy -= w * (a * s * s + b * c * c);
        sum->xy -= w * (a - b) * c * s;
    }
}

static void element_hessian(const Model *m, const Pose *ends, const double *first, const double *last,
                            const Sums *sum, Term *t) {
    const Int shapes = m->degree + 1, count = t->count, fx = count - 2, fy = count - 1;
    double *h = t->hessian;
    memset(h, 0, (size_t)(count * count) * sizeof(double));
    const double *row = sum->stiffness;
    for (Int i = 0; i < shapes; row += ++i) {
        const Int a = local_shape(i);
        for (Int j = 0; j <= i; j++) {
            const Int b = local_shape(j);
            h[a * count + b] = h[b * count + a] = row[j];
        }
        h[a * count + fx] = h[fx * count + a] = sum->by_x[i];
        h[a * count + fy] = h[fy * count + a] = sum->by_y[i];
    }
    for (int side = 0; side < 2; side++)
        for (Int k = 0; k < 3; k++) {
            const Int a = 4 * side + k;
            const double sign = side ? 1.0 : -1.0;
            h[a * count + fx] = h[fx * count + a] = sign * ends[side].by[0][k];
            h[a * count + fy] = h[fy * count + a] = sign * ends[side].by[1][k];
        }
    h[fx * count + fx] = sum->xx;
    h[fy * count + fy] = sum->yy;
    h[fx * count + fy] = h[fy * count + fx] = sum->xy;
    h[2 * count + 2] += first[0] * ends[0].arm[0] + first[1] * ends[0].arm[1];
    h[6 * count + 6] -= last[0] * ends[1].arm[0] + last[1] * ends[1].arm[1];
}

static void element(const Model *m, Int e, const double *z, Stage at, int with_hessian, Term *t) {
    const Int shapes = m->degree + 1, count = m->degree + 9, *own = m->unknowns + e * count;
    const double *line = m->line + 4 * e, length = m->length[e];
    const double load[2] = {at.share * line[0] + at.drive * line[2], at.share * line[1] + at.drive * line[3]};
    const double growth[2] = {at.by_share * line[0] + at.by_drive * line[2], at.by_share * line[1] + at.by_drive * line[3]};
    const Pose ends[2] = {pose(m, z, m->ends[2 * e]), pose(m, z, m->ends[2 * e + 1])};
    const double last[2] = {z[own[count - 2]], z[own[count - 1]]};
    const double first[2] = {last[0] + load[0] * length, last[1] + load[1] * length};
    const Int triangle = shapes * (shapes + 1) / 2;
    double phi[MAX_SHAPES];
    Sums sum;
    for (Int k = 0; k < shapes; k++) { /* not the whole of the arrays, which are long */
        phi[k] = z[own[local_shape(k)]];
        sum.rotation[k] = sum.change[k] = sum.by_x[k] = sum.by_y[k] = 0.0;
    }
    sum.reach[0] = sum.reach[1] = sum.reach_change[0] = sum.reach_change[1] = sum.xx = sum.yy = sum.xy = 0.0;
    if (with_hessian) memcpy(sum.stiffness, m->bend + e * triangle, (size_t)triangle * sizeof(double));
    gauss_points(m, e, phi, last, load, growth, &sum, with_hessian);
    t->count = count;
    memcpy(t->at, own, (size_t)count * sizeof(Int));
    memset(t->gradient, 0, (size_t)count * sizeof(double));
    memset(t->change, 0, (size_t)count * sizeof(double));
    for (Int k = 0; k < shapes; k++) { t->gradient[local_shape(k)] = sum.rotation[k]; t->change[local_shape(k)] = sum.change[k]; }
    for (Int k = 0; k < 3; k++) {
        t->gradient[k] = -(first[0] * ends[0].by[0][k] + first[1] * ends[0].by[1][k]);
        t->gradient[4 + k] = last[0] * ends[1].by[0][k] + last[1] * ends[1].by[1][k];
        t->change[k] = -length * (growth[0] * ends[0].by[0][k] + growth[1] * ends[0].by[1][k]);
    }
    for (int k = 0; k < 2; k++) {
        const double gap = m->gap[2 * e + k];
        t->gradient[count - 2 + k] = ends[1].place[k] - ends[0].place[k] - sum.reach[k] - (1.0 - at.share) * gap;
        t->change[count - 2 + k] = at.by_share * gap - sum.reach_change[k];
    }
    if (with_hessian) element_hessian(m, ends, first, last, &sum, t);
}

static void line_spring(const double *value, const Pose *ends, int both, Stage at, Term *t) {
    const Int n = both ? 6 : 3;
    const double dx = (both ? ends[1].place[0] : value[3]) - ends[0].place[0];
    const double dy = (both ? ends[1].place[1] : value[4]) - ends[0].place[1];
    const double length = hypot(dx, dy), ex = dx / length, ey = dy / length;
    const double force = value[0] * (length - value[1] - at.share * value[2]), change = -value[0] * at.by_share * value[2];
    double stretch[6], turn[6];
    t->count = n;
    for (Int i = 0; i < n; i++) {
        const Pose *p = ends + i / 3;
        const double sign = i < 3 ? -1.0 : 1.0;
        t->at[i] = p->at[i % 3];
        stretch[i] = sign * (ex * p->by[0][i % 3] + ey * p->by[1][i % 3]);
        turn[i] = sign * (ex * p->by[1][i % 3] - ey * p->by[0][i % 3]);
        t->gradient[i] = force * stretch[i];
        t->change[i] = change * stretch[i];
    }
    for (Int i = 0; i < n; i++)
        for (Int j = 0; j < n; j++)
            t->hessian[i * n + j] = value[0] * stretch[i] * stretch[j] + force / length * turn[i] * turn[j];
    t->hessian[2 * n + 2] += force * (ex * ends[0].arm[0] + ey * ends[0].arm[1]);
    if (both) t->hessian[5 * n + 5] -= force * (ex * ends[1].arm[0] + ey * ends[1].arm[1]);
}

static void slide_spring(const double *value, const Pose *p, Stage at, Term *t) {
    const double gap = (p->place[0] - value[4]) * value[2] + (p->place[1] - value[5]) * value[3] - at.share * value[1];
    double reach[3];
    t->count = 3;
    for (Int i = 0; i < 3; i++) {
        t->at[i] = p->at[i];
        reach[i] = value[2] * p->by[0][i] + value[3] * p->by[1][i];
        t->gradient[i] = value[0] * gap * reach[i];
        t->change[i] = -value[0] * at.by_share * value[1] * reach[i];
    }
    for (Int i = 0; i < 3; i++)
        for (Int j = 0; j < 3; j++) t->hessian[i * 3 + j] = value[0] * reach[i] * reach[j];
    t->hessian[8] -= value[0] * gap * (value[2] * p->arm[0] + value[3] * p->arm[1]);
}

static void torsion_spring(const Model *m, const double *value, const Int *places, const double *z, Stage at, Term *t) {
    double sign[2], gap = -at.share * value[1];
    t->count = 0;
    for (int side = 0; side < 2; side++)
        if (places[side] >= 0) {
            sign[t->count] = side ? 1.0 : -1.0;
            t->at[t->count] = m->places[4 * places[side] + 3];
            gap += sign[t->count] * z[t->at[t->count]];
            t->count++;
        }
    for (Int i = 0; i < t->count; i++) {
        t->gradient[i] = value[0] * gap * sign[i];
        t->change[i] = -value[0] * at.by_share * value[1] * sign[i];
        for (Int j = 0; j < t->count; j++) t->hessian[i * t->count + j] = value[0] * sign[i] * sign[j];
    }
}

static void spring(const Model *m, Int number, const double *z, Stage at, Term *t) {
    const Int *given = m->spring_at + 3 * number;
    const double *value = m->spring + 6 * number;
    Pose ends[2];
    if (given[0] == TORSION_SPRING) { torsion_spring(m, value, given + 1, z, at, t); return; }
    ends[0] = pose(m, z, given[1]);
    if (given[0] == SLIDE_SPRING) { slide_spring(value, ends, at, t); return; }
    if (given[2] >= 0) ends[1] = pose(m, z, given[2]);
    line_spring(value, ends, given[2] >= 0, at, t);
}

/* Force of a load that may turn with its place. */
static void load_force(const Model *m, Int number, const double *z, const Pose *p, double *fx, double *fy) {
    const double *value = m->load + 3 * number;
    *fx = value[0]; *fy = value[1];
    if (!m->load_at[3 * number + 2]) return;
    const double c = cos(z[p->at[3]]), s = sin(z[p->at[3]]);
    *fx = c * value[0] - s * value[1];
    *fy = s * value[0] + c * value[1];
}

/* Displacement that the loads which grow with the drive work on: see `load_displacement` of results/path.py. */
double load_work(const Model *m, const double *z) {
    double work = 0.0;
    for (Int k = 0; k < m->loads; k++) {
        const Int place = m->load_at[3 * k];
        const Pose p = pose(m, z, place);
        double fx, fy, moved[2];
        if (!m->load_at[3 * k + 1]) continue;
        load_force(m, k, z, &p, &fx, &fy);
        for (int i = 0; i < 2; i++) moved[i] = p.place[i] - (m->origin[2 * place + i] + m->arm[2 * place + i]);
        work += fx * moved[0] + fy * moved[1] + m->load[3 * k + 2] * z[p.at[3]];
    }
    return work;
}

static void point_load(const Model *m, Int number, const double *z, Stage at, Term *t) {
    const Int *given = m->load_at + 3 * number;
    const double *value = m->load + 3 * number, factor = given[1] ? at.drive : at.share;
    const double grows = given[1] ? at.by_drive : at.by_share;
    const Pose p = pose(m, z, given[0]);
    double fx, fy;
    load_force(m, number, z, &p, &fx, &fy);
    t->count = 4;
    memcpy(t->at, p.at, 4 * sizeof(Int));
    memset(t->hessian, 0, 16 * sizeof(double));
    for (int k = 0; k < 3; k++) {
        const double moves = fx * p.by[0][k] + fy * p.by[1][k];
        t->gradient[k] = -factor * moves;
        t->change[k] = -grows * moves;
        if (given[2]) t->hessian[4 * k + 3] = factor * (fy * p.by[0][k] - fx * p.by[1][k]);
    }
    t->gradient[3] = -factor * value[2];
    t->change[3] = -grows * value[2];
    t->hessian[10] = factor * (fx * p.arm[0] + fy * p.arm[1]);
}

Stage stage(const Model *m, double way) {
    const Stage at = {m->ramp ? 0.0 : way, m->ramp ? way : 1.0, m->ramp ? 0.0 : 1.0, m->ramp ? 1.0 : 0.0};
    return at;
}

Int terms(const Model *m) { return m->springs + m->loads + m->contacts + m->elements; }

/* Springs, loads and contacts come first: their unknowns leave the front with the last element that holds them. */
void term(const Model *m, Int number, const double *z, Stage at, int with_hessian, Term *out) {
    if (number < m->springs) spring(m, number, z, at, out);
    else if (number < m->springs + m->loads) point_load(m, number - m->springs, z, at, out);
    else if (number < terms(m) - m->elements) contact_term(m, number - m->springs - m->loads, z, out);
    else element(m, number - m->springs - m->loads - m->contacts, z, at, with_hessian, out);
}
