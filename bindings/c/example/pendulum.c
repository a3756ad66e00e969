/* A pendulum in C: its Jacobian, the same with a mistake, callbacks that fail or never return, and 300 variables. */
#include <math.h>
#include <setjmp.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "spring_oracle.h"

#define N 300

#define EXPECT(holds)                                             \
    do {                                                          \
        if (!(holds)) {                                           \
            fprintf(stderr, "line %d: %s\n", __LINE__, #holds);   \
            return 1;                                             \
        }                                                         \
    } while (0)

static int pendulum(const double *x, double *out, void *user) {
    (void)user;
    out[0] = x[1];
    out[1] = -9.81 * sin(x[0]);
    return SO_OK;
}

/* The sign of the gravity is given by the user. */
static int pendulum_jacobian(const double *x, double *out, void *user) {
    out[0] = 0;
    out[1] = 1;
    out[2] = *(const double *)user * 9.81 * cos(x[0]);
    out[3] = 0;
    return SO_OK;
}

static int fails(const double *x, double *out, void *user) {
    (void)x, (void)out, (void)user;
    return SO_FAILED;
}

#ifndef SPRING_ORACLE_SANITIZE
static jmp_buf away;

static int jumps(const double *x, double *out, void *user) {
    (void)x, (void)out, (void)user;
    longjmp(away, 1);
}

/* A callback that leaves by longjmp: the next check says so, and the one after it works. */
static int check_after_jump(const double *x, so_options *options, so_report *report) {
    if (setjmp(away) == 0) {
        so_check_jacobian(pendulum, jumps, 2, 2, x, options, report);
        return SO_FAULT;
    }
    return so_check_jacobian(pendulum, pendulum_jacobian, 2, 2, x, options, report);
}
#endif

/* A chain of nonlinear springs. */
static int chain(const double *x, double *out, void *user) {
    (void)user;
    for (int k = 0; k < N; ++k) out[k] = (k ? x[k - 1] : 0) - 2 * x[k] + (k + 1 < N ? x[k + 1] : 0) - x[k] * x[k] * x[k];
    return SO_OK;
}

static int chain_jacobian(const double *x, double *out, void *user) {
    (void)user;
    memset(out, 0, sizeof(double) * N * N);
    for (int k = 0; k < N; ++k) {
        if (k) out[k * N + k - 1] = 1;
        out[k * N + k] = -2 - 3 * x[k] * x[k];
        if (k + 1 < N) out[k * N + k + 1] = 1;
    }
    return SO_OK;
}

int main(void) {
    double x[N] = {0.7, -0.3}, sign = -1;
    so_options options = {0};
    so_report report;
    options.user = &sign;
    EXPECT(strcmp(so_version(), SO_VERSION) == 0);

    EXPECT(so_check_jacobian(pendulum, pendulum_jacobian, 2, 2, x, &options, &report) == SO_OK);
    EXPECT(report.verdict == SO_CORRECT && report.bound < 1e-9);
    sign = 1;
    EXPECT(so_check_jacobian(pendulum, pendulum_jacobian, 2, 2, x, &options, &report) == SO_OK);
    EXPECT(report.verdict == SO_WRONG && report.row == 1 && report.column == 0);
    EXPECT(strstr(report.likeness, "negative"));
    puts(report.text);

    EXPECT(so_check_jacobian(pendulum, fails, 2, 2, x, &options, &report) == SO_FAILED);
    EXPECT(so_check_jacobian(fails, pendulum_jacobian, 2, 2, x, &options, &report) == SO_FAILED);
    EXPECT(so_check_jacobian(pendulum, NULL, 2, 2, x, &options, &report) == SO_INVALID);
    EXPECT(so_check_jacobian(pendulum, pendulum_jacobian, 2, 2, NULL, &options, &report) == SO_INVALID);

#ifndef SPRING_ORACLE_SANITIZE /* the memory of that check is lost, which a sanitizer reports */
    EXPECT(check_after_jump(x, &options, &report) == SO_JUMPED);
    EXPECT(so_check_jacobian(pendulum, pendulum_jacobian, 2, 2, x, &options, &report) == SO_OK);
#endif

    for (int k = 0; k < N; ++k) x[k] = sin(k + 1.0);
    clock_t start = clock();
    EXPECT(so_check_jacobian(chain, chain_jacobian, N, N, x, NULL, &report) == SO_OK);
    double milliseconds = 1e3 * (double)(clock() - start) / CLOCKS_PER_SEC;
    EXPECT(report.verdict == SO_CORRECT);
    printf("%d x %d: %.1f ms, %zu calls\n", N, N, milliseconds, report.calls);
    return 0;
}
