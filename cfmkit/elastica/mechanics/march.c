/* Newton's method on the functional and the natural march along a drive; many designs in a loop.
 *
 * numpy is the specification: energy.py and `NumpyEquations` of march.py. Codes are those of march.py. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "march.h"

#define LARGEST_CORRECTION 50.0 /* of a motion: beyond that Newton's method has left the path */
#define SAME_EQUILIBRIUM 1e-7   /* motions that differ by less are one */
#define STANDING 1e-10          /* motions that change by less stand: then forces may still change by 1e-3 */
#define MAX_ROUNDS 14
#define LAND_FROM 1.3           /* steps to a target from which on it is hit by one */
#define SHORTEST_STEP 1e-13     /* share of the range */
#define N_PREDICTING 3          /* states whose polynomial predicts the next */

enum { CONVERGED, DIVERGED, SINGULAR_OR_FAR };
enum { DONE, STABILITY_CHANGES, STEPS_FAIL, FULL, BRANCH_ENDS, NO_START };

struct Work {
    double *z, *gradient, *step, *slope, *change; /* (size), (size), (free) each */
    Factors factors;
    Factors symmetric; /* under loads that follow: of the symmetric part of the tangent */
    int definite;      /* whether that part, forces condensed, is positive: then nothing diverges */
    Term term;
};

Work *work_open(const Model *m) {
    Work *w = calloc(1, sizeof(Work));
    const size_t size = (size_t)m->size, n = (size_t)m->free;
    if (!w) return NULL;
    w->z = calloc(2 * size + 3 * n + 1, sizeof(double));
    int opened = w->z && factors_open(&w->factors, m->free, m->follows != 0);
    if (opened && m->follows) opened = factors_open(&w->symmetric, m->free, 0);
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

static double larger(double a, double b) { return a > b ? a : b; } /* fmax is a call */

static void place(const Model *m, Work *w, const double *x, Stage at) {
    for (Int i = 0; i < m->size; i++)
        w->z[i] = m->slot[i] >= 0 ? x[m->slot[i]] : at.share * m->base[i] + at.drive * m->rate[i];
}

static void add_to_gradient(Work *w, const Term *t) {
    for (Int i = 0; i < t->count; i++) w->gradient[t->at[i]] += t->gradient[i];
}

/* Gradient of all unknowns at w->z; with factors also those of the tangent and the change of the residual on the way. */
static int assemble(const Model *m, Work *w, Stage at, int with_factors) {
    Term *t = &w->term;
    Int slots[MAX_LOCAL];
    memset(w->gradient, 0, (size_t)m->size * sizeof(double));
    if (with_factors) {
        memset(w->change, 0, (size_t)m->free * sizeof(double));
        factors_begin(&w->factors);
        if (m->follows) factors_begin(&w->symmetric);
        w->definite = m->follows != 0;
    }
    for (Int k = 0; k < terms(m); k++) {
        term(m, k, w->z, at, with_factors, t);
        add_to_gradient(w, t);
        if (!with_factors) continue;
        for (Int i = 0; i < t->count; i++) {
            slots[i] = m->slot[t->at[i]];
            if (slots[i] >= 0) w->change[slots[i]] += t->change[i];
        }
        for (Int j = 0; j < t->count; j++) {
            const double moves = at.by_share * m->base[t->at[j]] + at.by_drive * m->rate[t->at[j]];
            if (slots[j] >= 0 || moves == 0.0) continue;
            for (Int i = 0; i < t->count; i++)
                if (slots[i] >= 0) w->change[slots[i]] += t->hessian[i * t->count + j] * moves;
        }
        if (!factors_add(&w->factors, slots, t->count, t->hessian)) return 0;
        const Int element = k + m->elements - terms(m);
        if (!m->follows) {
            if (element >= 0 && !factors_eliminate(&w->factors, m->leaves, element)) return 0;
            continue;
        }
        for (Int i = 0; i < t->count; i++)
            for (Int j = 0; j < i; j++) {
                double *one = t->hessian + i * t->count + j, *other = t->hessian + j * t->count + i;
                *one = *other = 0.5 * (*one + *other);
            }
        if (!factors_add(&w->symmetric, slots, t->count, t->hessian)) return 0;
        if (element >= 0 && !factors_eliminate(&w->symmetric, m->leaves, element)) w->definite = 0;
    }
    if (with_factors && m->follows)
        w->definite = w->definite && factors_finish(&w->symmetric, 0) && w->symmetric.negative == 2 * m->elements;
    return !with_factors || factors_finish(&w->factors, m->follows != 0);
}

/* Unstable directions. Under loads that follow: their parity, all that a march compares. */
static Int unstable_of(const Model *m, const Work *w) {
    if (!m->follows) return w->factors.negative - 2 * m->elements - m->presses;
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
    Work *w = work_open(m);
    const Stage at = stage(m, way);
    if (!w) return DIVERGED;
    place(m, w, x, at);
    assemble(m, w, at, 1);
    memcpy(change, w->change, (size_t)m->free * sizeof(double));
    memset(tangent, 0, (size_t)(m->free * m->free) * sizeof(double));
    for (Int i = 0; i < m->size; i++) if (m->slot[i] >= 0) residual[m->slot[i]] = w->gradient[i];
    for (Int k = 0; k < terms(m); k++) {
        Term *t = &w->term;
        term(m, k, w->z, at, 1, t);
        for (Int i = 0; i < t->count; i++)
            for (Int j = 0; j < t->count; j++) {
                const Int a = m->slot[t->at[i]], b = m->slot[t->at[j]];
                if (a >= 0 && b >= 0) tangent[a * m->free + b] += t->hessian[i * t->count + j];
            }
    }
    work_close(w);
    return CONVERGED;
}

/* Solve with the tangent at x for right sides (count, n), in their place. */
int resolve(const Model *m, const double *x, double way, double *right, Int count, Int *unstable) {
    Work *w = work_open(m);
    const Stage at = stage(m, way);
    int code = DIVERGED;
    if (w) {
        place(m, w, x, at);
        if (assemble(m, w, at, 1)) {
            for (Int k = 0; k < count; k++) factors_solve(&w->factors, m->follows != 0, right + k * m->free);
            *unstable = told_unstable(m, w);
            code = CONVERGED;
        }
    }
    work_close(w);
    return code;
}

/* What Newton's method looks for, and what it found. */
typedef struct {
    const double *border; /* (n + 1): border . (x, way) = level instead of a given way; NULL if none */
    double level;
    const double *push;   /* (n): added force; NULL if none */
    double tolerance;
    int quick; /* accept when the next correction would be below the tolerance */
} Goal;

typedef struct { Int unstable, told; double effort; } Found; /* effort: gradient of what the drive moves */

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

static int newton(const Model *m, Work *w, double *x, double *way, const Goal *goal, Found *found) {
    const Int n = m->free;
    const double *border = goal->border;
    double last = HUGE_VAL;
    for (Int round = 0; round < MAX_ROUNDS; round++) {
        Stage at = stage(m, *way);
        place(m, w, x, at);
        if (!assemble(m, w, at, 1)) return SINGULAR_OR_FAR;
        for (Int i = 0; i < m->size; i++)
            if (m->slot[i] >= 0) {
                const Int a = m->slot[i];
                w->step[a] = (goal->push ? goal->push[a] : 0.0) - w->gradient[i];
                w->slope[a] = -w->change[a];
            }
        found->unstable = unstable_of(m, w);
        found->told = told_unstable(m, w);
        factors_solve_two(&w->factors, m->follows != 0, w->step, w->slope);
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
            assemble(m, w, at, 0);
            found->effort = effort_of(m, w, at);
            return CONVERGED;
        }
        last = step;
    }
    return DIVERGED;
}

int solve(const Model *m, double *x, double *way, const double *border, double level, const double *push, double tolerance,
          int quick, double *rate, double *found) {
    const Goal goal = {border, level, push, tolerance, quick};
    Found end = {0, 0, 0.0};
    Work *w = work_open(m);
    if (!w) return DIVERGED;
    const int code = newton(m, w, x, way, &goal, &end);
    memcpy(rate, w->slope, (size_t)m->free * sizeof(double));
    found[0] = (double)end.told;
    found[1] = end.effort;
    work_close(w);
    return code;
}

/* Newton's method for each of several guesses (designs, count, n) at places (count) of the way: codes, unstable directions
 * and efforts to found (designs, count, 3), slopes to rate unless that is NULL. */
int solve_many(const Model *models, Int designs, double *x, double *way, Int count, double tolerance, int quick, double *rate,
               double *found) {
    const Goal goal = {NULL, 0.0, NULL, tolerance, quick};
    for (const Model *m = models; m < models + designs; m++) {
        Work *w = work_open(m);
        if (!w) return DIVERGED;
        for (Int k = 0; k < count; k++, x += m->free, found += 3) {
            Found end = {0, 0, 0.0};
            found[0] = newton(m, w, x, way + k, &goal, &end);
            if (rate) { memcpy(rate, w->slope, (size_t)m->free * sizeof(double)); rate += m->free; }
            found[1] = (double)end.told;
            found[2] = end.effort;
        }
        work_close(w);
    }
    return CONVERGED;
}

/* Make a vector (n) the softest mode of the motions by powers of their flexibility; return the mode's flexibility, 0 if
 * the tangent is singular. */
double soften(const Model *m, const double *x, double way, Int rounds, double *vector) {
    Work *w = work_open(m);
    const Stage at = stage(m, way);
    double flexibility = 0.0;
    if (w) {
        place(m, w, x, at);
        for (Int round = assemble(m, w, at, 1) ? 0 : rounds; round < rounds; round++) {
            double before = 0.0, along = 0.0, after = 0.0;
            for (Int i = 0; i < m->free; i++) w->step[i] = m->unit[i] == HUGE_VAL ? vector[i] : 0.0;
            factors_solve(&w->factors, m->follows != 0, w->step);
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

/* ---- natural march ----------------------------------------------------------------------------------------------- */
typedef struct { double *x, *rate; double way; } Known;

/* Hermite's polynomial through up to three equilibria and their slopes. */
static void predict(Int n, const Known *known, int count, double goal, double *guess) {
    memset(guess, 0, (size_t)n * sizeof(double));
    for (int k = 0; k < count; k++) {
        const double ahead = goal - known[k].way;
        double share = 1.0, slope = 0.0;
        for (int j = 0; j < count; j++)
            if (j != k) {
                const double apart = known[k].way - known[j].way;
                share *= (goal - known[j].way) / apart;
                slope += 2.0 / apart;
            }
        share *= share;
        const double by_x = share * (1.0 - slope * ahead), by_rate = share * ahead;
        for (Int i = 0; i < n; i++) guess[i] += by_x * known[k].x[i] + by_rate * known[k].rate[i];
    }
}

/* How a step went: largest motion, what the prediction missed of it, change of forces over the allowed one, and whether
 * the chord agrees with the slopes at both ends: else it is another path. */
typedef struct { double moved, missed, force; int agrees; } Judgement;

static Judgement judge(const Model *m, const Known *here, const double *x, const double *rate, const double *guess,
                       double ahead, double allowed_force) {
    Judgement j = {0.0, 0.0, 0.0, 1};
    double bend = 0.0, chord = 0.0, by_old = 0.0, by_new = 0.0, old = 0.0, new = 0.0;
    for (Int i = 0; i < m->free; i++) {
        const double d = x[i] - here->x[i];
        if (m->unit[i] < HUGE_VAL) {
            j.force = larger(j.force, fabs(d) / (allowed_force * m->unit[i] + 0.5 * fabs(here->x[i])));
            continue;
        }
        j.moved = larger(j.moved, fabs(d));
        j.missed = larger(j.missed, fabs(x[i] - guess[i]));
        bend = larger(bend, fabs(d - 0.5 * ahead * (here->rate[i] + rate[i])));
        chord += d * d; by_old += d * here->rate[i]; by_new += d * rate[i];
        old += here->rate[i] * here->rate[i]; new += rate[i] * rate[i];
    }
    const double sense = ahead > 0.0 ? 1.0 : -1.0;
    j.agrees = sense * by_old >= 0.5 * sqrt(chord * old) && sense * by_new >= 0.5 * sqrt(chord * new)
               && bend <= 0.25 * j.moved + SAME_EQUILIBRIUM;
    return j;
}

/* On a branch: go back from the new point along its own slope; unless the branch has ended that leads to `here`. */
static int leads_back(const Model *m, Work *w, const Known *here, const double *x, double ahead, double moved, double tolerance,
                      double *scratch) {
    const Goal goal = {NULL, 0.0, NULL, tolerance, 1};
    double *back = scratch, *slope = scratch + m->free, way = here->way, apart = 0.0;
    Found found;
    memcpy(slope, w->slope, (size_t)m->free * sizeof(double));
    for (Int i = 0; i < m->free; i++) back[i] = x[i] - ahead * slope[i];
    const int code = newton(m, w, back, &way, &goal, &found);
    for (Int i = 0; i < m->free && code == CONVERGED; i++)
        if (m->unit[i] == HUGE_VAL) apart = larger(apart, fabs(back[i] - here->x[i]));
    memcpy(w->slope, slope, (size_t)m->free * sizeof(double));
    return code == CONVERGED && apart < SAME_EQUILIBRIUM + 1e-3 * moved;
}

static void store(Int n, double *row, const double *x, const double *rate, double way, const Found *found, double target) {
    memcpy(row, x, (size_t)n * sizeof(double));
    memcpy(row + n, rate, (size_t)n * sizeof(double));
    row[2 * n] = way;
    row[2 * n + 1] = found->effort;
    row[2 * n + 2] = (double)found->told;
    row[2 * n + 3] = target;
}

int march(const Model *m, Plan *plan, double *x, double *rate, double *way, const double *before, const double *targets,
          Int count, double *rows, Int room, Int *stored) {
    const Int n = m->free, wide = 2 * n + 4;
    const size_t bytes = (size_t)n * sizeof(double);
    const Goal goal = {NULL, 0.0, NULL, plan->tolerance, 1};
    int code = DONE, known = 1, rejected = 0; /* equilibria that predict */
    Int kept = 0, passed = 0;
    Found found = {(Int)plan->unstable, (Int)plan->unstable, 0.0};
    double *memory = calloc((size_t)(8 * n + 1), sizeof(double));
    double *guess = memory, *next = memory + n, *scratch = memory + 2 * n;
    Known at[N_PREDICTING] = {{x, rate, *way}, {memory + 4 * n, memory + 5 * n, 0.0}, {memory + 6 * n, memory + 7 * n, 0.0}};
    Work *w = work_open(m);
    if (!w || !memory) { code = NO_START; goto end; }
    if (before && before[2 * n] != *way) {
        memcpy(at[1].x, before, bytes); memcpy(at[1].rate, before + n, bytes);
        at[1].way = before[2 * n];
        known = 2;
    }
    if (plan->start != 0.0) {
        const Goal first = {NULL, 0.0, NULL, plan->tolerance, 0};
        if (newton(m, w, x, way, &first, &found)) { code = NO_START; goto end; }
        memcpy(rate, w->slope, bytes);
        plan->unstable = (double)found.unstable;
        if (count && targets[0] == *way) store(n, rows + wide * kept++, x, rate, *way, &found, (double)passed++);
    }
    while (passed < count && kept < room) {
        const double left = targets[passed] - *way, sense = left > 0.0 ? 1.0 : -1.0;
        const int lands = fabs(left) <= LAND_FROM * plan->step;
        double to = lands ? targets[passed] : *way + sense * plan->step;
        const double ahead = to - *way;
        at[0].way = *way;
        if (known > 1 && (*way - at[1].way) * sense < 0.0) known = 1;
        predict(n, at, known, to, guess);
        memcpy(next, guess, bytes);
        const int bad = newton(m, w, next, &to, &goal, &found);
        Judgement j = {0.0, 0.0, 0.0, 1};
        if (!bad) j = judge(m, at, next, w->slope, guess, ahead, plan->largest_force);
        const int same = found.unstable == (Int)plan->unstable;
        const int too_far = bad || j.moved > plan->largest_turn || j.missed > 0.4 * j.moved + SAME_EQUILIBRIUM;
        if (!bad && j.force > 1.0 && j.moved <= plan->largest_turn) /* too long for the forces: no sign of trouble */
            plan->step = fabs(ahead) * larger(0.7 / j.force, 1e-4);
        else if (too_far || (same && j.moved > SAME_EQUILIBRIUM && !j.agrees)) {
            plan->step = 0.5 * fabs(ahead);
            rejected += 2;
        } else {
            rejected = rejected ? rejected - 1 : 0;
            if (!same) { code = STABILITY_CHANGES; break; }
            if (plan->on_branch != 0.0 && !leads_back(m, w, at, next, ahead, j.moved, plan->tolerance, scratch)) {
                code = BRANCH_ENDS;
                break;
            }
            const Known last = at[2]; /* its memory takes the one that is left */
            at[2] = at[1];
            at[1] = last;
            memcpy(at[1].x, x, bytes); memcpy(at[1].rate, rate, bytes); at[1].way = *way;
            known = known < N_PREDICTING ? known + 1 : known;
            memcpy(x, next, bytes); memcpy(rate, w->slope, bytes); *way = to;
            store(n, rows + wide * kept++, x, rate, to, &found, lands ? (double)passed : -1.0);
            passed += lands;
            const double quality = j.missed / (j.moved + 1e-8), size = fabs(ahead);
            if (quality < 0.1) plan->step = fmin(plan->range, 1.6 * (lands ? plan->step : larger(plan->step, size)));
            else if (quality > 0.25) plan->step = 0.8 * size;
            continue;
        }
        if (known > 1 && plan->step < 0.25 * fabs(*way - at[1].way)) known = 1;
        if (rejected > 7 || plan->step < SHORTEST_STEP * plan->range) { code = STEPS_FAIL; break; }
    }
    if (code == DONE && passed < count) code = FULL;
end:
    stored[0] = kept;
    stored[1] = passed;
    work_close(w);
    free(memory);
    return code;
}

/* One path a design: efforts at the targets (designs, count), not a number from where a path does not simply go on, and
 * the states (designs, some, n) at some of the targets. */
int march_many(const Model *models, Int designs, const Plan *plan, const double *targets, Int count, double *efforts, Int room,
               Int *codes, const Int *chosen, Int some, double *states) {
    for (Int d = 0; d < designs; d++) {
        const Model *m = models + d;
        const Int wide = 2 * m->free + 4;
        Plan own = *plan;
        Int stored[2];
        double way = 0.0, *x = calloc((size_t)(2 * m->free), sizeof(double)), *rows = malloc((size_t)(room * wide) * sizeof(double));
        for (Int k = 0; k < count; k++) efforts[d * count + k] = NAN;
        if (!x || !rows) { free(x); free(rows); return 0; }
        codes[d] = march(m, &own, x, x + m->free, &way, NULL, targets, count, rows, room, stored);
        for (Int k = 0; k < stored[0]; k++) {
            const double *row = rows + k * wide, target = row[wide - 1];
            if (target < 0.0) continue;
            efforts[d * count + (Int)target] = row[wide - 3];
            for (Int j = 0; j < some; j++)
                if (chosen[j] == (Int)target) memcpy(states + (d * some + j) * m->free, row, (size_t)m->free * sizeof(double));
        }
        free(x);
        free(rows);
    }
    return 1;
}
