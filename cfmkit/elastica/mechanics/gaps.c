/* Least gaps of the side of a beam of one thickness to an obstacle, a pad or another such beam, in many states.
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
#define WIDEST 0.1              /* share of an element between two places, and some more */
#define NEAR_DISTANCE 0.1       /* within which the nearest place of another beam is found exactly */
#define N_FOOT_STEPS 10
#define FOOT_RESOLUTION 1e-12   /* of an element */

/* Places along an element, and matrices from an element's unknowns and values at its Gauss points to these places. */
typedef struct {
    Int along;
    const double *fractions, *weights, *values, *integrals, *interpolation; /* (along), (q), (along, shapes), (along, q) twice */
    const double *series; /* (q, q): from values at Gauss points to Legendre coefficients */
} GapTables;

/* A line of an element in one state: start, slopes at Gauss points and their series, angle at rest, rotation. */
typedef struct {
    double start[2], x[MAX_POINTS], y[MAX_POINTS], angle[MAX_POINTS], phi[MAX_SHAPES], speed[MAX_POINTS];
    double series[4][MAX_POINTS];
    double fastest; /* way by the parameter of the element */
    int has_series;
} Line;

typedef struct {
    const Model *m;
    const GapTables *tables;
    Outline outline;
    double half, unit; /* half the thickness; unit of length [m] */
    int watches;       /* far gaps may be lower bounds, of most places then none is measured */
    Int pad;           /* attachment that is touched instead of an outline, -1 if none; then its radius and where it is */
    double radius, centre[2];
    Int partners;      /* elements of another beam of that radius that is touched; each with its line and places on it */
    const double *partner;
    Line *lines;
    double (*places)[MAX_ALONG][2], coarse; /* and by how much nearer it may be than these */
} Search;

typedef struct { double gap, slope, floor; } Beside; /* floor: below the gap, wherever it is not exact */

static void trace_line(const Search *s, Int e, const double *z, Stage at, Line *line) {
    const Model *m = s->m;
    const Int shapes = m->degree + 1, count = m->degree + 9, *own = m->unknowns + e * count;
    const double *load = m->line + 4 * e, qx = at.share * load[0] + at.drive * load[2];
    const double qy = at.share * load[1] + at.drive * load[3];
    const Pose start = pose(m, z, m->ends[2 * e]);
    memcpy(line->start, start.place, sizeof start.place);
    line->fastest = 0.0;
    for (Int k = 0; k < shapes; k++) line->phi[k] = z[own[local_shape(k)]];
    for (Int q = 0, o = e * m->points; q < m->points; q++, o++) {
        double turn = line->angle[q] = m->angle[o];
        for (Int k = 0; k < shapes; k++) turn += line->phi[k] * m->values[q * shapes + k];
        const double c = cos(turn), n = sin(turn);
        const double nx = z[own[count - 2]] + qx * m->ahead[o], ny = z[own[count - 1]] + qy * m->ahead[o];
        const double stretch = 1.0 + m->axial[o] * (nx * c + ny * n), slip = m->shear[o] * (ny * c - nx * n);
        line->speed[q] = m->weight[o] / s->tables->weights[q];
        line->x[q] = (stretch * c - slip * n) * line->speed[q];
        line->y[q] = (stretch * n + slip * c) * line->speed[q];
        line->fastest = fmax(line->fastest, FASTER * line->speed[q] * (fabs(stretch) + fabs(slip)));
    }
    line->has_series = 0;
}

/* Place at one of the table's places. */
static void table_place(const Search *s, const Line *line, Int place, double *at) {
    const double *upto = s->tables->integrals + place * s->m->points;
    at[0] = line->start[0];
    at[1] = line->start[1];
    for (Int k = 0; k < s->m->points; k++) {
        at[0] += upto[k] * line->x[k];
        at[1] += upto[k] * line->y[k];
    }
}

static void find_series(const Search *s, Line *line) {
    const Int q = s->m->points;
    const double *given[4] = {line->x, line->y, line->angle, line->speed};
    for (int i = 0; i < 4; i++)
        for (Int k = 0; k < q; k++) {
            line->series[i][k] = 0.0;
            for (Int j = 0; j < q; j++) line->series[i][k] += s->tables->series[k * q + j] * given[i][j];
        }
    line->has_series = 1;
}

/* Legendre polynomials p (points + 1) and their primitives (points) at any place of an element. */
static void polynomials(const Search *s, Line *line, double u, double *p, double *primitive) {
    const Int q = s->m->points;
    const double v = 2.0 * u - 1.0;
    if (!line->has_series) find_series(s, line);
    p[0] = 1.0;
    p[1] = v;
    for (Int k = 2; k <= q; k++) p[k] = (p[k - 1] * v * (double)(2 * k - 1) - p[k - 2] * (double)(k - 1)) / (double)k;
    for (Int k = 0; k < q; k++) primitive[k] = 0.5 * (k ? (p[k + 1] - p[k - 1]) / (double)(2 * k + 1) : v + 1.0);
}

/* Place, rotation from rest and angle at rest at any place; return the arc length up to it. */
static double locate(const Search *s, Line *line, double u, double *place, double *turn, double *angle) {
    const Int q = s->m->points, degree = s->m->degree;
    double p[MAX_POINTS + 1], primitive[MAX_POINTS], upto = 0.0;
    polynomials(s, line, u, p, primitive);
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

/* Vector from the nearest place of the other beam; return by how much nearer it may be: not at all where that is near. */
static double from_partner(const Search *s, double x, double y, double *away) {
    const double *fractions = s->tables->fractions;
    const Int along = s->tables->along, last = s->partners - 1;
    double least = HUGE_VAL, p[MAX_POINTS + 1], primitive[MAX_POINTS];
    Int row = 0, nearest = 0;
    for (Int r = 0; r < s->partners; r++)
        for (Int k = 0; k < along; k++) {
            const double dx = x - s->places[r][k][0], dy = y - s->places[r][k][1], square = dx * dx + dy * dy;
            if (square < least) { least = square; row = r; nearest = k; away[0] = dx; away[1] = dy; }
        }
    if (!(least < NEAR_DISTANCE * NEAR_DISTANCE)) return s->coarse;
    double u = fractions[nearest];
    for (int round = 0, stands = 0; round <= N_FOOT_STEPS; round++) {
        Line *line = s->lines + row;
        double tangent[2] = {0.0, 0.0};
        polynomials(s, line, u, p, primitive);
        away[0] = x - line->start[0];
        away[1] = y - line->start[1];
        for (Int k = 0; k < s->m->points; k++)
            for (int i = 0; i < 2; i++) {
                away[i] -= primitive[k] * line->series[i][k];
                tangent[i] += p[k] * line->series[i][k];
            }
        if (stands || round == N_FOOT_STEPS) break;
        const double along_it = away[0] * tangent[0] + away[1] * tangent[1];
        const double to = u + along_it / (tangent[0] * tangent[0] + tangent[1] * tangent[1]), before = u;
        if (to < 0.0 && row > 0) { row--; u = 1.0; }
        else if (to > 1.0 && row < last) { row++; u = 0.0; }
        else u = fmin(fmax(to, 0.0), 1.0);
        stands = fabs(u - before) < FOOT_RESOLUTION;
    }
    return 0.0;
}

/* Gap and slope at a place of a beam. */
static Beside beside(const Search *s, const double *place, double angle) {
    double normal[2] = {place[0] - s->centre[0], place[1] - s->centre[1]}, value, coarse = 0.0;
    if (s->pad < 0 && !s->partners) {
        const Distance d = outline_distance(&s->outline, place[0] * s->unit, place[1] * s->unit);
        value = d.value / s->unit;
        memcpy(normal, d.normal, sizeof normal);
    } else {
        if (s->partners) coarse = from_partner(s, place[0], place[1], normal);
        const double reach = sqrt(normal[0] * normal[0] + normal[1] * normal[1]);
        value = reach - s->radius;
        normal[0] /= reach;
        normal[1] /= reach;
    }
    const double gap = value - s->half;
    const Beside b = {gap, normal[0] * cos(angle) + normal[1] * sin(angle), gap - coarse};
    return b;
}

static Beside at_table_place(const Search *s, const Line *line, Int place) {
    const Int q = s->m->points, shapes = s->m->degree + 1;
    const double *through = s->tables->interpolation + place * q, *values = s->tables->values + place * shapes;
    double at[2], angle = 0.0, turn = 0.0;
    table_place(s, line, place, at);
    for (Int k = 0; k < q; k++) angle += through[k] * line->angle[k];
    for (Int k = 0; k < shapes; k++) turn += values[k] * line->phi[k];
    return beside(s, at, angle + turn);
}

static Beside at_fraction(const Search *s, Line *line, double u) {
    double place[2], turn, angle;
    locate(s, line, u, place, &turn, &angle);
    return beside(s, place, angle + turn);
}

/* Where the slope vanishes between two places (Illinois). */
static Beside refine(const Search *s, Line *line, double a, double b, double low, double high, double *place) {
    Beside here = {HUGE_VAL, 0.0, 0.0};
    for (int round = 0; round < N_ROUNDS; round++) {
        *place = b - high * (b - a) / (high - low);
        here = at_fraction(s, line, *place);
        if (fabs(here.slope) < SLOPE_LEVEL) break;
        if (here.slope < 0.0) { a = *place; low = here.slope; high *= 0.5; }
        else { b = *place; high = here.slope; low *= 0.5; }
    }
    return here;
}

/* Look for lower gaps between places of an element where the slope changes its sign. */
static void search_dips(const Search *s, Line *line, const Beside *seen, double limit, double slack, Int row, double *found) {
    const GapTables *t = s->tables;
    const Int q = s->m->points;
    for (Int k = 0; k < t->along - 1; k++) {
        const Beside *a = seen + k, *b = seen + k + 1;
        double step = 0.0, place;
        if (!(a->slope < 0.0 && b->slope > 0.0)) continue;
        for (Int j = 0; j < q; j++) step += line->speed[j] * (t->integrals[(k + 1) * q + j] - t->integrals[k * q + j]);
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
static Int next_place(const Search *s, const Line *line, Int place, double gap, double level) {
    const double *fractions = s->tables->fractions, reach = (gap - level) / line->fastest;
    Int next = place + 1;
    while (next < s->tables->along - 1 && fractions[next + 1] - fractions[place] <= reach) next++;
    return next;
}

static const Beside PASSED = {HUGE_VAL, 0.0, 0.0};

/* One state: least gap with its slack, the gap itself, the row of its element, the place on it, range of gaps seen. */
static void search(const Search *s, double *elements, Int count, const double *z, Stage at, double *found) {
    const GapTables *t = s->tables;
    Beside seen[MAX_ALONG];
    Line line;
    double lowest = HUGE_VAL, highest = -HUGE_VAL;
    found[0] = HUGE_VAL;
    for (int pass = 0; pass < 2; pass++) { /* the least of all places first: only lower dips are looked at */
        const double limit = fmin(found[0], NEAR_GAP) - GAP_RESOLUTION;
        for (Int row = 0; row < count; row++) {
            const Int e = (Int)elements[3 * row];
            const double slack = elements[3 * row + 1];
            double *nearest = elements + 3 * row + 2;
            if (pass && *nearest + slack - WIDEST * s->m->length[e] > limit) continue;
            trace_line(s, e, z, at, &line);
            Int next = 0;
            if (!pass) *nearest = HUGE_VAL;
            for (Int k = 0; k < t->along; k++) {
                if (k < next) { seen[k] = PASSED; continue; }
                seen[k] = at_table_place(s, &line, k);
                if (s->watches) next = next_place(s, &line, k, seen[k].floor, fmax(NEAR_GAP, LOWEST_SHARE * found[0]) - slack);
                if (pass) continue;
                *nearest = fmin(*nearest, seen[k].gap);
                highest = fmax(highest, seen[k].gap);
                if (seen[k].gap + slack >= found[0]) continue;
                found[0] = seen[k].gap + slack;
                found[1] = seen[k].gap;
                found[2] = (double)row;
                found[3] = t->fractions[k];
            }
            if (pass) search_dips(s, &line, seen, limit, slack, row, found);
            lowest = fmin(lowest, *nearest);
        }
    }
    if (s->watches && found[0] > NEAR_GAP) found[0] = fmax(NEAR_GAP, LOWEST_SHARE * found[0]);
    found[4] = highest - lowest;
}

/* Put what moves with the state at its place: the pad, or lines of the other beam. */
static void place_edge(Search *s, const double *z, Stage at) {
    if (s->pad >= 0) memcpy(s->centre, pose(s->m, z, s->pad).place, sizeof s->centre);
    s->coarse = 0.0;
    for (Int r = 0; r < s->partners; r++) {
        trace_line(s, (Int)s->partner[r], z, at, s->lines + r);
        for (Int k = 0; k < s->tables->along; k++) table_place(s, s->lines + r, k, s->places[r][k]);
        s->coarse = fmax(s->coarse, 0.5 * WIDEST * s->lines[r].fastest);
    }
}

/* Least gaps in states (n, size) at stages (n, 2), drive and share, of elements (count, 3): number, slack, and memory;
 * of a beam to others (partners) or to what numbers and edge say; found (n, 5). Return 0 if an element vanishes. */
int side_gaps(const Model *m, const double *z, const double *stages, Int n, double *elements, Int count, const double *edge,
              const double *numbers, const double *packed, const double *partner, Int partners, int watches, double *found) {
    const Int along = (Int)numbers[5], shapes = m->degree + 1, q = m->points;
    const double *values = packed + along + q, *integrals = values + along * shapes;
    const double *interpolation = integrals + along * q, *series = interpolation + along * q;
    const GapTables t = {along, packed, packed + along, values, integrals, interpolation, series};
    const Outline outline = {edge, (Int)numbers[2], (Int)numbers[3], (Int)numbers[4]};
    Search s = {m, &t, outline, numbers[0], numbers[1], watches, (Int)numbers[6], numbers[7], {0.0, 0.0}, partners, partner,
                NULL, NULL, 0.0};
    if (along > MAX_ALONG) return 0;
    if (partners) {
        s.lines = malloc((size_t)partners * sizeof *s.lines);
        s.places = malloc((size_t)partners * sizeof *s.places);
    }
    int good = !partners || (s.lines && s.places);
    for (Int k = 0; good && k < n; k++, z += m->size, found += 5) {
        const Stage at = {stages[2 * k], stages[2 * k + 1], 0.0, 0.0};
        good = !m->sides || sides_move(m, z);
        if (!good) break;
        place_edge(&s, z, at);
        search(&s, elements, count, z, at, found);
    }
    free(s.lines);
    free(s.places);
    return good;
}

/* States of a network at places (n, count, 2), elements and fractions of them: place, rotation from rest and arc length
 * to the end of the element, found (n, count, 4). Return 0 if an element vanishes. */
int side_places(const Model *m, const double *z, const double *stages, Int n, const double *places, Int count,
                const double *weights, const double *series, double *found) {
    const GapTables t = {0, NULL, weights, NULL, NULL, NULL, series};
    const Search s = {.m = m, .tables = &t, .pad = -1};
    Line line;
    double angle;
    for (Int k = 0; k < n; k++, z += m->size) {
        const Stage at = {stages[2 * k], stages[2 * k + 1], 0.0, 0.0};
        Int here = -1;
        if (m->sides && !sides_move(m, z)) return 0;
        for (Int j = 0; j < count; j++, places += 2, found += 4) {
            if ((Int)places[0] != here) trace_line(&s, here = (Int)places[0], z, at, &line);
            found[3] = m->length[here] - locate(&s, &line, places[1], found, found + 2, &angle);
        }
    }
    return 1;
}
