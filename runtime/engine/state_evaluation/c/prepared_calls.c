/* Calls of C from Python with the lowest overhead: rows of doubles in, new arrays of doubles out.
 *
 * A second Python module beside the one that cffi writes, in the same library.  `prepare` makes a
 * function of a C function and its record once; what it is given is checked here, and answers are
 * written where they stay. */
#define Py_LIMITED_API 0x030B0000
#define NPY_NO_DEPRECATED_API NPY_2_0_API_VERSION
#include <Python.h>
#include <numpy/arrayobject.h>

enum { MOST_ROWS = 4, MOST_ANSWERS = 8, MOST_AXES = 3 };

/* As single_state.h has it. */
typedef int called(const void *record, double number, const double *const *rows,
                   double *const *answers);

typedef struct {
    int n_axes;
    npy_intp axes[MOST_AXES];
} shape;

typedef struct {
    called *function;
    const void *record;
    PyObject *kept;  /* what `record` points to */
    int numbered;    /* a float comes before the rows */
    int optional;    /* the last row may be None */
    int released;    /* other threads run meanwhile; else one record serves them all */
    int n_rows, n_answers;
    npy_intp widths[MOST_ROWS];
    shape answers[MOST_ANSWERS];
} prepared;

/* The numbers of a row that C can read where it is; NULL for anything else. */
static const double *array_row(PyObject *given, npy_intp width)
{
    if (!PyArray_CheckExact(given)) return NULL;
    PyArrayObject *array = (PyArrayObject *)given;
    const int fits = PyArray_TYPE(array) == NPY_DOUBLE && PyArray_NDIM(array) == 1 &&
                     PyArray_DIM(array, 0) == width && PyArray_ISCARRAY_RO(array);
    return fits ? PyArray_DATA(array) : NULL;
}

/* Fills number and rows; 0 if the arguments are no such state. */
static int read_arguments(const prepared *one, PyObject *const *given, double *number,
                          const double **rows)
{
    if (one->numbered) {
        if (!PyFloat_CheckExact(*given)) return 0;
        *number = PyFloat_AsDouble(*given++);
    }
    for (int k = 0; k < one->n_rows; k++) {
        rows[k] = array_row(given[k], one->widths[k]);
        const int left_out = k == one->n_rows - 1 && one->optional && Py_IsNone(given[k]);
        if (!rows[k] && !left_out) return 0;
    }
    return 1;
}

/* New arrays for the results; 0 without memory. */
static int make_arrays(const prepared *one, PyObject **arrays, double **answers)
{
    for (int k = 0; k < one->n_answers; k++) {
        const shape *of = &one->answers[k];
        arrays[k] = PyArray_SimpleNew(of->n_axes, of->axes, NPY_DOUBLE);
        if (!arrays[k]) {
            while (k > 0) Py_DecRef(arrays[--k]);
            return 0;
        }
        answers[k] = PyArray_DATA((PyArrayObject *)arrays[k]);
    }
    return 1;
}

static int run_function(const prepared *one, double number, const double **rows, double **answers)
{
    int failed;
    if (!one->released) return one->function(one->record, number, rows, answers);
    Py_BEGIN_ALLOW_THREADS failed = one->function(one->record, number, rows, answers);
    Py_END_ALLOW_THREADS return failed;
}

static PyObject *return_arrays(const prepared *one, PyObject **arrays)
{
    if (one->n_answers == 1) return arrays[0];
    PyObject *all = PyTuple_New(one->n_answers);
    for (int k = 0; k < one->n_answers; k++)
        if (all)
            PyTuple_SetItem(all, k, arrays[k]);
        else
            Py_DecRef(arrays[k]);
    return all;
}

static PyObject *call_prepared(PyObject *self, PyObject *const *given, Py_ssize_t count)
{
    const prepared *one = PyCapsule_GetPointer(self, NULL);
    const double *rows[MOST_ROWS];
    double number = 0, *answers[MOST_ANSWERS];
    PyObject *arrays[MOST_ANSWERS];
    if (!one) return NULL;
    if (count != one->numbered + one->n_rows)
        return PyErr_Format(PyExc_TypeError, "expected %d arguments", one->numbered + one->n_rows);
    if (!read_arguments(one, given, &number, rows)) Py_RETURN_NONE;
    if (!make_arrays(one, arrays, answers)) return NULL;
    if (!run_function(one, number, rows, answers)) return return_arrays(one, arrays);
    for (int k = 0; k < one->n_answers; k++) Py_DecRef(arrays[k]);
    Py_RETURN_NONE;
}

static void free_prepared(PyObject *capsule)
{
    prepared *one = PyCapsule_GetPointer(capsule, NULL);
    Py_DecRef(one->kept);
    PyMem_Free(one);
}

/* Whole numbers of a tuple; how many, or -1. */
static int sizes_of(PyObject *given, int most, npy_intp *sizes)
{
    const Py_ssize_t count = PyTuple_Size(given);
    if (count > most) PyErr_Format(PyExc_ValueError, "expected at most %d sizes", most);
    for (Py_ssize_t k = 0; count <= most && k < count; k++)
        sizes[k] = PyLong_AsSsize_t(PyTuple_GetItem(given, k));
    return PyErr_Occurred() ? -1 : (int)count;
}

static int fill_prepared(prepared *one, PyObject *widths, PyObject *shapes)
{
    const Py_ssize_t count = PyTuple_Size(shapes);
    one->n_rows = sizes_of(widths, MOST_ROWS, one->widths);
    if (one->n_rows < 0 || count < 0) return 0;
    if (count < 1 || count > MOST_ANSWERS) {
        PyErr_Format(PyExc_ValueError, "expected 1 to %d answers", MOST_ANSWERS);
        return 0;
    }
    one->n_answers = (int)count;
    for (int k = 0; k < one->n_answers; k++) {
        shape *of = &one->answers[k];
        of->n_axes = sizes_of(PyTuple_GetItem(shapes, k), MOST_AXES, of->axes);
        if (of->n_axes < 0) return 0;
    }
    return 1;
}

static PyMethodDef called_as = {
    "prepared", (PyCFunction)(void (*)(void))call_prepared, METH_FASTCALL,
    "New arrays, or None where what is given are no rows of doubles, or something fails."};

static PyObject *prepare(PyObject *module, PyObject *given)
{
    (void)module;
    Py_ssize_t function, record;
    PyObject *widths, *shapes, *kept;
    int numbered, optional, released;
    if (!PyArg_ParseTuple(given, "nnO!O!pppO", &function, &record, &PyTuple_Type, &widths,
                          &PyTuple_Type, &shapes, &numbered, &optional, &released, &kept))
        return NULL;
    prepared *one = PyMem_Calloc(1, sizeof *one);
    if (!one) return PyErr_NoMemory();
    one->function = (called *)function;
    one->record = (const void *)record;
    one->numbered = numbered, one->optional = optional, one->released = released;
    PyObject *self =
        fill_prepared(one, widths, shapes) ? PyCapsule_New(one, NULL, free_prepared) : NULL;
    if (!self) {
        PyMem_Free(one);
        return NULL;
    }
    Py_IncRef(one->kept = kept);
    PyObject *found = PyCFunction_NewEx(&called_as, self, NULL);
    Py_DecRef(self);
    return found;
}

static PyMethodDef methods[] = {
    {"prepare", prepare, METH_VARARGS,
     "prepare(function, record, widths, shapes, numbered, optional, released, kept): a call."},
    {NULL, NULL, 0, NULL}};

static struct PyModuleDef module_def = {
    PyModuleDef_HEAD_INIT, "_prepared", NULL, -1, methods, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__prepared(void)
{
    return PyArray_ImportNumPyAPI() ? NULL : PyModule_Create(&module_def);
}
