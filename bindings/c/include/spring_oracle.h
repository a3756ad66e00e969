/* Checks of Jacobians: is the Jacobian of a function correct, where is it wrong, and what does the error look like?
 *
 * Shapes: x has n numbers, f(x) has m, a Jacobian m x n, row by row. Matrices are dense or lists of entries.
 * Nothing unwinds across this interface. A callback reports a failure by a return value other than 0:
 *   SO_UNDEFINED  the function has no value at x: the point is left out
 *   SO_FAILED     the check ends, and returns SO_FAILED
 * An exception that leaves a callback ends the process, with a message. In C++, so_guard<f>::call is the callback f that returns
 * SO_FAILED in its place, and spring_oracle.hpp passes exceptions on. A callback that leaves
 * by longjmp leaves its check behind, with its memory: the next check on that thread does nothing and returns SO_JUMPED. So does a
 * check that a callback calls.
 * All functions may be called from several threads at a time.
 */
#ifndef SPRING_ORACLE_H
#define SPRING_ORACLE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SO_VERSION "0.2.0"

enum { SO_OK = 0, SO_UNDEFINED = 1, SO_FAILED = 2, SO_INVALID = 3, SO_FAULT = 4, SO_JUMPED = 5 };

typedef enum { SO_CORRECT = 0, SO_WRONG = 1, SO_INCONCLUSIVE = 2 } so_verdict;

/* Sets the m numbers of out to f(x). */
typedef int (*so_function)(const double *x, double *out, void *user);
/* Sets the m x n numbers of out to the Jacobian at x, row by row. */
typedef int (*so_jacobian)(const double *x, double *out, void *user);
/* Calls add(row, column, value, sink) for each entry of the Jacobian at x that is not zero. Several for one place add up. */
typedef void (*so_add)(size_t row, size_t column, double value, void *sink);
typedef int (*so_sparse)(const double *x, so_add add, void *sink, void *user);
/* Sets the m numbers of out to the product of the Jacobian at x with the vector v. */
typedef int (*so_product)(const double *x, const double *v, double *out, void *user);

/* A number by which a Jacobian may be off: a time step, a mass. */
typedef struct {
    const char *name;
    double value;
} so_factor;

/* Where and how to check. All zeros: at x alone. */
typedef struct {
    void *user;             /* passed on to the callbacks */
    const double *lower;    /* a box of arguments, n numbers each: points are drawn from it, */
    const double *upper;    /* and branches are searched for in it */
    size_t draws;           /* points drawn from the box; 0: 4 */
    int no_search;          /* 1: no search for branches */
    uint64_t seed;
    size_t block;           /* coordinates of a particle; 0: 1 */
    const so_factor *factors;
    size_t n_factors;
} so_options;

typedef struct {
    so_verdict verdict;
    size_t states;          /* points that were checked, */
    size_t wrong_states;    /* and those at which an entry is wrong */
    size_t wrong_entries;
    size_t row, column;     /* the worst entry, */
    double stated;          /* as it was given, */
    double measured;        /* by differences, */
    double bound;           /* and their bound; if all is correct, the largest relative bound of an entry */
    double slope;           /* of Taylor's remainder: 2 if the Jacobian is right, 1 if it is wrong; 0 if it was not found */
    size_t calls;           /* of the function, */
    size_t jacobians;       /* and of the Jacobian */
    char likeness[160];     /* what the error looks like; empty if nothing is wrong */
    char text[2048];        /* all of it for a reader, UTF-8 */
} so_report;

/* The version of the library. */
const char *so_version(void);

/* Check a Jacobian at x (which may be NULL if there is a box). options may be NULL. Return SO_OK if there is a report, whatever
 * it says; SO_FAILED if a callback failed; SO_INVALID for a null pointer, or for neither a point nor a box; SO_FAULT for a defect of the library;
 * SO_JUMPED if an earlier callback on this thread never returned. */
int so_check_jacobian(so_function f, so_jacobian jacobian, size_t n, size_t m, const double *x, const so_options *options,
                      so_report *report);
int so_check_sparse(so_function f, so_sparse jacobian, size_t n, size_t m, const double *x, const so_options *options,
                    so_report *report);
int so_check_product(so_function f, so_product jacobian, size_t n, size_t m, const double *x, const so_options *options,
                     so_report *report);

#ifdef __cplusplus
}
#if __cplusplus >= 201703L
/* A callback whose exceptions are failures: so_check_jacobian(so_guard<f>::call, so_guard<jacobian>::call, ...). */
template <auto callback>
struct so_guard;
template <class... Arguments, int (*callback)(Arguments...)>
struct so_guard<callback> {
    static int call(Arguments... arguments) noexcept {
        try {
            return callback(arguments...);
        } catch (...) {
            return SO_FAILED;
        }
    }
};
#endif
#endif
#endif
