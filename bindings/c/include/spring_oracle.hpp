// The check of Jacobians for C++ with Eigen: a thin layer over spring_oracle.h, header only.
//
//   auto report = spring_oracle::check_jacobian(f, jacobian, x);   // any callables; dense, sparse or of fixed size
//   if (!report.correct()) std::cerr << report << '\n';
//
// An exception of a callback ends the check and is thrown again by it. After a callback that left by longjmp, the next check
// throws. spring_oracle_catch2.hpp and spring_oracle_gtest.hpp are matchers for unit tests.
#ifndef SPRING_ORACLE_HPP
#define SPRING_ORACLE_HPP

#include <exception>
#include <ostream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "spring_oracle.h"

namespace spring_oracle {

/// Where and how to check; see so_options.
struct Options {
    Eigen::VectorXd lower, upper;  // a box of arguments; empty: none
    std::size_t draws = 4;
    bool search = true;
    std::uint64_t seed = 1;
    std::size_t block = 1;
    std::vector<std::pair<std::string, double>> factors;
};

struct Report : so_report {
    bool correct() const { return verdict == SO_CORRECT; }
    bool wrong() const { return verdict == SO_WRONG; }
    /// The pattern of the error; empty if nothing is wrong.
    std::string looks() const { return likeness; }
};

inline std::ostream& operator<<(std::ostream& out, const Report& report) { return out << report.text; }

namespace detail {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

template <class F, class J>
struct Callbacks {
    F& f;
    J& jacobian;
    Eigen::Index n, m;
    std::exception_ptr failure;

    template <class Call>
    int guarded(Call call) noexcept {
        try {
            call();
            return SO_OK;
        } catch (...) {
            failure = std::current_exception();
            return SO_FAILED;
        }
    }
    static void expect(bool holds, const char* what) {
        if (!holds) throw std::invalid_argument(what);
    }
    Eigen::VectorXd at(const double* x) const { return Eigen::Map<const Eigen::VectorXd>(x, n); }

    static int value(const double* x, double* out, void* user) noexcept {
        auto& self = *static_cast<Callbacks*>(user);
        return self.guarded([&] {
            const Eigen::VectorXd y = self.f(self.at(x));
            expect(y.size() == self.m, "spring_oracle: the function returned another number of values than before");
            Eigen::Map<Eigen::VectorXd>(out, self.m) = y;
        });
    }
    static int dense(const double* x, double* out, void* user) noexcept {
        auto& self = *static_cast<Callbacks*>(user);
        return self.guarded([&] {
            const Eigen::MatrixXd j = self.jacobian(self.at(x));
            expect(j.rows() == self.m && j.cols() == self.n, "spring_oracle: the Jacobian must have a row a value and a column a variable");
            Eigen::Map<RowMajor>(out, self.m, self.n) = j;
        });
    }
    static int sparse(const double* x, so_add add, void* sink, void* user) noexcept {
        auto& self = *static_cast<Callbacks*>(user);
        return self.guarded([&] {
            const Eigen::SparseMatrix<double> j = self.jacobian(self.at(x));
            expect(j.rows() == self.m && j.cols() == self.n, "spring_oracle: the Jacobian must have a row a value and a column a variable");
            for (Eigen::Index k = 0; k < j.outerSize(); ++k)
                for (Eigen::SparseMatrix<double>::InnerIterator it(j, k); it; ++it)
                    add(static_cast<std::size_t>(it.row()), static_cast<std::size_t>(it.col()), it.value(), sink);
        });
    }
};

}  // namespace detail

/// Checks `jacobian` as the derivative of `f`, at `x` and in the box of the options.
template <class F, class J>
Report check_jacobian(F&& f, J&& jacobian, const Eigen::VectorXd& x, const Options& options = {}) {
    using Matrix = std::decay_t<decltype(jacobian(x))>;
    using Calls = detail::Callbacks<std::remove_reference_t<F>, std::remove_reference_t<J>>;
    const Eigen::VectorXd y = f(x);
    Calls calls{f, jacobian, x.size(), y.size(), nullptr};
    std::vector<so_factor> factors;
    for (const auto& [name, value] : options.factors) factors.push_back({name.c_str(), value});
    so_options given{};
    given.user = &calls;
    if (options.lower.size() > 0) {
        Calls::expect(options.lower.size() == x.size() && options.upper.size() == x.size(), "spring_oracle: the bounds must be as long as x");
        given.lower = options.lower.data();
        given.upper = options.upper.data();
    }
    given.draws = options.draws;
    given.no_search = !options.search;
    given.seed = options.seed;
    given.block = options.block;
    given.factors = factors.data();
    given.n_factors = factors.size();
    Report report{};
    const auto n = static_cast<std::size_t>(x.size()), m = static_cast<std::size_t>(y.size());
    int status;
    if constexpr (std::is_base_of_v<Eigen::SparseMatrixBase<Matrix>, Matrix>)
        status = so_check_sparse(&Calls::value, &Calls::sparse, n, m, x.data(), &given, &report);
    else
        status = so_check_jacobian(&Calls::value, &Calls::dense, n, m, x.data(), &given, &report);
    if (calls.failure) std::rethrow_exception(calls.failure);
    if (status == SO_JUMPED) throw std::runtime_error("spring_oracle: a callback of an earlier check left by longjmp, or calls a check");
    if (status != SO_OK) throw std::runtime_error("spring_oracle: the check failed with status " + std::to_string(status));
    return report;
}

/// Checks a gradient as the derivative of an energy.
template <class E, class G>
Report check_gradient(E&& energy, G&& gradient, const Eigen::VectorXd& x, const Options& options = {}) {
    return check_jacobian(
        [&](const Eigen::VectorXd& at) { return Eigen::VectorXd::Constant(1, energy(at)); },
        [&](const Eigen::VectorXd& at) -> Eigen::MatrixXd { return Eigen::VectorXd(gradient(at)).transpose(); }, x, options);
}

/// The checks of a force of the starter code.
struct ForceReport {
    Report energy, by_position, by_velocity;
    bool correct() const { return energy.correct() && by_position.correct() && by_velocity.correct(); }
    bool wrong() const { return energy.wrong() || by_position.wrong() || by_velocity.wrong(); }
    std::string looks() const { return energy.looks() + '\n' + by_position.looks() + '\n' + by_velocity.looks(); }
};

inline std::ostream& operator<<(std::ostream& out, const ForceReport& report) {
    return out << "gradE of E: " << report.energy << "\nHessX of gradE: " << report.by_position
               << "\nHessV of gradE: " << report.by_velocity;
}

/// Checks a force of the course's starter code: addGradEToTotal against addEnergyToTotal, addHessXToTotal and addHessVToTotal
/// against addGradEToTotal. All have the signs of the energy there: the gradient is minus the force. Each must add to what the
/// sums hold, so the sums do not begin at zero. A force without an energy (`has_energy` false) is checked by its gradient alone.
template <class Force>
ForceReport check_force(Force& force, const Eigen::VectorXd& x, const Eigen::VectorXd& v, const Eigen::VectorXd& m,
                        bool has_energy = true, Options options = {}) {
    options.block = options.block > 1 ? options.block : 2;
    const Eigen::Index n = x.size();
    const double before = 0.5;
    auto gradient = [&](const Eigen::VectorXd& at, const Eigen::VectorXd& speed) {
        Eigen::VectorXd sum = Eigen::VectorXd::Constant(n, before);
        force.addGradEToTotal(at, speed, m, sum);
        return Eigen::VectorXd(sum.array() - before);
    };
    auto energy = [&](const Eigen::VectorXd& at) {
        double sum = before;
        force.addEnergyToTotal(at, v, m, sum);
        return sum - before;
    };
    auto hessian_x = [&](const Eigen::VectorXd& at) {
        Eigen::MatrixXd sum = Eigen::MatrixXd::Constant(n, n, before);
        force.addHessXToTotal(at, v, m, sum);
        return Eigen::MatrixXd(sum.array() - before);
    };
    auto hessian_v = [&](const Eigen::VectorXd& speed) {
        Eigen::MatrixXd sum = Eigen::MatrixXd::Constant(n, n, before);
        force.addHessVToTotal(x, speed, m, sum);
        return Eigen::MatrixXd(sum.array() - before);
    };
    ForceReport report{};
    if (has_energy)
        report.energy = check_gradient(energy, [&](const Eigen::VectorXd& at) { return gradient(at, v); }, x, options);
    report.by_position = check_jacobian([&](const Eigen::VectorXd& at) { return gradient(at, v); }, hessian_x, x, options);
    Options speeds = options;
    speeds.lower.resize(0);
    speeds.upper.resize(0);
    report.by_velocity = check_jacobian([&](const Eigen::VectorXd& speed) { return gradient(x, speed); }, hessian_v, v, speeds);
    return report;
}

/// Checks functions of two points as files hold them: `void dV(Ref<Vector6d> g, q0, q1, parameters…)` and
/// `void d2V(Ref<Matrix66d> H, q0, q1, parameters…)`.
template <class DV, class D2V, class... Parameters>
Report check_hessian_file(DV&& dV, D2V&& d2V, const Eigen::Vector3d& q0, const Eigen::Vector3d& q1, Parameters... parameters) {
    Eigen::VectorXd x(6);
    x << q0, q1;
    Options options;
    options.block = 3;
    return check_jacobian(
        [&](const Eigen::VectorXd& at) {
            Eigen::Matrix<double, 6, 1> g;
            dV(g, Eigen::Vector3d(at.head<3>()), Eigen::Vector3d(at.tail<3>()), parameters...);
            return Eigen::VectorXd(g);
        },
        [&](const Eigen::VectorXd& at) {
            Eigen::Matrix<double, 6, 6> h;
            d2V(h, Eigen::Vector3d(at.head<3>()), Eigen::Vector3d(at.tail<3>()), parameters...);
            return Eigen::MatrixXd(h);
        },
        x, options);
}

}  // namespace spring_oracle
#endif
