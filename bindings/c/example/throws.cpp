// A callback of the C interface that throws: with so_guard, the check fails; without it, the process ends, and says why.
#include <stdexcept>

#include "spring_oracle.h"

static int throws(const double*, double*, void*) { throw std::runtime_error("mine"); }

int main() {
    const double x[1] = {1};
    so_report report;
    const auto guarded = so_guard<throws>::call;
    if (so_check_jacobian(guarded, guarded, 1, 1, x, nullptr, &report) != SO_FAILED) return 1;
    return so_check_jacobian(throws, throws, 1, 1, x, nullptr, &report);
}
