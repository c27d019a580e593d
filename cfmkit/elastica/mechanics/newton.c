/* Newton's method on the functional: its equations put together, and solved.
 *
 * numpy is the specification: energy.py and `NumpyEquations` of equations.py; of sides of beams sliding.py. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "march.h"

#define LARGEST_CORRECTION 50.0 /* of a motion: beyond that Newton's method has left the path */
#define STANDING 1e-9           /* motions that change by less stand: then forces may still change by 1e-3 */
#define MAX_ROUNDS 14

/* Memory; with a dense matrix to hold the tangent as it is, whether it is symmetric or not. */
Work *work_open(const Model *m, int dense) {
    Work *w = calloc(1, sizeof(Work));
    const size_t size = (size_t)m->size, n = (size_t)m->free;
    if (!w) return NULL;
    w->z = calloc(2 * size + 3 * n + 1, sizeof(double));
    int opened = w->z && factors_open(&w->factors, m->free, dense || is_dense(m));
    if (opened && is_dense(m)) opened = factors_open(&w->symmetric, m->free, 0);
    if (!opened) { work_close(w); return NULL; }
    w->gradient = w->z + size;
    w->step = w->gradient + size;
    w->slope = w->step + n;
    w->change = w->slope + n;
    return w;
}

void work_close(Work *w) {
    if (!w) return;
    factors_close(&w->factors);
    factors_close(&w->symmetric);
    free(w->z);
    free(w);
}

static void place(const Model *m, Work *w, const double *x, Stage at) {
    for (Int i = 0; i < m->size; i++)
        w->z[i] = m->slot[i] >= 0 ? x[m->slot[i]] : at.share * m->base[i] + at.drive * m->rate[i];
}

enum { GRADIENT, FACTORS, MATRIX }; /* what is assembled: MATRIX leaves a dense tangent as it is */

static void add_to_gradient(Work *w, const Term *t) {
    for (Int i = 0; i < t->count; i++) w->gradient[t->at[i]] += t->gradient[i];
}

/* Make the Hessian of a term symmetric. */
static void symmetrise(Term *t) {
    for (Int i = 0; i < t->count; i++)
        for (Int j = 0; j < i; j++) {
            double *one = t->hessian + i * t->count + j, *other = t->hessian + j * t->count + i;
            *one = *other = 0.5 * (*one + *other);
        }
}

/* Add the change of the residual on the way by the unknowns of a term that are held. */
static void add_to_change(const Model *m, Work *w, Stage at, const Term *t, const Int *slots) {
    for (Int j = 0; j < t->count; j++) {
        const double moves = at.by_share * m->base[t->at[j]] + at.by_drive * m->rate[t->at[j]];
        if (slots[j] >= 0 || moves == 0.0) continue;
        for (Int i = 0; i < t->count; i++)
            if (slots[i] >= 0) w->change[slots[i]] += t->hessian[i * t->count + j] * moves;
    }
}

/* Add what contacts of sides of beams give to the gradient, the tangent and the matrix with places held. */
static int assemble_sides(const Model *m, Work *w, Stage at, int with_factors) {
    Term *t = &w->term;
    Int slots[10];
    double frozen[64];
    for (Int k = 0; k < m->sides; k++) {
        const Int bodies = side_term(m, k, w->z, t, frozen);
        add_to_gradient(w, t);
        if (!with_factors) continue;
        for (Int i = 0; i < t->count; i++) slots[i] = m->slot[t->at[i]];
        add_to_change(m, w, at, t, slots);
        if (!factors_add(&w->factors, slots, t->count, t->hessian)) return 0;
        if (!bodies) continue;
        const int leads = t->count == bodies + 3; /* the second of two beams has no row for the gap */
        if (!leads) slots[bodies] = -1;
        if (!factors_add(&w->symmetric, slots, bodies + 2, frozen) || !sides_couple(m, k, w->z, &w->symmetric)) return 0;
        w->rows += 1 + leads;
    }
    if (with_factors) sides_columns(m, w->z, at, t, &w->factors);
    return 1;
}

/* Gradient of all unknowns at w->z; with factors also those of the tangent and the change of the residual on the way. */
static int assemble(const Model *m, Work *w, Stage at, int with_factors) {
    Term *t = &w->term;
    Int slots[MAX_LOCAL];
    memset(w->gradient, 0, (size_t)m->size * sizeof(double));
    if (with_factors) {
        memset(w->change, 0, (size_t)m->free * sizeof(double));
        factors_begin(&w->factors);
        if (is_dense(m)) factors_begin(&w->symmetric);
        w->definite = m->follows != 0;
        w->rows = m->presses;
    }
    if (m->sides && !(sides_move(m, w->z) && assemble_sides(m, w, at, with_factors))) return 0;
    for (Int k = 0; k < terms(m); k++) {
        term(m, k, w->z, at, with_factors, t);
        add_to_gradient(w, t);
        if (!with_factors) continue;
        for (Int i = 0; i < t->count; i++) {
            slots[i] = m->slot[t->at[i]];
            if (slots[i] >= 0) w->change[slots[i]] += t->change[i];
        }
        add_to_change(m, w, at, t, slots);
        if (!factors_add(&w->factors, slots, t->count, t->hessian)) return 0;
        const Int element = k + m->elements - terms(m);
        if (!w->factors.dense && element >= 0 && !factors_eliminate(&w->factors, m->leaves, element)) return 0;
        if (!is_dense(m)) continue;
        if (m->follows) symmetrise(t);
        if (!factors_add(&w->symmetric, slots, t->count, t->hessian)) return 0;
        if (m->sides && element >= 0 && !sides_stiffen(m, &w->symmetric, t, element)) return 0;
        if (element >= 0 && !factors_eliminate(&w->symmetric, m->leaves, element)) w->definite = 0;
    }
    if (with_factors && m->follows)
        w->definite = w->definite && factors_finish(&w->symmetric) && w->symmetric.negative == 2 * m->elements;
    return with_factors != FACTORS || factors_finish(&w->factors);
}

/* Unstable directions. Under loads that follow: their parity, all that a march compares. */
static Int unstable_of(const Model *m, const Work *w) {
    if (!m->follows) return (m->sides ? &w->symmetric : &w->factors)->negative - 2 * m->elements - w->rows;
    return w->definite ? 0 : w->factors.negative;
}

/* The same to hand out: negative, -1 or -2, where only the parity is known. */
static Int told_unstable(const Model *m, const Work *w) {
    return m->follows && !w->definite ? -1 - w->factors.negative : unstable_of(m, w);
}

/* Gradients (count, size) at states (count, size), with Hessians (count, size, size) unless that is NULL. */
int evaluate(const Model *m, const double *z, const double *drive, double share, Int count, double *gradient, double *hessian) {
    Term *t = malloc(sizeof(Term));
    if (!t) return DIVERGED;
    memset(gradient, 0, (size_t)(count * m->size) * sizeof(double));
    if (hessian) memset(hessian, 0, (size_t)(count * m->size * m->size) * sizeof(double));
    for (Int p = 0; p < count; p++, z += m->size, gradient += m->size) {
        const Stage at = {drive[p], share, 0.0, 0.0};
        if (m->sides && !sides_move(m, z)) { free(t); return DIVERGED; }
        for (Int k = 0; k < m->sides; k++) { /* by their places and flags nothing changes */
            double frozen[64];
            side_term(m, k, z, t, frozen);
            for (Int i = 0; t->at[i] != m->side_at[SIDE_WIDE * k + 3]; i++) gradient[t->at[i]] += t->gradient[i];
        }
        for (Int k = 0; k < terms(m); k++) {
            term(m, k, z, at, hessian != NULL, t);
            for (Int i = 0; i < t->count; i++) {
                gradient[t->at[i]] += t->gradient[i];
                if (!hessian) continue;
                double *row = hessian + (p * m->size + t->at[i]) * m->size;
                for (Int j = 0; j < t->count; j++) row[t->at[j]] += t->hessian[i * t->count + j];
            }
        }
    }
    free(t);
    return CONVERGED;
}

/* Residual, tangent (n, n) and change of the residual on the way, of the free unknowns. */
int linearise(const Model *m, const double *x, double way, double *residual, double *tangent, double *change) {
    Work *w = work_open(m, 1);
    const Stage at = stage(m, way);
    if (!w) return DIVERGED;
    place(m, w, x, at);
    assemble(m, w, at, MATRIX);
    memcpy(change, w->change, (size_t)m->free * sizeof(double));
    memcpy(tangent, w->factors.dense, (size_t)(m->free * m->free) * sizeof(double));
    for (Int i = 0; i < m->size; i++) if (m->slot[i] >= 0) residual[m->slot[i]] = w->gradient[i];
    work_close(w);
    return CONVERGED;
}

/* Solve with the tangent at x for right sides (count, n), in their place. */
int resolve(const Model *m, const double *x, double way, double *right, Int count, Int *unstable) {
    Work *w = work_open(m, 0);
    const Stage at = stage(m, way);
    int code = DIVERGED;
    if (w) {
        place(m, w, x, at);
        if (assemble(m, w, at, FACTORS)) {
            for (Int k = 0; k < count; k += 2) /* the slope is zero */
                factors_solve(&w->factors, right + k * m->free, k + 1 < count ? right + (k + 1) * m->free : w->slope);
            *unstable = told_unstable(m, w);
            code = CONVERGED;
        }
    }
    work_close(w);
    return code;
}

static double effort_of(const Model *m, const Work *w, Stage at) {
    double sum = 0.0;
    for (Int i = 0; i < m->size; i++) sum += w->gradient[i] * (at.by_share * m->base[i] + at.by_drive * m->rate[i]);
    return sum;
}

/* Take the step; return its largest part, of motions alone and the largest motion too, or a negative number if too far. */
static double correct(const Model *m, Work *w, double along, double *x, double *moved, double *largest) {
    double step = 0.0;
    *moved = *largest = 0.0;
    for (Int i = 0; i < m->free; i++) {
        const double d = w->step[i] + along * w->slope[i], unit = m->unit[i];
        double size = fabs(d);
        if (!(size <= 1e300)) return -1.0;
        if (unit < HUGE_VAL) size /= larger(10.0 * unit, fabs(x[i]));
        else if (size > LARGEST_CORRECTION) return -1.0;
        else *moved = larger(*moved, size);
        step = larger(step, size);
        x[i] += d;
        if (unit == HUGE_VAL) *largest = larger(*largest, fabs(x[i]));
    }
    return step;
}

int newton(const Model *m, Work *w, double *x, double *way, const Goal *goal, Found *found) {
    const Int n = m->free;
    const double *border = goal->border;
    double last = HUGE_VAL;
    for (Int round = 0; round < MAX_ROUNDS; round++) {
        Stage at = stage(m, *way);
        place(m, w, x, at);
        if (!assemble(m, w, at, FACTORS)) return SINGULAR_OR_FAR;
        for (Int i = 0; i < m->size; i++)
            if (m->slot[i] >= 0) {
                const Int a = m->slot[i];
                w->step[a] = -w->gradient[i];
                w->slope[a] = -w->change[a];
            }
        found->unstable = unstable_of(m, w);
        found->told = told_unstable(m, w);
        factors_solve(&w->factors, w->step, w->slope);
        double along = 0.0;
        if (border) {
            double left = goal->level - border[n] * *way, below = border[n];
            for (Int i = 0; i < n; i++) {
                left -= border[i] * (x[i] + w->step[i]);
                below += border[i] * w->slope[i];
            }
            along = left / below;
        }
        double moved, largest, change_work = 0.0;
        for (Int i = 0; i < n; i++) change_work += w->change[i] * w->step[i];
        const double step = correct(m, w, along, x, &moved, &largest);
        if (step < 0.0 || !(fabs(along) <= 1e300)) return SINGULAR_OR_FAR;
        *way += along;
        if (goal->quick && step * step < goal->tolerance) { /* the next correction is of the order of its square */
            found->effort = effort_of(m, w, at) + change_work;
            return CONVERGED;
        }
        /* a large force multiplies rounding: accept where motions stand and forces no longer come nearer */
        const int rounds = (moved < SAME_EQUILIBRIUM && step < 2e-5) || (moved < STANDING && step < 1e-3);
        const int stands = rounds && step > 0.3 * last;
        if (step < goal->tolerance * (1.0 + largest) || stands) {
            at = stage(m, *way);
            place(m, w, x, at);
            assemble(m, w, at, GRADIENT);
            found->effort = effort_of(m, w, at);
            return CONVERGED;
        }
        last = step;
    }
    return DIVERGED;
}

/* Newton's method for each of several guesses (count, n) at places (count) of the way: codes, unstable directions and efforts
 * to found (count, 3), slopes to rate. */
int solve_each(const Model *m, double *x, double *way, Int count, const Goal *goal, double *rate, double *found) {
    Work *w = work_open(m, 0);
    if (!w) return DIVERGED;
    for (Int k = 0; k < count; k++, x += m->free, rate += m->free, found += 3) {
        Found end = {0, 0, 0.0};
        found[0] = newton(m, w, x, way + k, goal, &end);
        memcpy(rate, w->slope, (size_t)m->free * sizeof(double));
        found[1] = (double)end.told;
        found[2] = end.effort;
    }
    work_close(w);
    return CONVERGED;
}

/* Make a vector (n) the softest mode of the motions by powers of their flexibility; return the mode's flexibility, 0 if
 * the tangent is singular. */
double soften(const Model *m, const double *x, double way, Int rounds, double *vector) {
    Work *w = work_open(m, 0);
    const Stage at = stage(m, way);
    double flexibility = 0.0;
    if (w) {
        place(m, w, x, at);
        for (Int round = assemble(m, w, at, FACTORS) ? 0 : rounds; round < rounds; round++) {
            double before = 0.0, along = 0.0, after = 0.0;
            for (Int i = 0; i < m->free; i++) w->step[i] = m->unit[i] == HUGE_VAL ? vector[i] : 0.0;
            factors_solve(&w->factors, w->step, w->slope); /* which is zero */
            for (Int i = 0; i < m->free; i++)
                if (m->unit[i] == HUGE_VAL) {
                    before += vector[i] * vector[i];
                    along += vector[i] * w->step[i];
                    after += w->step[i] * w->step[i];
                }
            flexibility = along / before;
            const double size = sqrt(after);
            if (!(size > 0.0) || !(size < 1e300)) { flexibility = 0.0; break; }
            for (Int i = 0; i < m->free; i++) vector[i] = w->step[i] / size;
        }
    }
    work_close(w);
    return flexibility;
}
