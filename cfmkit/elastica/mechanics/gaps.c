/* Least gaps of sides of beams of one thickness to obstacles, pads and other such beams, in many states.
 *
 * The method is that of `SideGaps` in contact/side_gaps.py: gaps and their slopes at places along each element, then the
 * place where the slope is zero wherever a least gap may be small; of another beam the nearest place is found as in
 * contact/pair_gaps.py. A test holds them equal. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "march.h"

#define MAX_ALONG 64
#define NEAR_GAP 1e-3        /* within which the least gap is found exactly */
#define SLOPE_LEVEL 1e-9     /* of the gap where it is least: its square is the error */
#define GAP_RESOLUTION 1e-13
#define N_ROUNDS 20
#define LOWEST_SHARE 0.75       /* of the least gap found, below which none is passed over */
#define FASTER 1.05             /* than at Gauss points, by which a gap may change along a beam */
#define FARTHER 1.5             /* than Gauss points say, by which an element may move between two states */
#define WIDEST 0.1              /* share of an element between two places, and some more */
#define NEAR_DISTANCE 0.1       /* within which the nearest place of another beam is found exactly */
#define N_FOOT_STEPS 10
#define FOOT_STEP 1e-7          /* of an element, behind which there is none: its square is the error */
#define LEAST_FOOT_SLOPE 0.1    /* share of that of a straight beam, below which its curvature is left out */

/* Places along an element, and matrices from an element's unknowns and values at its Gauss points to these places. */
typedef struct {
    Int along;
    const double *fractions, *weights, *values, *integrals, *interpolation; /* (along), (q), (shapes, along), (q, along) twice */
    const double *series; /* (q, q): from values at Gauss points to Legendre coefficients */
    double by_last[MAX_POINTS + 1], by_second[MAX_POINTS + 1]; /* of the recursion of Legendre polynomials */
} GapTables;

/* Gap at a place, its slope, and what it is not below wherever it is not exact. */
typedef struct { double gap, slope, floor; } Beside;

/* A line of an element in one state: start, slopes at Gauss points and their series, angle at rest, rotation; places on it,
 * and what is beside them. */
typedef struct {
    double start[2], x[MAX_POINTS], y[MAX_POINTS], angle[MAX_POINTS], phi[MAX_SHAPES], speed[MAX_POINTS];
    double series[4][MAX_POINTS], place[2][MAX_ALONG], angle_at[MAX_ALONG];
    double fastest, moved; /* way by the parameter of the element; farthest that a place may have moved since the state before */
    int used, has_series, has_places;
    Beside seen[MAX_ALONG];
} Line;

typedef struct { const Model *m; GapTables tables; Line *lines; } Lines; /* of all elements in one state */

/* The side of a beam and what it may touch: an outline, a pad at an attachment, or the elements of another beam. */
typedef struct {
    Lines *of;
    Outline outline;
    Int first, count, pad, first_partner, partners; /* rows of its elements and those of the other beam; -1 if no pad */
    const double *elements; /* (k, 2): number, slack */
    double half, unit, radius, centre[2]; /* half the thickness; unit of length [m]; radius of the pad or of the other beam */
    double margin;                        /* that is left of the gap, whatever has moved since it was measured */
    int watches;                          /* far gaps may be lower bounds, of most places then none is measured */
} Side;

static GapTables make_tables(const Model *m, const double *packed, Int along) {
    const Int q = m->points, shapes = m->degree + 1;
    GapTables t = {along, packed, packed + along, packed + along + q, NULL, NULL, NULL, {0.0}, {0.0}};
    t.integrals = t.values + along * shapes;
    t.interpolation = t.integrals + along * q;
    t.series = t.interpolation + along * q;
    for (Int k = 1; k <= q; k++) {
        t.by_last[k] = (double)(2 * k - 1) / (double)k;
        t.by_second[k] = (double)(k - 1) / (double)k;
    }
    return t;
}

FAST static void trace_line(const Lines *l, Int e, const double *z, Stage at) {
    const Model *m = l->m;
    const Int q = m->points, shapes = m->degree + 1, count = m->degree + 9, *own = m->unknowns + e * count;
    const double *load = m->line + 4 * e, qx = at.share * load[0] + at.drive * load[2];
    const double qy = at.share * load[1] + at.drive * load[3];
    const Pose start = pose(m, z, m->ends[2 * e]);
    Line *line = l->lines + e;
    double turn[MAX_POINTS], farther = 0.0;
    line->moved = hypot(start.place[0] - line->start[0], start.place[1] - line->start[1]);
    memcpy(line->start, start.place, sizeof start.place);
    memcpy(line->angle, m->angle + e * q, (size_t)q * sizeof(double));
    memcpy(turn, line->angle, (size_t)q * sizeof(double));
    for (Int k = 0; k < shapes; k++) {
        const double phi = line->phi[k] = z[own[local_shape(k)]], *values = m->values_by_shape + k * q;
        for (Int i = 0; i < q; i++) turn[i] += phi * values[i];
    }
    line->fastest = 0.0;
    for (Int i = 0, o = e * q; i < q; i++, o++) {
        const double c = cos(turn[i]), n = sin(turn[i]), weight = l->tables.weights[i];
        const double nx = z[own[count - 2]] + qx * m->ahead[o], ny = z[own[count - 1]] + qy * m->ahead[o];
        const double stretch = 1.0 + m->axial[o] * (nx * c + ny * n), slip = m->shear[o] * (ny * c - nx * n);
        const double speed = line->speed[i] = m->weight[o] / weight;
        const double x = (stretch * c - slip * n) * speed, y = (stretch * n + slip * c) * speed;
        farther += weight * (fabs(x - line->x[i]) + fabs(y - line->y[i]));
        line->x[i] = x;
        line->y[i] = y;
        line->fastest = fmax(line->fastest, FASTER * speed * (fabs(stretch) + fabs(slip)));
    }
    line->moved += FARTHER * farther;
    line->has_series = line->has_places = 0;
}

FAST static void find_places(const GapTables *t, const Model *m, Line *line) {
    const Int n = t->along;
    for (Int p = 0; p < n; p++) {
        line->place[0][p] = line->start[0];
        line->place[1][p] = line->start[1];
        line->angle_at[p] = 0.0;
    }
    for (Int k = 0; k < m->points; k++) {
        const double *upto = t->integrals + k * n, *through = t->interpolation + k * n;
        for (Int p = 0; p < n; p++) {
            line->place[0][p] += upto[p] * line->x[k];
            line->place[1][p] += upto[p] * line->y[k];
            line->angle_at[p] += through[p] * line->angle[k];
        }
    }
    for (Int k = 0; k <= m->degree; k++)
        for (Int p = 0; p < n; p++) line->angle_at[p] += t->values[k * n + p] * line->phi[k];
    line->has_places = 1;
}

/* Legendre polynomials p (points + 1) and their primitives (points) at any place of an element. */
static void polynomials(const Lines *l, Line *line, double u, double *p, double *primitive) {
    const Int q = l->m->points;
    const GapTables *t = &l->tables;
    const double v = 2.0 * u - 1.0;
    if (!line->has_series) {
        const double *given[4] = {line->x, line->y, line->angle, line->speed};
        for (int i = 0; i < 4; i++)
            for (Int k = 0; k < q; k++) {
                line->series[i][k] = 0.0;
                for (Int j = 0; j < q; j++) line->series[i][k] += t->series[k * q + j] * given[i][j];
            }
        line->has_series = 1;
    }
    p[0] = 1.0;
    p[1] = v;
    for (Int k = 2; k <= q; k++) p[k] = t->by_last[k] * v * p[k - 1] - t->by_second[k] * p[k - 2];
    for (Int k = 0; k < q; k++) primitive[k] = 0.5 * (k ? (p[k + 1] - p[k - 1]) / (double)(2 * k + 1) : v + 1.0);
}

/* Place, rotation from rest and angle at rest at any place; return the arc length up to it. */
static double locate(const Lines *l, Line *line, double u, double *place, double *turn, double *angle) {
    const Int q = l->m->points, degree = l->m->degree;
    double p[MAX_POINTS + 1], primitive[MAX_POINTS], upto = 0.0;
    polynomials(l, line, u, p, primitive);
    memcpy(place, line->start, sizeof line->start);
    *angle = 0.0;
    for (Int k = 0; k < q; k++) {
        place[0] += primitive[k] * line->series[0][k];
        place[1] += primitive[k] * line->series[1][k];
        *angle += p[k] * line->series[2][k];
        upto += primitive[k] * line->series[3][k];
    }
    *turn = line->phi[0] * (1.0 - u) + line->phi[1] * u;
    for (Int k = 2; k <= degree; k++) *turn += line->phi[k] * (p[k] - p[k - 2]) / sqrt((double)(4 * k - 2));
    return upto;
}

static Line *own_line(const Side *s, Int row) { return s->of->lines + (Int)s->elements[2 * (s->first + row)]; }
static Line *partner_line(const Side *s, Int row) { return s->of->lines + (Int)s->elements[2 * (s->first_partner + row)]; }

/* Vector from the nearest place of a line to a place, near a fraction; return the step from that to the nearest one. */
static double approach(const Side *s, Line *line, double u, const double *place, double *away, double *tangent) {
    double p[MAX_POINTS + 1], primitive[MAX_POINTS], bend[2] = {0.0, 0.0}, last = 0.0, slope = 0.0;
    polynomials(s->of, line, u, p, primitive);
    for (int i = 0; i < 2; i++) {
        away[i] = place[i] - line->start[i];
        tangent[i] = 0.0;
    }
    for (Int k = 0; k < s->of->m->points; k++) {
        for (int i = 0; i < 2; i++) {
            away[i] -= primitive[k] * line->series[i][k];
            tangent[i] += p[k] * line->series[i][k];
            bend[i] += 2.0 * slope * line->series[i][k];
        }
        const double next = last + (double)(2 * k + 1) * p[k]; /* slopes of the polynomials */
        last = slope;
        slope = next;
    }
    const double square = tangent[0] * tangent[0] + tangent[1] * tangent[1];
    const double curved = square - (away[0] * bend[0] + away[1] * bend[1]);
    return (away[0] * tangent[0] + away[1] * tangent[1]) / (curved > LEAST_FOOT_SLOPE * square ? curved : square);
}

/* Vector from the nearest place of the other beam; return by how much nearer it may be: not at all where that is near. */
static double from_partner(const Side *s, const double *place, double *away) {
    const GapTables *t = &s->of->tables;
    double least = HUGE_VAL, tangent[2], longest = 0.0;
    Int row = 0, nearest = 0;
    for (Int r = 0; r < s->partners; r++) {
        const Line *line = partner_line(s, r);
        longest = fmax(longest, line->fastest);
        for (Int k = 0; k < t->along; k++) {
            const double dx = place[0] - line->place[0][k], dy = place[1] - line->place[1][k], square = dx * dx + dy * dy;
            if (square < least) { least = square; row = r; nearest = k; away[0] = dx; away[1] = dy; }
        }
    }
    if (!(least < NEAR_DISTANCE * NEAR_DISTANCE)) return 0.5 * WIDEST * longest;
    double u = t->fractions[nearest];
    for (int round = 0; round < N_FOOT_STEPS; round++) {
        const double step = approach(s, partner_line(s, row), u, place, away, tangent), to = u + step;
        if (to < 0.0 && row > 0) { row--; u = 1.0; continue; }
        if (to > 1.0 && row < s->partners - 1) { row++; u = 0.0; continue; }
        const double way = fmin(fmax(to, 0.0), 1.0) - u;
        u += way;
        if (fabs(way) > FOOT_STEP) continue;
        for (int i = 0; i < 2; i++) away[i] -= way * tangent[i];
        return 0.0;
    }
    approach(s, partner_line(s, row), u, place, away, tangent);
    return 0.0;
}

/* Gap and slope at a place of a beam. */
static Beside beside(const Side *s, const double *place, double angle) {
    double normal[2] = {place[0] - s->centre[0], place[1] - s->centre[1]}, value, coarse = 0.0;
    if (s->pad < 0 && !s->partners) {
        const Distance d = outline_distance(&s->outline, place[0] * s->unit, place[1] * s->unit);
        value = d.value / s->unit;
        memcpy(normal, d.normal, sizeof normal);
    } else {
        if (s->partners) coarse = from_partner(s, place, normal);
        const double reach = sqrt(normal[0] * normal[0] + normal[1] * normal[1]);
        value = reach - s->radius;
        normal[0] /= reach;
        normal[1] /= reach;
    }
    const double gap = value - s->half;
    const Beside b = {gap, normal[0] * cos(angle) + normal[1] * sin(angle), gap - coarse};
    return b;
}

/* Where the slope vanishes between two places (Illinois). */
static Beside refine(const Side *s, Line *line, double a, double b, double low, double high, double *place) {
    Beside here = {HUGE_VAL, 0.0, 0.0};
    for (int round = 0; round < N_ROUNDS; round++) {
        double at[2], turn, angle;
        *place = b - high * (b - a) / (high - low);
        locate(s->of, line, *place, at, &turn, &angle);
        here = beside(s, at, angle + turn);
        if (fabs(here.slope) < SLOPE_LEVEL) break;
        if (here.slope < 0.0) { a = *place; low = here.slope; high *= 0.5; }
        else { b = *place; high = here.slope; low *= 0.5; }
    }
    return here;
}

/* Look for lower gaps between places of an element where the slope changes its sign. */
static void search_dips(const Side *s, Line *line, double limit, double slack, Int row, double *found) {
    const GapTables *t = &s->of->tables;
    for (Int k = 0; k < t->along - 1; k++) {
        const Beside *a = line->seen + k, *b = a + 1;
        double step = 0.0, place;
        if (!(a->slope < 0.0 && b->slope > 0.0)) continue;
        for (Int j = 0; j < s->of->m->points; j++)
            step += line->speed[j] * (t->integrals[j * t->along + k + 1] - t->integrals[j * t->along + k]);
        const double low = a->slope * step, high = b->slope * step;
        const double bound = a->gap + (b->gap - high - a->gap) / (low - high) * low; /* where both tangents meet */
        if (!(bound + slack < limit)) continue;
        const Beside lower = refine(s, line, t->fractions[k], t->fractions[k + 1], a->slope, b->slope, &place);
        if (lower.gap + slack > found[0]) continue;
        found[0] = lower.gap + slack;
        found[1] = lower.gap;
        found[2] = (double)row;
        found[3] = place;
    }
}

/* The next place at which the gap may be below a level: along a beam it changes by no more than the way. */
static Int next_place(const GapTables *t, const Line *line, Int place, double gap, double level) {
    const double reach = (gap - level) / line->fastest;
    Int next = place + 1;
    while (next < t->along - 1 && t->fractions[next + 1] - t->fractions[place] <= reach) next++;
    return next;
}

/* One state: least gap with its slack, the gap itself, the row of its element, the place on it, range of gaps seen. */
static void search(const Side *s, double *found) {
    const GapTables *t = &s->of->tables;
    double lowest = HUGE_VAL, highest = -HUGE_VAL;
    found[0] = HUGE_VAL;
    for (Int row = 0; row < s->count; row++) { /* the least of all places first: only lower dips are looked at */
        const double slack = s->elements[2 * (s->first + row) + 1];
        Line *line = own_line(s, row);
        if (!line->has_places) find_places(t, s->of->m, line);
        Int next = 0;
        for (Int k = 0; k < t->along; k++) {
            line->seen[k] = (Beside){HUGE_VAL, 0.0, 0.0};
            if (k < next) continue;
            const double place[2] = {line->place[0][k], line->place[1][k]};
            const Beside here = line->seen[k] = beside(s, place, line->angle_at[k]);
            if (s->watches) next = next_place(t, line, k, here.floor, fmax(NEAR_GAP, LOWEST_SHARE * found[0]) - slack);
            lowest = fmin(lowest, here.gap);
            highest = fmax(highest, here.gap);
            if (here.gap + slack >= found[0]) continue;
            found[0] = here.gap + slack;
            found[1] = here.gap;
            found[2] = (double)row;
            found[3] = t->fractions[k];
        }
    }
    found[4] = highest - lowest;
    if (s->watches && found[0] < -NEAR_GAP) return;
    const double limit = fmin(found[0], NEAR_GAP) - GAP_RESOLUTION;
    for (Int row = 0; row < s->count; row++) search_dips(s, own_line(s, row), limit, s->elements[2 * (s->first + row) + 1], row, found);
    if (s->watches && found[0] > NEAR_GAP) found[0] = fmax(NEAR_GAP, LOWEST_SHARE * found[0]);
}

/* What may have moved of a side and of what it may touch since the state before; a pad is put at its place. */
static double follow_edge(Side *s, const double *z) {
    double own = 0.0, other = 0.0;
    for (Int r = 0; r < s->count; r++) own = fmax(own, own_line(s, r)->moved);
    for (Int r = 0; r < s->partners; r++) other = fmax(other, partner_line(s, r)->moved);
    if (s->pad >= 0) {
        const Pose p = pose(s->of->m, z, s->pad);
        other = hypot(p.place[0] - s->centre[0], p.place[1] - s->centre[1]);
        memcpy(s->centre, p.place, sizeof s->centre);
    }
    return own + other;
}

/* Least gaps in states (n, size) at stages (n, 2), drive and share, of sides (count, 12): row of the first of its elements,
 * how many, half the thickness, unit of length, first part of its outline, segments, arcs, whether that is closed, pad or
 * -1, radius, row of the first element of the other beam, how many; elements (rows, 2): number, slack; to found (n, count,
 * 5). Return 0 if an element vanishes. */
int side_gaps(const Model *m, const double *z, const double *stages, Int n, const double *elements, Int rows,
              const double *numbers, Int count, const double *edge, const double *packed, Int along, int watches,
              double *found) {
    Lines lines = {m, make_tables(m, packed, along), calloc((size_t)m->elements, sizeof(Line))};
    Side *sides = calloc((size_t)count + 1, sizeof(Side));
    int good = lines.lines && sides && along <= MAX_ALONG;
    for (Int r = 0; good && r < rows; r++) lines.lines[(Int)elements[2 * r]].used = 1;
    for (Int k = 0; good && k < count; k++) {
        const double *of = numbers + 12 * k;
        const Outline outline = {edge + 6 * (Int)of[4], (Int)of[5], (Int)of[6], (Int)of[7]};
        sides[k] = (Side){&lines, outline, (Int)of[0], (Int)of[1], (Int)of[8], (Int)of[10], (Int)of[11], elements, of[2], of[3],
                          of[9], {0.0, 0.0}, -HUGE_VAL, watches};
    }
    for (Int k = 0; good && k < n; k++, z += m->size) {
        const Stage at = {stages[2 * k], stages[2 * k + 1], 0.0, 0.0};
        good = !m->sides || sides_move(m, z);
        for (Int e = 0; good && e < m->elements; e++) if (lines.lines[e].used) trace_line(&lines, e, z, at);
        for (Side *s = sides; good && s < sides + count; s++, found += 5) {
            s->margin -= follow_edge(s, z);
            found[0] = s->margin;
            if (watches && s->margin > NEAR_GAP) continue;
            for (Int r = 0; r < s->partners; r++)
                if (!partner_line(s, r)->has_places) find_places(&lines.tables, m, partner_line(s, r));
            search(s, found);
            s->margin = found[0];
        }
    }
    free(lines.lines);
    free(sides);
    return good;
}

/* States of a network at places (n, count, 2), elements and fractions of them: place, rotation from rest and arc length
 * to the end of the element, found (n, count, 4). Return 0 if an element vanishes. */
int side_places(const Model *m, const double *z, const double *stages, Int n, const double *places, Int count,
                const double *packed, Int along, double *found) {
    const Lines lines = {m, make_tables(m, packed, along), calloc((size_t)m->elements, sizeof(Line))};
    double angle;
    int good = lines.lines != NULL;
    for (Int k = 0; good && k < n; k++, z += m->size) {
        const Stage at = {stages[2 * k], stages[2 * k + 1], 0.0, 0.0};
        Int here = -1;
        good = !m->sides || sides_move(m, z);
        for (Int j = 0; good && j < count; j++, places += 2, found += 4) {
            if ((Int)places[0] != here) trace_line(&lines, here = (Int)places[0], z, at);
            found[3] = m->length[here] - locate(&lines, lines.lines + here, places[1], found, found + 2, &angle);
        }
    }
    free(lines.lines);
    return good;
}
