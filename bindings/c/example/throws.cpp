// A callback of the C interface that throws: the process ends, and says why. spring_oracle.hpp catches exceptions.
#include <stdexcept>

#include "spring_oracle.h"

static int throws(const double*, double*, void*) { throw std::runtime_error("mine"); }

int main() {
    const double x[1] = {1};
    so_report report;
    return so_check_jacobian(throws, throws, 1, 1, x, nullptr, &report);
}
