/* The module `_march`: arrays, then numbers in, a code or a number out; every call releases the interpreter's lock. */
#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include "march.h"

#define MAX_BUFFERS 9
#define MAX_NUMBERS 3

/* Arguments of a call: arrays in C order, NULL of an empty one, how many doubles each has, and numbers. */
typedef struct { void *at[MAX_BUFFERS]; Int count[MAX_BUFFERS]; double number[MAX_NUMBERS]; } Arguments;

static PyObject *run(PyObject *given, int arrays, int numbers, double (*call)(const Arguments *)) {
    Py_buffer view[MAX_BUFFERS];
    Arguments a;
    int taken = 0, good = 1;
    double outcome = 0.0;
    for (int k = 0; k < numbers && good; k++) {
        PyObject *item = PyTuple_GetItem(given, arrays + k);
        a.number[k] = item ? PyFloat_AsDouble(item) : 0.0;
        good = !PyErr_Occurred();
    }
    for (; taken < arrays && good; taken += good) {
        PyObject *array = PyTuple_GetItem(given, taken);
        good = array && PyObject_GetBuffer(array, &view[taken], PyBUF_C_CONTIGUOUS) == 0;
        if (!good) break;
        a.at[taken] = view[taken].len ? view[taken].buf : NULL;
        a.count[taken] = view[taken].len / (Int)sizeof(double);
    }
    if (good) {
        Py_BEGIN_ALLOW_THREADS
        outcome = call(&a);
        Py_END_ALLOW_THREADS
    }
    while (taken > 0) PyBuffer_Release(&view[--taken]);
    return good ? PyFloat_FromDouble(outcome) : NULL;
}

/* A function of the module: its arrays and numbers, and what it calls with them as `a`. */
#define FUNCTION(name, arrays, numbers, outcome) \
    static double call_##name(const Arguments *a) { const Model *m = a->at[0]; (void)m; return (double)(outcome); } \
    static PyObject *py_##name(PyObject *self, PyObject *given) { (void)self; return run(given, arrays, numbers, call_##name); }

/* model, z, drives, gradients, hessians; share -> code */
FUNCTION(evaluate, 5, 1, evaluate(m, a->at[1], a->at[2], a->number[0], a->count[2], a->at[3], a->at[4]))
/* model, x, residual, tangent, change; way -> code */
FUNCTION(linearise, 5, 1, linearise(m, a->at[1], a->number[0], a->at[2], a->at[3], a->at[4]))
/* model, x, right, unstable; way -> code */
FUNCTION(resolve, 4, 1, resolve(m, a->at[1], a->number[0], a->at[2], a->count[2] / m->free, a->at[3]))
/* model, x, ways, border, rate, found; level, tolerance, quick -> code */
FUNCTION(solve, 6, 3, solve_each(m, a->at[1], a->at[2], a->count[2],
                                 &(Goal){a->at[3], a->number[0], a->number[1], a->number[2] != 0.0}, a->at[4], a->at[5]))
/* model, x, vector; way, rounds -> flexibility */
FUNCTION(soften, 3, 2, soften(m, a->at[1], a->number[0], (Int)a->number[1], a->at[2]))
/* models, shapes, laws, z, drives, ends, found; tolerance -> whether there was memory */
FUNCTION(compare, 7, 1, compare(m, a->count[0] / N_FIELDS, a->at[1], a->at[2], a->count[2] * N_FIELDS / (a->count[0] * m->elements) - 2,
                                a->at[3], a->at[4], a->count[4], a->number[0], a->at[5], a->at[6]))
/* model, places, rule, spots, beams, block -> whether all beams can be fitted */
FUNCTION(fill, 6, 0, fill_network(a->at[0], a->at[1], a->count[1] / 2 - m->elements, a->at[2], a->count[2] / 2, a->at[3], a->at[4],
                                  a->count[4] / m->elements - 8, a->at[5]))
/* model, plan, before, targets, rows, stored, any vector, shapes, laws -> code */
FUNCTION(march, 9, 0, march_rows(m, a->at[1], a->at[2], a->at[3], a->count[3], a->at[4], a->count[4] / (2 * m->free + 4), a->at[5],
                                 a->at[6], a->at[7], a->at[8], a->count[8] / m->elements - 2))
/* model, states, works -> nothing */
static double load_works(const Model *m, const Arguments *a) {
    for (Int k = 0; k < a->count[2]; k++) ((double *)a->at[2])[k] = load_work(m, (double *)a->at[1] + k * (a->count[1] / a->count[2]));
    return 0.0;
}
FUNCTION(load_work, 3, 0, load_works(m, a))
/* models, plan, targets, efforts, codes, chosen, states; room -> whether there was memory */
FUNCTION(march_many, 7, 1, march_many(m, a->count[4], a->at[1], a->at[2], a->count[2], a->at[3], (Int)a->number[0], a->at[4], a->at[5],
                                      a->count[5], a->at[6]))
/* model, z, stages, elements, numbers, edge, tables, found; along, watches -> whether no element vanishes */
FUNCTION(side_gaps, 8, 2, side_gaps(m, a->at[1], a->at[2], a->count[2] / 2, a->at[3], a->count[3] / 2, a->at[4], a->count[4] / 12,
                                    a->at[5], a->at[6], (Int)a->number[0], a->number[1] != 0.0, a->at[7]))
/* model, z, gaps */
FUNCTION(contact_gaps, 3, 0, contact_gaps(m, a->at[1], a->count[1] / m->size, a->at[2]))
/* model, z, curvatures -> whether no element vanishes */
FUNCTION(side_curvatures, 3, 0, side_curvatures(m, a->at[1], a->count[1] / m->size, a->at[2]))
/* model, z, stages, places, tables, found; along -> whether no element vanishes */
FUNCTION(side_places, 6, 1, side_places(m, a->at[1], a->at[2], a->count[2] / 2, a->at[3],
                                        a->count[2] ? a->count[3] / a->count[2] : 0, a->at[4], (Int)a->number[0], a->at[5]))

/* place(row, first, arrays): put the addresses of arrays, but for None, into a row of int64 from a place on. */
static PyObject *py_place(PyObject *self, PyObject *given) {
    Py_buffer row, one;
    PyObject *into = PyTuple_GetItem(given, 0), *first = PyTuple_GetItem(given, 1), *arrays = PyTuple_GetItem(given, 2);
    (void)self;
    if (!into || !first || !arrays || PyObject_GetBuffer(into, &row, PyBUF_C_CONTIGUOUS) != 0) return NULL;
    Int *cell = (Int *)row.buf + PyLong_AsLong(first);
    int good = 1;
    for (Py_ssize_t k = 0; good && k < PyTuple_Size(arrays); k++) {
        PyObject *array = PyTuple_GetItem(arrays, k);
        if (array == Py_None) continue;
        good = PyObject_GetBuffer(array, &one, PyBUF_C_CONTIGUOUS) == 0;
        if (good) { cell[k] = one.len ? (Int)(intptr_t)one.buf : 0; PyBuffer_Release(&one); }
    }
    PyBuffer_Release(&row);
    return good ? PyLong_FromLong(0) : NULL;
}

#define ENTRY(name) {#name, py_##name, METH_VARARGS, NULL}
static PyMethodDef methods[] = {
    ENTRY(evaluate), ENTRY(linearise), ENTRY(resolve), ENTRY(solve), ENTRY(soften), ENTRY(compare), ENTRY(fill), ENTRY(load_work),
    ENTRY(march), ENTRY(march_many), ENTRY(side_gaps), ENTRY(contact_gaps), ENTRY(side_curvatures), ENTRY(side_places), ENTRY(place),
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, "_march", NULL, -1, methods, NULL, NULL, NULL, NULL};

/* Code that was compiled before Python's side changed is told by the number of fields and columns, and not used. */
PyMODINIT_FUNC PyInit__march(void) {
    PyObject *module = PyModule_Create(&definition);
    if (module && PyModule_AddIntConstant(module, "FIELDS", N_FIELDS + SIDE_WIDE + N_LAW)) Py_CLEAR(module);
    return module;
}
