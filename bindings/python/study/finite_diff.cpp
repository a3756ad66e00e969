// finite-diff's comparison of Jacobians for compare.py: central differences, and its own measure of equality.
#include <finitediff.hpp>

// Sets m values at n numbers, and m x n entries row by row unless these are null.
using Fill = void (*)(const double*, double*, double*);

extern "C" int compare_jacobian(Fill fill, int n, int m, const double* x, double step) {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::VectorXd point = Eigen::Map<const Eigen::VectorXd>(x, n);
    Eigen::VectorXd values(m);
    RowMajor jacobian(m, n);
    fill(x, values.data(), jacobian.data());
    const auto f = [&](const Eigen::VectorXd& at) -> Eigen::MatrixXd {
        fill(at.data(), values.data(), nullptr);
        return values;
    };
    Eigen::MatrixXd measured;
    fd::finite_jacobian(point, f, measured, fd::SECOND, step);
    return fd::compare_jacobian(jacobian, measured);
}
