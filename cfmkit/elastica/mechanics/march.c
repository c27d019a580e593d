/* The natural march along a drive, and many designs in a loop.
 *
 * numpy is the specification: `NumpyEquations.march`. Codes are those of equations.py. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "march.h"

#define LAND_FROM 1.3           /* steps to a target from which on it is hit by one */
#define SHORTEST_STEP 1e-13     /* share of the range */
#define N_PREDICTING 3          /* states whose polynomial predicts the next */

enum { DONE, STABILITY_CHANGES, STEPS_FAIL, FULL, BRANCH_ENDS, NO_START };

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
    const Goal goal = {NULL, 0.0, tolerance, 1};
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

static double flexibility(const Model *m, const double *x, double way, const Plan *plan, const double *any, double *vector) {
    memcpy(vector, any, (size_t)m->free * sizeof(double));
    return soften(m, x, way, (Int)plan->powers, vector);
}

/* `any` is a vector with a share of every mode, from which the softest one is found; NULL if it is not asked for. */
int march(const Model *m, Plan *plan, double *x, double *rate, double *way, const double *before, const double *targets,
          Int count, double *rows, Int room, Int *stored, const double *any) {
    const Int n = m->free, wide = 2 * n + 4;
    const size_t bytes = (size_t)n * sizeof(double);
    const Goal goal = {NULL, 0.0, plan->tolerance, 1};
    int code = DONE, known = 1, rejected = 0; /* equilibria that predict */
    Int kept = 0, passed = 0;
    Found found = {(Int)plan->unstable, (Int)plan->unstable, 0.0};
    double *memory = calloc((size_t)(8 * n + 1), sizeof(double));
    double *guess = memory, *next = memory + n, *scratch = memory + 2 * n;
    Known at[N_PREDICTING] = {{x, rate, *way}, {memory + 4 * n, memory + 5 * n, 0.0}, {memory + 6 * n, memory + 7 * n, 0.0}};
    Work *w = work_open(m, 0);
    if (!w || !memory) { code = NO_START; goto end; }
    if (before && before[2 * n] != *way) {
        memcpy(at[1].x, before, bytes); memcpy(at[1].rate, before + n, bytes);
        at[1].way = before[2 * n];
        known = 2;
    }
    if (plan->start != 0.0) {
        const Goal first = {NULL, 0.0, plan->tolerance, 0};
        if (newton(m, w, x, way, &first, &found)) { code = NO_START; goto end; }
        memcpy(rate, w->slope, bytes);
        plan->unstable = (double)found.unstable;
        if (count && targets[0] == *way) store(n, rows + wide * kept++, x, rate, *way, &found, (double)passed++);
    }
    if (any) plan->first_flexibility = flexibility(m, x, *way, plan, any, scratch);
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
    if (any && code == DONE) plan->last_flexibility = flexibility(m, x, *way, plan, any, scratch);
end:
    stored[0] = kept;
    stored[1] = passed;
    work_close(w);
    free(memory);
    return code;
}

/* A march from the first row to those behind it, with the error of the path if there are laws of elements. */
int march_rows(const Model *m, Plan *plan, const double *before, const double *targets, Int count, double *rows, Int room,
               Int *stored, const double *any, const Model *shapes, const double *laws, Int powers) {
    const Int n = m->free, wide = 2 * n + 4;
    double *here = malloc((size_t)wide * sizeof(double));
    if (!here) return NO_START;
    memcpy(here, rows, (size_t)wide * sizeof(double));
    const int code = march(m, plan, here, here + n, here + 2 * n, before, targets, count, rows + wide, room - 1, stored, any);
    if (laws && code == DONE) plan->error = path_error(m, shapes, laws, powers, rows, stored[0] + 1);
    free(here);
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
        codes[d] = march(m, &own, x, x + m->free, &way, NULL, targets, count, rows, room, stored, NULL);
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
