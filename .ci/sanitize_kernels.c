/* Calls every kernel of the registry on arrays of exactly the declared size, with ordinary and with
 * hostile numbers; meant to be built with the address and undefined-behaviour sanitizers.  Fails if a
 * kernel returns a code it does not declare or changes its input. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "elements.h"

static uint64_t state = 88172645463325252u;

static double uniform(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (double)(state >> 11) / 9007199254740992.0;
}

static double number(int pattern)
{
    switch (pattern) {
    case 0: return 2 * uniform() - 1;
    case 1: return 0;
    case 2: return (2 * uniform() - 1) * 1e160;
    case 3: return (2 * uniform() - 1) * 1e-300;
    case 4: return uniform() < 0.2 ? (double)NAN : uniform();
    case 5: return uniform() < 0.2 ? (double)INFINITY : -uniform();
    default: return floor(5 * uniform() - 2);
    }
}

static size_t size(const mstmm_port *port, int n)
{
    size_t count = (size_t)port->length;
    for (int i = 0; i < port->power; ++i) count *= (size_t)n;
    return count;
}

static double **arrays(const mstmm_port *ports, int count, int n, int pattern)
{
    double **list = malloc(((size_t)count + 1) * sizeof *list);
    for (int i = 0; i < count; ++i) {
        const size_t length = size(&ports[i], n);
        list[i] = malloc(length * sizeof **list);
        for (size_t k = 0; k < length; ++k) list[i][k] = number(pattern);
    }
    return list;
}

static void release(double **list, int count)
{
    for (int i = 0; i < count; ++i) free(list[i]);
    free(list);
}

static int declared(const mstmm_kernel *kernel, int code)
{
    if (code == 0) return 1;
    for (int i = 0; i < kernel->n_guards; ++i)
        if (kernel->guards[i].code == code) return 1;
    return 0;
}

static int try_kernel(const mstmm_element *element, const mstmm_kernel *kernel, int n, int pattern)
{
    const uint64_t seed = state;
    double **in = arrays(kernel->inputs, kernel->n_inputs, n, pattern);
    state = seed;
    double **copy = arrays(kernel->inputs, kernel->n_inputs, n, pattern);
    double **out = arrays(kernel->outputs, kernel->n_outputs, n, 0);
    const int code = kernel->call(n, (const double *const *)in, out);
    int bad = !declared(kernel, code);
    if (bad) printf("%s.%s: undeclared code %d\n", element->name, kernel->name, code);
    for (int i = 0; i < kernel->n_inputs; ++i)
        if (memcmp(in[i], copy[i], size(&kernel->inputs[i], n) * sizeof **in) != 0) {
            printf("%s.%s changed its input %s\n", element->name, kernel->name,
                   kernel->inputs[i].name);
            bad = 1;
        }
    release(in, kernel->n_inputs);
    release(copy, kernel->n_inputs);
    release(out, kernel->n_outputs);
    return bad;
}

int main(void)
{
    int calls = 0, bad = 0;
    for (int e = 0; e < mstmm_element_count; ++e) {
        const mstmm_element *element = mstmm_elements[e];
        for (int k = 0; k < element->n_kernels; ++k)
            for (int pattern = 0; pattern < 7; ++pattern)
                for (int n = 1; n <= 4; ++n, ++calls)
                    bad += try_kernel(element, &element->kernels[k], n, pattern);
    }
    printf("%d elements, %d calls, %d bad\n", mstmm_element_count, calls, bad);
    return bad != 0 || calls == 0;
}
