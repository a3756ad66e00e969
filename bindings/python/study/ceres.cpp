// ceres::GradientChecker for compare.py: whether the Jacobian of a callback agrees with Ridders' method.
#include <memory>
#include <vector>

#include <ceres/ceres.h>
#include <ceres/gradient_checker.h>

// Sets m values at n numbers, and m x n entries row by row unless these are null.
using Fill = void (*)(const double*, double*, double*);

class Callback : public ceres::CostFunction {
public:
    Callback(Fill fill, int n, int m) : fill_(fill) {
        set_num_residuals(m);
        mutable_parameter_block_sizes()->push_back(n);
    }
    bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
        fill_(x[0], residuals, jacobians ? jacobians[0] : nullptr);
        return true;
    }

private:
    Fill fill_;
};

extern "C" int gradient_check(Fill fill, int n, int m, const double* x, double step, double precision) {
    const Callback function(fill, n, m);
    ceres::NumericDiffOptions options;
    options.ridders_relative_initial_step_size = step;
    const double* const parameters[] = {x};
    const std::vector<const ceres::Manifold*>* euclidean = nullptr;
    return ceres::GradientChecker(&function, euclidean, options).Probe(parameters, precision, nullptr);
}
