/* The module `_march`: buffers in, codes out; every call releases the interpreter's lock. */
#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include "march.h"

#define MAX_BUFFERS 8

typedef struct { Py_buffer view[MAX_BUFFERS]; int count; } Buffers;

static void release(Buffers *b) {
    while (b->count > 0) PyBuffer_Release(&b->view[--b->count]);
}

/* Take the buffers of arguments `first` to `last` - 1; every one is an array in C order. */
static int take(PyObject *arguments, Py_ssize_t first, Py_ssize_t last, Buffers *b) {
    b->count = 0;
    for (Py_ssize_t k = first; k < last; k++) {
        PyObject *array = PyTuple_GetItem(arguments, k);
        if (!array || PyObject_GetBuffer(array, &b->view[b->count], PyBUF_C_CONTIGUOUS) != 0) {
            release(b);
            return 0;
        }
        b->count++;
    }
    return 1;
}

static void *at(Buffers *b, int k) { return b->view[k].len ? b->view[k].buf : NULL; } /* NULL of an empty array */

static int number(PyObject *arguments, Py_ssize_t k, double *value) {
    PyObject *item = PyTuple_GetItem(arguments, k);
    if (!item) return 0;
    *value = PyFloat_AsDouble(item);
    return !(*value == -1.0 && PyErr_Occurred());
}

/* evaluate(model, z, drives, gradients, hessians, share) -> code */
static PyObject *py_evaluate(PyObject *self, PyObject *arguments) {
    Buffers b;
    double share;
    int code;
    (void)self;
    if (!number(arguments, 5, &share) || !take(arguments, 0, 5, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    const Int count = b.view[2].len / (Int)sizeof(double);
    code = evaluate(at(&b, 0), at(&b, 1), at(&b, 2), share, count, at(&b, 3), at(&b, 4));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(code);
}

/* linearise(model, x, residual, tangent, change, way) -> code */
static PyObject *py_linearise(PyObject *self, PyObject *arguments) {
    Buffers b;
    double way;
    int code;
    (void)self;
    if (!number(arguments, 5, &way) || !take(arguments, 0, 5, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    code = linearise(at(&b, 0), at(&b, 1), way, at(&b, 2), at(&b, 3), at(&b, 4));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(code);
}

/* resolve(model, x, right, unstable, way) -> code */
static PyObject *py_resolve(PyObject *self, PyObject *arguments) {
    Buffers b;
    double way;
    int code;
    (void)self;
    if (!number(arguments, 4, &way) || !take(arguments, 0, 4, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    const Model *m = at(&b, 0);
    const Int count = b.view[2].len / ((Int)sizeof(double) * m->free);
    code = resolve(m, at(&b, 1), way, at(&b, 2), count, at(&b, 3));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(code);
}

/* solve(model, x, way, border, push, rate, found, level, tolerance, quick) -> code */
static PyObject *py_solve(PyObject *self, PyObject *arguments) {
    Buffers b;
    double level, tolerance, quick;
    int code;
    (void)self;
    if (!number(arguments, 7, &level) || !number(arguments, 8, &tolerance) || !number(arguments, 9, &quick)) return NULL;
    if (!take(arguments, 0, 7, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    code = solve(at(&b, 0), at(&b, 1), at(&b, 2), at(&b, 3), level, at(&b, 4), tolerance, quick != 0.0, at(&b, 5), at(&b, 6));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(code);
}

/* solve_many(models, x, ways, rates, found, tolerance, quick) -> code */
static PyObject *py_solve_many(PyObject *self, PyObject *arguments) {
    Buffers b;
    double tolerance, quick;
    int code;
    (void)self;
    if (!number(arguments, 5, &tolerance) || !number(arguments, 6, &quick) || !take(arguments, 0, 5, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    const Int count = b.view[2].len / (Int)sizeof(double);
    const Int designs = count ? b.view[4].len / (3 * (Int)sizeof(double) * count) : 0;
    code = solve_many(at(&b, 0), designs, at(&b, 1), at(&b, 2), count, tolerance, quick != 0.0, at(&b, 3), at(&b, 4));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(code);
}

/* soften(model, x, vector, way, rounds) -> flexibility */
static PyObject *py_soften(PyObject *self, PyObject *arguments) {
    Buffers b;
    double way, rounds, flexibility;
    (void)self;
    if (!number(arguments, 3, &way) || !number(arguments, 4, &rounds) || !take(arguments, 0, 3, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    flexibility = soften(at(&b, 0), at(&b, 1), way, (Int)rounds, at(&b, 2));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyFloat_FromDouble(flexibility);
}

/* compare(models, shapes, laws, z, drives, ends, found, tolerance) -> whether there was memory */
static PyObject *py_compare(PyObject *self, PyObject *arguments) {
    Buffers b;
    double tolerance;
    int good;
    (void)self;
    if (!number(arguments, 7, &tolerance) || !take(arguments, 0, 7, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    const Model *m = at(&b, 0);
    const Int wide = (Int)sizeof(double), designs = b.view[0].len / (Int)sizeof(Model), count = b.view[4].len / wide;
    const Int powers = b.view[2].len / (wide * designs * m->elements) - 2;
    good = compare(m, designs, at(&b, 1), at(&b, 2), powers, at(&b, 3), at(&b, 4), count, tolerance, at(&b, 5), at(&b, 6));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(good);
}

/* tables(shapes, row, cuts, coefficients, length, rigidities, tables, lengths, unit_length, unit_force) */
static PyObject *py_tables(PyObject *self, PyObject *arguments) {
    Buffers b;
    double length, force;
    (void)self;
    if (!number(arguments, 8, &length) || !number(arguments, 9, &force) || !take(arguments, 0, 8, &b)) return NULL;
    const Int wide = (Int)sizeof(double), elements = b.view[1].len / wide, beams = b.view[4].len / wide;
    beam_tables(at(&b, 0), elements, at(&b, 1), at(&b, 2), at(&b, 3), b.view[3].len / (wide * beams), at(&b, 4), at(&b, 5),
                beams, length, force, at(&b, 6), at(&b, 7));
    release(&b);
    Py_INCREF(Py_None);
    return Py_None;
}

/* place(row, first, arrays): put the addresses of arrays, but for None, into a row of int64 from a place on. */
static PyObject *py_place(PyObject *self, PyObject *arguments) {
    Buffers row, one;
    double first;
    (void)self;
    if (!number(arguments, 1, &first) || !take(arguments, 0, 1, &row)) return NULL;
    PyObject *arrays = PyTuple_GetItem(arguments, 2);
    const Py_ssize_t count = arrays ? PyTuple_Size(arrays) : -1;
    Int *cell = (Int *)at(&row, 0) + (Int)first;
    int good = count >= 0;
    for (Py_ssize_t k = 0; good && k < count; k++) {
        PyObject *array = PyTuple_GetItem(arrays, k);
        if (array == Py_None) continue;
        good = take(arrays, k, k + 1, &one);
        if (good) { cell[k] = (Int)(intptr_t)at(&one, 0); release(&one); }
    }
    release(&row);
    if (!good) return NULL;
    Py_INCREF(Py_None);
    return Py_None;
}

/* march(model, plan, x_rate_way, before, targets, rows, stored) -> code */
static PyObject *py_march(PyObject *self, PyObject *arguments) {
    Buffers b;
    int code;
    (void)self;
    if (!take(arguments, 0, 7, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    const Model *m = at(&b, 0);
    double *x = at(&b, 2);
    const Int count = b.view[4].len / (Int)sizeof(double), wide = (2 * m->free + 4) * (Int)sizeof(double);
    code = march(m, at(&b, 1), x, x + m->free, x + 2 * m->free, at(&b, 3), at(&b, 4), count, at(&b, 5), b.view[5].len / wide,
                 at(&b, 6));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(code);
}

/* march_many(models, plan, targets, efforts, codes, chosen, states, room) -> whether there was memory */
static PyObject *py_march_many(PyObject *self, PyObject *arguments) {
    Buffers b;
    double room;
    int code;
    (void)self;
    if (!number(arguments, 7, &room) || !take(arguments, 0, 7, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    code = march_many(at(&b, 0), b.view[4].len / (Int)sizeof(Int), at(&b, 1), at(&b, 2), b.view[2].len / (Int)sizeof(double),
                      at(&b, 3), (Int)room, at(&b, 4), at(&b, 5), b.view[5].len / (Int)sizeof(Int), at(&b, 6));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(code);
}

/* side_gaps(model, z, stages, elements, numbers, edge, tables, found, along, watches) -> whether no element vanishes */
static PyObject *py_side_gaps(PyObject *self, PyObject *arguments) {
    Buffers b;
    double along, watches;
    int good;
    (void)self;
    if (!number(arguments, 8, &along) || !number(arguments, 9, &watches) || !take(arguments, 0, 8, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    const Int wide = (Int)sizeof(double);
    good = side_gaps(at(&b, 0), at(&b, 1), at(&b, 2), b.view[2].len / (2 * wide), at(&b, 3), b.view[3].len / (2 * wide),
                     at(&b, 4), b.view[4].len / (12 * wide), at(&b, 5), at(&b, 6), (Int)along, watches != 0.0, at(&b, 7));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(good);
}

/* contact_gaps(model, z, gaps) */
static PyObject *py_contact_gaps(PyObject *self, PyObject *arguments) {
    Buffers b;
    (void)self;
    if (!take(arguments, 0, 3, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    const Model *m = at(&b, 0);
    contact_gaps(m, at(&b, 1), b.view[1].len / (m->size * (Int)sizeof(double)), at(&b, 2));
    Py_END_ALLOW_THREADS
    release(&b);
    Py_INCREF(Py_None);
    return Py_None;
}

/* side_curvatures(model, z, curvatures) -> whether no element vanishes */
static PyObject *py_side_curvatures(PyObject *self, PyObject *arguments) {
    Buffers b;
    int good;
    (void)self;
    if (!take(arguments, 0, 3, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    const Model *m = at(&b, 0);
    good = side_curvatures(m, at(&b, 1), b.view[1].len / (m->size * (Int)sizeof(double)), at(&b, 2));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(good);
}

/* side_places(model, z, stages, places, tables, found, along) -> whether no element vanishes */
static PyObject *py_side_places(PyObject *self, PyObject *arguments) {
    Buffers b;
    double along;
    int good;
    (void)self;
    if (!number(arguments, 6, &along) || !take(arguments, 0, 6, &b)) return NULL;
    Py_BEGIN_ALLOW_THREADS
    const Int wide = (Int)sizeof(double), n = b.view[2].len / (2 * wide);
    const Int count = n ? b.view[3].len / (2 * wide * n) : 0;
    good = side_places(at(&b, 0), at(&b, 1), at(&b, 2), n, at(&b, 3), count, at(&b, 4), (Int)along, at(&b, 5));
    Py_END_ALLOW_THREADS
    release(&b);
    return PyLong_FromLong(good);
}

static PyMethodDef methods[] = {
    {"evaluate", py_evaluate, METH_VARARGS, NULL}, {"linearise", py_linearise, METH_VARARGS, NULL},
    {"resolve", py_resolve, METH_VARARGS, NULL},   {"solve", py_solve, METH_VARARGS, NULL},
    {"solve_many", py_solve_many, METH_VARARGS, NULL}, {"soften", py_soften, METH_VARARGS, NULL},
    {"place", py_place, METH_VARARGS, NULL},       {"compare", py_compare, METH_VARARGS, NULL},
    {"tables", py_tables, METH_VARARGS, NULL},
    {"contact_gaps", py_contact_gaps, METH_VARARGS, NULL}, {"side_gaps", py_side_gaps, METH_VARARGS, NULL},
    {"side_places", py_side_places, METH_VARARGS, NULL}, {"side_curvatures", py_side_curvatures, METH_VARARGS, NULL},
    {"march", py_march, METH_VARARGS, NULL},       {"march_many", py_march_many, METH_VARARGS, NULL},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, "_march", NULL, -1, methods, NULL, NULL, NULL, NULL};

/* Code that was compiled before Python's side changed is told by the number of fields and columns, and not used. */
PyMODINIT_FUNC PyInit__march(void) {
    PyObject *module = PyModule_Create(&definition);
    if (module && PyModule_AddIntConstant(module, "FIELDS", sizeof(Model) / sizeof(Int) + SIDE_WIDE + N_LAW)) Py_CLEAR(module);
    return module;
}
