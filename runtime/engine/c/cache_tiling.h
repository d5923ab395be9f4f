/* Cache tiling for large scenes: data are reused while they are in the cache and prefetched in
 * time. */
#ifndef MSTMM_TILES_H
#define MSTMM_TILES_H

#include "sweep.h"

/* Bodies that are begun and swept at a time.  So far ahead numbers are asked for, and the records
 * that tell where they are by as much more. */
#define MSTMM_TILE 8

/* The least of bodies first..end-1 and of their parents but the ground. */
static inline int mstmm_least_parent(const mstmm_model *model, int first, int end)
{
    int least = first;
    for (int i = first; i < end; i++)
        if (model->bodies[i].parent >= 0 && model->bodies[i].parent < least)
            least = model->bodies[i].parent;
    return least;
}

static inline int mstmm_end_of_tile(const mstmm_model *model, int first)
{
    return first + MSTMM_TILE < model->n_bodies ? first + MSTMM_TILE : model->n_bodies;
}

/* The last body that a closed loop is told by. */
static inline int mstmm_last_of(const mstmm_model *model, int loop)
{
    const mstmm_closure *closure = &model->closures[loop];
    return closure->frame > closure->outboard ? closure->frame : closure->outboard;
}

/* Scenes with fewer bodies (about 10 MB) are not prefetched, which would only cost time. */
static inline int mstmm_beyond_cache(const mstmm_model *model) { return model->n_bodies >= 4000; }

/* Compilers drop calls of functions that only prefetch, so this is inlined. */
#ifdef __GNUC__
#define MSTMM_AT_ONCE __attribute__((always_inline)) static inline
#else
#define MSTMM_AT_ONCE static inline
#endif

MSTMM_AT_ONCE void mstmm_fetch(const void *from, const void *to)
{
#ifdef __GNUC__
    const uintptr_t line = 64;
    for (uintptr_t at = (uintptr_t)from & ~(line - 1); at < (uintptr_t)to; at += line)
        __builtin_prefetch((const void *)at);
#endif
}

/* Numbers of a rigid body. */
#define MSTMM_RIGID_NUMBERS 10

/* Prefetches the law that follows `ahead` laws after `index`. */
MSTMM_AT_ONCE void mstmm_fetch_law(const mstmm_model *model, int index, int ahead)
{
    const int near = index + ahead, far = near + ahead;
    if (far < 0 || far >= model->n_laws) return;
    mstmm_fetch(&model->laws[far], &model->laws[far] + 1);
    const mstmm_law *law = &model->laws[near];
    mstmm_fetch(law->p, law->p + MSTMM_TILE);
    mstmm_fetch(law->effort, law->effort + law->n);
}

/* The body that will be met `ahead` of body `index`; NULL near the end of the sweep. */
MSTMM_AT_ONCE const mstmm_body *mstmm_coming(const mstmm_model *model, int index, int ahead)
{
    const int near = index + ahead, far = near + ahead;
    if (far < 0 || far >= model->n_bodies) return NULL;
    mstmm_fetch(&model->bodies[far], &model->bodies[far] + 1);
    return &model->bodies[near];
}

#endif
