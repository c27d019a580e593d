/* Factors of the tangent, with its inertia.
 *
 * Symmetric: L D L^T by a front [DR]. Terms are added one by one; the front holds the unknowns that were met and are not
 * eliminated yet. After each element those that no later one holds are eliminated, one or two together, if the pivot is
 * large enough beside what it is coupled with; else they wait in the front. So an element that buckles between its ends
 * needs no rule, and a chain of elements costs in proportion to its length. Small networks are one front.
 * Unsymmetric (loads that follow): dense L U with row pivots.
 *
 * [DR] I. S. Duff, J. K. Reid, ACM Trans. Math. Softw. 9 (1983) 302: delayed pivots of order one and two; they have the
 * stability of J. R. Bunch, L. Kaufman, Math. Comp. 31 (1977) 163. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "march.h"

#define THRESHOLD 0.1 /* least pivot beside its column; up to 0.5 a full front always has one */

static size_t row_start(Int i) { return (size_t)(i * (i + 1) / 2); }

int factors_open(Factors *f, Int n, int unsymmetric) {
    const size_t count = (size_t)(n + 1);
    memset(f, 0, sizeof *f);
    f->n = n;
    f->first = malloc(count * sizeof(Int));
    f->unknown = malloc(count * sizeof(Int));
    f->index = malloc(count * sizeof(Int));
    f->position = malloc(count * sizeof(Int));
    f->pair = malloc(count);
    f->inverse = malloc(2 * count * sizeof(double));
    if (unsymmetric) f->dense = malloc(count * count * sizeof(double));
    return f->first && f->unknown && f->index && f->position && f->pair && f->inverse && (f->dense || !unsymmetric);
}

void factors_close(Factors *f) {
    free(f->first); free(f->unknown); free(f->index); free(f->position); free(f->pair);
    free(f->inverse); free(f->row); free(f->factor); free(f->front); free(f->dense);
}

void factors_begin(Factors *f) {
    f->pivots = f->used = f->fronts = f->negative = 0;
    for (Int i = 0; i < f->n; i++) f->position[i] = -1;
    if (f->dense) memset(f->dense, 0, (size_t)(f->n * f->n) * sizeof(double));
}

static int enter(Factors *f, Int unknown) {
    const Int last = f->fronts;
    const size_t need = row_start(last + 1);
    if ((Int)need > f->front_room) {
        double *larger = realloc(f->front, 2 * need * sizeof(double));
        if (!larger) return 0;
        f->front = larger;
        f->front_room = (Int)(2 * need);
    }
    memset(f->front + row_start(last), 0, (size_t)(last + 1) * sizeof(double));
    f->index[last] = unknown;
    f->position[unknown] = last;
    f->fronts++;
    return 1;
}

/* Add a full matrix of a term by free unknowns, -1 for held ones; return 0 if there is no memory. */
int factors_add(Factors *f, const Int *at, Int count, const double *matrix) {
    Int where[MAX_LOCAL];
    if (f->dense) {
        for (Int i = 0; i < count; i++)
            for (Int j = 0; j < count; j++)
                if (at[i] >= 0 && at[j] >= 0) f->dense[at[i] * f->n + at[j]] += matrix[i * count + j];
        return 1;
    }
    Int met = 0, from[MAX_LOCAL];
    for (Int i = 0; i < count; i++) {
        if (at[i] < 0) continue;
        if (f->position[at[i]] < 0 && !enter(f, at[i])) return 0;
        where[met] = f->position[at[i]];
        from[met++] = i;
    }
    for (Int i = 0; i < met; i++) {
        const double *own = matrix + from[i] * count;
        const Int a = where[i];
        double *row = f->front + row_start(a);
        for (Int j = 0; j < i; j++) {
            const Int b = where[j];
            if (b < a) row[b] += own[from[j]];
            else if (b > a) f->front[row_start(b) + (size_t)a] += own[from[j]];
            else row[a] += 2.0 * own[from[j]]; /* an unknown may stand twice */
        }
        row[a] += own[from[i]];
    }
    return 1;
}

static void exchange(Factors *f, Int a, Int b) { /* two rows and columns of the front */
    if (a == b) return;
    if (a > b) { const Int c = a; a = b; b = c; }
    double *front = f->front, *one = front + row_start(a), *other = front + row_start(b), t;
    for (Int k = 0; k < a; k++) { t = one[k]; one[k] = other[k]; other[k] = t; }
    for (Int k = a + 1; k < b; k++) {
        double *cell = front + row_start(k) + a;
        t = *cell; *cell = other[k]; other[k] = t;
    }
    for (Int k = b + 1; k < f->fronts; k++) {
        double *row = front + row_start(k);
        t = row[a]; row[a] = row[b]; row[b] = t;
    }
    t = one[a]; one[a] = other[b]; other[b] = t;
    const Int unknown = f->index[a];
    f->index[a] = f->index[b]; f->index[b] = unknown;
    f->position[f->index[a]] = a; f->position[f->index[b]] = b;
}

/* Take a share of a pivot's row from each row of the front before it; of two pivots both shares at once. */
FAST static void take_one(Int rows, double *restrict front, const double *restrict pivot, const double *restrict factor) {
    for (Int i = 0; i < rows; front += ++i) {
        const double share = factor[i];
        if (share == 0.0) continue;
        for (Int j = 0; j <= i; j++) front[j] -= share * pivot[j];
    }
}

FAST static void take_two(Int rows, double *restrict front, const double *restrict p, const double *restrict q,
                          const double *restrict first, const double *restrict second) {
    for (Int i = 0; i < rows; front += ++i) {
        const double x = first[i], y = second[i];
        if (x == 0.0 && y == 0.0) continue;
        for (Int j = 0; j <= i; j++) front[j] -= x * p[j] + y * q[j];
    }
}

/* Return the largest number beside the diagonal of a column, one row left out. */
static double largest_beside(const Factors *f, Int column, Int skip) {
    double largest = 0.0;
    const double *row = f->front + row_start(column), *cell = row + 2 * column + 1; /* below the diagonal */
    for (Int k = 0; k < column; k++) {
        const double size = k == skip ? 0.0 : fabs(row[k]);
        largest = size > largest ? size : largest;
    }
    for (Int k = column + 1; k < f->fronts; cell += ++k) {
        const double size = k == skip ? 0.0 : fabs(*cell);
        largest = size > largest ? size : largest;
    }
    return largest;
}

static double entry(const Factors *f, Int i, Int j) {
    return i > j ? f->front[row_start(i) + (size_t)j] : f->front[row_start(j) + (size_t)i];
}

/* Return the row that a column is coupled with most of those that may be eliminated, -1 if with none. */
static Int find_partner(const Factors *f, const Int *leaves, Int element, Int column) {
    double largest = 0.0;
    Int partner = -1;
    for (Int k = 0; k < f->fronts; k++)
        if (k != column && leaves[f->index[k]] <= element && fabs(entry(f, column, k)) > largest) {
            largest = fabs(entry(f, column, k));
            partner = k;
        }
    return partner;
}

static int reserve(Factors *f, Int more) {
    if (f->used + more <= f->room) return 1;
    const size_t room = (size_t)(2 * f->room + more + 64 * f->n);
    double *factor = realloc(f->factor, room * sizeof(double));
    if (factor) f->factor = factor;
    Int *row = realloc(f->row, room * sizeof(Int));
    if (row) f->row = row;
    if (!factor || !row) return 0;
    f->room = (Int)room;
    return 1;
}

/* Begin the rows of the last unknown of the front as a pivot; they are those before `rows`. */
static double *begin_pivot(Factors *f, Int unknown, Int rows, int pair, double inverse, double beside) {
    const Int p = f->pivots++;
    f->first[p] = f->used;
    f->unknown[p] = unknown;
    f->pair[p] = (char)pair;
    f->inverse[2 * p] = inverse;
    f->inverse[2 * p + 1] = beside;
    memcpy(f->row + f->used, f->index, (size_t)rows * sizeof(Int));
    f->used += rows;
    f->first[p + 1] = f->used;
    f->position[unknown] = -1;
    return f->factor + f->first[p];
}

static int eliminate_one(Factors *f, Int at) {
    exchange(f, at, f->fronts - 1);
    const Int rows = --f->fronts;
    const double *pivot = f->front + row_start(rows), d = pivot[rows];
    if (!reserve(f, rows)) return 0;
    double *factor = begin_pivot(f, f->index[rows], rows, 0, 1.0 / d, 0.0);
    f->negative += d < 0.0;
    for (Int i = 0; i < rows; i++) factor[i] = pivot[i] / d;
    take_one(rows, f->front, pivot, factor);
    return 1;
}

static int eliminate_two(Factors *f, Int one, Int other) {
    exchange(f, one > other ? one : other, f->fronts - 1);
    exchange(f, one > other ? other : one, f->fronts - 2);
    f->fronts -= 2;
    const Int rows = f->fronts;
    const double *p = f->front + row_start(rows), *q = f->front + row_start(rows + 1);
    const double a = p[rows], b = q[rows], c = q[rows + 1], det = a * c - b * b;
    if (!reserve(f, 2 * rows)) return 0;
    const Int last = f->index[rows + 1];
    double *first = begin_pivot(f, f->index[rows], rows, 1, c / det, -b / det);
    double *second = begin_pivot(f, last, rows, 0, a / det, -b / det);
    first = f->factor + f->first[f->pivots - 2];
    f->negative += det < 0.0 ? 1 : a < 0.0 ? 2 : 0;
    for (Int i = 0; i < rows; i++) {
        first[i] = (c * p[i] - b * q[i]) / det;
        second[i] = (a * q[i] - b * p[i]) / det;
    }
    take_two(rows, f->front, p, q, first, second);
    return 1;
}

/* Eliminate what no later element holds; return 0 if there is no memory, or at the end if the matrix is singular. */
int factors_eliminate(Factors *f, const Int *leaves, Int element) {
    int progress = 1;
    while (progress) { /* what had no pivot may have one after the others */
        progress = 0;
        for (Int at = f->fronts - 1; at >= 0; at--) {
            if (at >= f->fronts || leaves[f->index[at]] > element) continue;
            const double d = entry(f, at, at);
            if (d != 0.0 && fabs(d) >= THRESHOLD * largest_beside(f, at, -1)) {
                if (!eliminate_one(f, at)) return 0;
                progress = 1;
                continue;
            }
            const Int partner = find_partner(f, leaves, element, at);
            if (partner < 0) continue;
            const double c = entry(f, partner, partner), b = entry(f, at, partner), det = d * c - b * b;
            const double most = fabs(det) / THRESHOLD;
            if (det == 0.0) continue;
            const double mine = largest_beside(f, at, partner), its = largest_beside(f, partner, at);
            if (fabs(c) * mine + fabs(b) * its <= most && fabs(b) * mine + fabs(d) * its <= most) {
                if (!eliminate_two(f, at, partner)) return 0;
                progress = 1;
            }
        }
    }
    return 1;
}

/* Take shares of a pivot's row from the next rows of n numbers, and put them in the pivot's column. */
FAST static void take_row(Int n, Int rows, const double *restrict pivot, double *restrict below) {
    for (Int i = 0; i < rows; i++, below += n) {
        const double share = below[0] /= pivot[0];
        if (share != 0.0) for (Int j = 1; j <= rows; j++) below[j] -= share * pivot[j];
    }
}

static int dense_factors(Factors *f) {
    const Int n = f->n;
    int odd = 0;
    for (Int k = 0; k < n; k++) {
        Int best = k;
        for (Int i = k + 1; i < n; i++) if (fabs(f->dense[i * n + k]) > fabs(f->dense[best * n + k])) best = i;
        double *row = f->dense + k * n;
        f->index[k] = best;
        if (best != k) {
            double *other = f->dense + best * n;
            for (Int j = 0; j < n; j++) { const double t = row[j]; row[j] = other[j]; other[j] = t; }
            odd = !odd;
        }
        if (row[k] == 0.0 || row[k] != row[k]) return 0;
        if (row[k] < 0.0) odd = !odd;
        take_row(n, n - k - 1, row + k, row + k + n);
    }
    f->negative = odd;
    return 1;
}

int factors_finish(Factors *f) { return f->dense ? dense_factors(f) : f->fronts == 0; }

static void dense_solve(const Factors *f, double *x) {
    const Int n = f->n;
    for (Int k = 0; k < n; k++) {
        const double t = x[f->index[k]];
        x[f->index[k]] = x[k];
        x[k] = t;
    }
    for (Int i = 1; i < n; i++) for (Int j = 0; j < i; j++) x[i] -= f->dense[i * n + j] * x[j];
    for (Int i = n - 1; i >= 0; i--) {
        for (Int j = i + 1; j < n; j++) x[i] -= f->dense[i * n + j] * x[j];
        x[i] /= f->dense[i * n + i];
    }
}

/* Put the solutions in the place of two right sides, (n) each: together they take little more time than one. */
void factors_solve(const Factors *f, double *restrict x, double *restrict y) {
    if (f->dense) { dense_solve(f, x); dense_solve(f, y); return; }
    for (Int p = 0; p < f->pivots; p++) {
        const double a = x[f->unknown[p]], b = y[f->unknown[p]];
        for (Int k = f->first[p]; k < f->first[p + 1]; k++) {
            x[f->row[k]] -= f->factor[k] * a;
            y[f->row[k]] -= f->factor[k] * b;
        }
    }
    for (Int p = 0; p < f->pivots; p++) {
        const Int own = f->unknown[p];
        const double *by = f->inverse + 2 * p;
        if (!f->pair[p]) { x[own] *= by[0]; y[own] *= by[0]; continue; }
        const Int other = f->unknown[++p];
        const double a = x[own], b = x[other], c = y[own], d = y[other];
        x[own] = by[0] * a + by[1] * b; x[other] = by[3] * a + by[2] * b;
        y[own] = by[0] * c + by[1] * d; y[other] = by[3] * c + by[2] * d;
    }
    for (Int p = f->pivots - 1; p >= 0; p--) {
        double a = x[f->unknown[p]], b = y[f->unknown[p]];
        for (Int k = f->first[p]; k < f->first[p + 1]; k++) {
            a -= f->factor[k] * x[f->row[k]];
            b -= f->factor[k] * y[f->row[k]];
        }
        x[f->unknown[p]] = a;
        y[f->unknown[p]] = b;
    }
}
