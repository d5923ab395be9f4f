/* mstmm's looped engine behind the signature of native.h. */
#include "native.h"

typedef struct {
    int (*f)(const void *model, double *workspace, double t, const double *q, const double *u,
             const double *memory, const double *efforts, double *qdot, double *udot, void *balance,
             int *failure);
    const void *model;
    double *workspace;
    int failure[4];
} place;

static int evaluate(const double *context, const double *t, const double *q, const double *u,
                    const double *memory, const double *efforts, double *qdot, double *udot)
{
    place *at = (place *)context;
    return at->f(at->model, at->workspace, *t, q, u, memory, efforts, qdot, udot, 0, at->failure);
}

const accelerations looped_accelerations = evaluate;
