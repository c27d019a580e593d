/* Networks of mixed spectral elements as C takes them: arrays of a `Discretisation`, all dimensionless. */
#ifndef CFMKIT_MARCH_H
#define CFMKIT_MARCH_H

#include <stdint.h>

#define MAX_DEGREE 40
#define MAX_SHAPES (MAX_DEGREE + 1)
#define MAX_POINTS (MAX_DEGREE + 4) /* Gauss points of an element */
#define MAX_LOCAL (MAX_DEGREE + 9) /* unknowns of an element */
#define SIDE_WIDE 13               /* columns of `side_at` */
#define N_LAW 3                    /* numbers of `moved_law` before the coefficients of an angle */

typedef int64_t Int;

/* Inner loops once more for processors with wider vectors, where the compiler can choose at run time. Without contraction
 * (-std=c99) results are the same. */
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__)
#define FAST __attribute__((target_clones("avx2", "default")))
#else
#define FAST
#endif

/* Fields of 8 bytes: `march.py` fills a row of int64 with counts and addresses. e elements, q points, k attachments. */
typedef struct {
    Int elements, points, degree, size, free, springs, loads;
    Int ramp;    /* the drive is the share of what is constant; the drive proper rests */
    Int follows; /* some load turns with its node: the tangent is unsymmetric */
    Int contacts, presses; /* of nodes; how many of their forces are free */
    Int sides, moved, coefficients; /* contacts of sides of beams; elements that move with them; of their angles */
    const double *angle, *weight, *rigidity, *axial, *shear, *ahead; /* (e, q) */
    const double *length, *line, *gap, *bend; /* (e), (e, 2, 2), (e, 2), (e, triangle): int EI N_i' N_j' */
    const Int *unknowns, *ends;               /* (e, degree + 9), (e, 2) */
    const Int *places;                        /* (k, 4) */
    const double *arm, *origin, *frame;       /* (k, 2) */
    const double *values, *slopes;            /* (q, shapes) */
    const double *values_by_shape, *slopes_by_shape; /* (shapes, q) */
    const double *products;                   /* (q, triangle): N_i N_j, rows of the lower triangle */
    const Int *slot;                          /* (size): number among the free unknowns, -1 if held */
    const Int *leaves;                        /* (free): the last element that holds an unknown, -1 if none does */
    const double *base, *rate;                /* (size) */
    const double *unit;                       /* (free): unit of a section force, infinite for motions */
    const Int *spring_at;                     /* (springs, 3): kind, first and second place, -1 if none */
    const double *spring;                     /* (springs, 6) */
    const Int *load_at;                       /* (loads, 3): place, grows, follows */
    const double *load;                       /* (loads, 3): force x, y, moment */
    const double *rest, *curl, *hindrance;    /* (e, q): of wide strips; NULL without any */
    const Int *contact_at; /* (contacts, 8): kind, place, force, closed or -1, first part, segments, arcs, whether closed */
    const double *contact; /* (contacts, 6): gap or radius of a pad [m], sense, direction, compliance, unit of length [m] */
    const double *edge;    /* (parts, 6): segments, start, along, length; arcs, centre, radius, first, sweep, bulge [m] */
    const Int *side_at;    /* (sides, 13): element that ends there, place, force, parameter, flag, closed or -1, first part,
                            * place of an edge that moves or -1, row of the element among those that move, segments, arcs,
                            * whether the outline is closed, contact that has gap and force: of two beams one of both */
    const double *side;    /* (sides, 3): half the thickness, unit of length [m], radius of an edge that moves */
    const Int *moved_at;   /* (moved): elements */
    const double *moved_fixed, *moved_shares; /* (moved, 2), (moved, 2, sides): their ends are fixed + shares . parameters */
    const double *moved_law; /* (moved, 3 + coefficients): length, rigidity and curling of the beam, its unloaded angle by the parameter */
    const double *rule, *unit_bend; /* (2, q) Gauss points and weights; (triangle) int N_i' N_j' */
} Model;
#define N_FIELDS ((Int)(sizeof(Model) / sizeof(Int)))

/* Where on the way: both factors and their change with what is followed. */
typedef struct { double drive, share, by_drive, by_share; } Stage;

/* One term of the functional by the unknowns it acts on: gradient, Hessian, change of the gradient along the way. */
typedef struct {
    Int count;
    Int at[MAX_LOCAL];
    double gradient[MAX_LOCAL], change[MAX_LOCAL], hessian[MAX_LOCAL * MAX_LOCAL];
} Term;

typedef struct { double place[2], arm[2], by[2][3]; const Int *at; } Pose;

/* A line of segments and arcs with the free side to its left, and how far a place is from it [m]. */
typedef struct { const double *parts; Int segments, arcs, closed; } Outline;
typedef struct { double value, normal[2], curvature; } Distance;

/* L D L^T in the order of elimination, or L U. */
typedef struct {
    Int n, pivots, room, used;  /* room: numbers that fit, used: that are stored */
    Int *first, *unknown, *row; /* (n): where a pivot's rows begin; (n): its unknown; (room): rows it is coupled with */
    char *pair;                 /* (n): 1 for the first of two that are eliminated together */
    double *inverse, *factor;   /* (n, 2): of the pivot, beside it; (room) */
    double *front, *dense;      /* lower triangle by rows; (n, n) if unsymmetric */
    Int front_room, fronts;     /* numbers that fit; unknowns in it */
    Int *index, *position;      /* (n): unknown of a row of the front; row of an unknown, -1 if none */
    Int negative;               /* pivots; of L U the parity of negative eigenvalues */
} Factors;

static inline Int local_shape(Int shape) { return shape < 2 ? 3 + 4 * shape : 6 + shape; } /* unknown of a shape function */
static inline int is_dense(const Model *m) { return m->follows || m->sides; } /* an unsymmetric tangent */
static inline double larger(double a, double b) { return a > b ? a : b; } /* fmax is a call */

Stage stage(const Model *m, double way);
Int terms(const Model *m);
void term(const Model *m, Int number, const double *z, Stage at, int with_hessian, Term *out);

double bending_change(const Model *m, Int o, double curvature, double grows, double rest);

Pose pose(const Model *m, const double *z, Int k);
double load_work(const Model *m, const double *z);
Distance outline_distance(const Outline *o, double x, double y);
void contact_term(const Model *m, Int number, const double *z, Term *t);
int contact_gaps(const Model *m, const double *z, Int n, double *gaps);

int sides_move(const Model *m, const double *z);
int side_presses(const Model *m, Int number, const double *z);
Int side_term(const Model *m, Int number, const double *z, Term *t, double *frozen);
int sides_couple(const Model *m, Int number, const double *z, Factors *f);
void sides_columns(const Model *m, const double *z, Stage at, Term *t, Factors *f);
int side_curvatures(const Model *m, const double *z, Int n, double *curvatures);
int sides_stiffen(const Model *m, Factors *f, const Term *element, Int number);

int side_gaps(const Model *m, const double *z, const double *stages, Int n, const double *elements, Int rows,
              const double *numbers, Int count, const double *edge, const double *packed, Int along, int watches,
              double *found);
int side_places(const Model *m, const double *z, const double *stages, Int n, const double *places, Int count,
                const double *packed, Int along, double *found);

int factors_open(Factors *f, Int n, int unsymmetric);
void factors_close(Factors *f);
void factors_begin(Factors *f);
int factors_add(Factors *f, const Int *at, Int count, const double *matrix);
int factors_eliminate(Factors *f, const Int *leaves, Int element);
int factors_finish(Factors *f);
void factors_solve(const Factors *f, double *x, double *y);

#define GAP_ROUNDING 1e-13 /* of a gap, mean beam lengths; as in contact/terms.py */
#define SAME_EQUILIBRIUM 1e-7 /* motions that differ by less are one */

enum { CONVERGED, DIVERGED, SINGULAR_OR_FAR };

/* Memory of Newton's method. */
typedef struct {
    double *z, *gradient, *step, *slope, *change; /* (size), (size), (free) each */
    Factors factors;
    Factors symmetric; /* under loads that follow: of the symmetric part of the tangent; of sides: with places held */
    int definite;      /* whether that part, forces condensed, is positive: then nothing diverges */
    Int rows;          /* of contacts in the symmetric matrix of sides */
    Term term;
} Work;

/* What Newton's method looks for, and what it found. */
typedef struct {
    const double *border; /* (n + 1): border . (x, way) = level instead of a given way; NULL if none */
    double level;
    double tolerance;
    int quick; /* accept when the next correction would be below the tolerance */
} Goal;

typedef struct { Int unstable, told; double effort; } Found; /* effort: gradient of what the drive moves */

int newton(const Model *m, Work *w, double *x, double *way, const Goal *goal, Found *found);
Work *work_open(const Model *m, int dense);
void work_close(Work *w);
int evaluate(const Model *m, const double *z, const double *drive, double share, Int count, double *gradient, double *hessian);
int linearise(const Model *m, const double *x, double way, double *residual, double *tangent, double *change);
int resolve(const Model *m, const double *x, double way, double *right, Int count, Int *unstable);
int solve_each(const Model *m, double *x, double *way, Int count, const Goal *goal, double *rate, double *found);
double soften(const Model *m, const double *x, double way, Int rounds, double *vector);
int fill_network(Model *m, const Int *at, Int attachments, const double *rule, Int count, const double *spots, const double *beams,
                 Int powers, double *block);
int compare(const Model *models, Int designs, const Model *shapes, const double *laws, Int powers, const double *z,
            const double *drive, Int count, double tolerance, double *ends, double *found);
double path_error(const Model *m, const Model *shapes, const double *laws, Int powers, const double *rows, Int count);

/* Of a march: numbers of 8 bytes, too. */
typedef struct {
    double step, range, largest_turn, largest_force, tolerance, unstable, on_branch, start;
    double powers, first_flexibility, last_flexibility; /* of the softest mode at both ends, by so many powers; 0: not asked */
    double error; /* of the whole path, if it is asked for; not a number: not known */
} Plan;

int march(const Model *m, Plan *plan, double *x, double *rate, double *way, const double *before, const double *targets,
          Int count, double *rows, Int room, Int *stored, const double *any);
int march_rows(const Model *m, Plan *plan, const double *before, const double *targets, Int count, double *rows, Int room,
               Int *stored, const double *any, const Model *shapes, const double *laws, Int powers);
int march_many(const Model *models, Int designs, const Plan *plan, const double *targets, Int count, double *efforts,
               Int room, Int *codes, const Int *chosen, Int some, double *states);

#endif
