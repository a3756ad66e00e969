// Forces with the interface of the course's starter code, right and with ten mistakes each; sparse and fixed-size matrices,
// function files, and exceptions.
#include <cmath>
#include <functional>
#include <iostream>
#include <stdexcept>

#include <spring_oracle.hpp>

using Eigen::Matrix2d, Eigen::MatrixXd, Eigen::Vector2d, Eigen::VectorXd;

static int failures = 0;
#define EXPECT(holds) \
    do { if (!(holds)) { std::cerr << "line " << __LINE__ << ": " << #holds << '\n'; ++failures; } } while (0)

// A force: energy, its gradient, and the derivatives of that; `edit` spoils what is added.
struct Force {
    virtual ~Force() = default;
    std::function<void(const VectorXd& x, MatrixXd&)> edit;
    std::function<void(VectorXd&)> edit_gradient;
    virtual double energy(const VectorXd& x, const VectorXd& v, const VectorXd& m) const = 0;
    virtual VectorXd gradient(const VectorXd& x, const VectorXd& v, const VectorXd& m) const = 0;
    virtual MatrixXd hessian_x(const VectorXd& x, const VectorXd& v, const VectorXd& m) const = 0;
    virtual MatrixXd hessian_v(const VectorXd& x, const VectorXd&, const VectorXd&) const { return MatrixXd::Zero(x.size(), x.size()); }

    void addEnergyToTotal(const VectorXd& x, const VectorXd& v, const VectorXd& m, double& sum) { sum += energy(x, v, m); }
    void addGradEToTotal(const VectorXd& x, const VectorXd& v, const VectorXd& m, VectorXd& sum) {
        VectorXd g = gradient(x, v, m);
        if (edit_gradient) edit_gradient(g);
        sum += g;
    }
    void addHessXToTotal(const VectorXd& x, const VectorXd& v, const VectorXd& m, MatrixXd& sum) {
        MatrixXd h = hessian_x(x, v, m);
        if (edit && !by_velocity) edit(x, h);
        sum += h;
    }
    void addHessVToTotal(const VectorXd& x, const VectorXd& v, const VectorXd& m, MatrixXd& sum) {
        MatrixXd h = hessian_v(x, v, m);
        if (edit && by_velocity) edit(x, h);
        sum += h;
    }
    bool by_velocity = false;  // which derivative is spoilt
};

// A spring with damping between the first two particles: k 9, rest length 0.8.
struct Spring : Force {
    double k = 9, l0 = 0.8, b = 0;
    double energy(const VectorXd& x, const VectorXd&, const VectorXd&) const override {
        const double l = (x.segment<2>(2) - x.segment<2>(0)).norm();
        return 0.5 * k * (l - l0) * (l - l0);
    }
    VectorXd gradient(const VectorXd& x, const VectorXd& v, const VectorXd&) const override {
        const Vector2d d = x.segment<2>(2) - x.segment<2>(0), w = v.segment<2>(2) - v.segment<2>(0), n = d.normalized();
        const Vector2d g = (k * (d.norm() - l0) + b * n.dot(w)) * n;
        VectorXd sum = VectorXd::Zero(x.size());
        sum.segment<2>(2) = g;
        sum.segment<2>(0) = -g;
        return sum;
    }
    static MatrixXd spread(const Matrix2d& block, Eigen::Index size) {
        MatrixXd h = MatrixXd::Zero(size, size);
        h.block<2, 2>(0, 0) = h.block<2, 2>(2, 2) = block;
        h.block<2, 2>(0, 2) = h.block<2, 2>(2, 0) = -block;
        return h;
    }
    MatrixXd hessian_x(const VectorXd& x, const VectorXd& v, const VectorXd&) const override {
        const Vector2d d = x.segment<2>(2) - x.segment<2>(0), w = v.segment<2>(2) - v.segment<2>(0), n = d.normalized();
        const Matrix2d across = Matrix2d::Identity() - n * n.transpose();
        const double l = d.norm();
        return spread(k * (n * n.transpose() + (l - l0) / l * across)
                          + b / l * (n.dot(w) * Matrix2d::Identity() + n * w.transpose()) * across, x.size());
    }
    MatrixXd hessian_v(const VectorXd& x, const VectorXd&, const VectorXd&) const override {
        const Vector2d n = (x.segment<2>(2) - x.segment<2>(0)).normalized();
        return spread(b * n * n.transpose(), x.size());
    }
};

// Gravitation between the first two particles.
struct Gravitation : Force {
    double energy(const VectorXd& x, const VectorXd&, const VectorXd& m) const override {
        return -1.3 * m[0] * m[2] / (x.segment<2>(2) - x.segment<2>(0)).norm();
    }
    VectorXd gradient(const VectorXd& x, const VectorXd&, const VectorXd& m) const override {
        const Vector2d d = x.segment<2>(2) - x.segment<2>(0), g = 1.3 * m[0] * m[2] * d / std::pow(d.norm(), 3);
        VectorXd sum = VectorXd::Zero(x.size());
        sum.segment<2>(2) = g;
        sum.segment<2>(0) = -g;
        return sum;
    }
    MatrixXd hessian_x(const VectorXd& x, const VectorXd&, const VectorXd& m) const override {
        const Vector2d d = x.segment<2>(2) - x.segment<2>(0), n = d.normalized();
        return Spring::spread(1.3 * m[0] * m[2] / std::pow(d.norm(), 3) * (Matrix2d::Identity() - 3 * n * n.transpose()), x.size());
    }
};

// Drag: as in the starter code, a gradient of no energy.
struct Drag : Force {
    double energy(const VectorXd&, const VectorXd&, const VectorXd&) const override { return 0; }
    VectorXd gradient(const VectorXd&, const VectorXd& v, const VectorXd&) const override { return 0.7 * v; }
    MatrixXd hessian_x(const VectorXd& x, const VectorXd&, const VectorXd&) const override { return MatrixXd::Zero(x.size(), x.size()); }
    MatrixXd hessian_v(const VectorXd& x, const VectorXd&, const VectorXd&) const override {
        return 0.7 * MatrixXd::Identity(x.size(), x.size());
    }
};

struct Gravity : Force {
    double energy(const VectorXd& x, const VectorXd&, const VectorXd& m) const override {
        double sum = 0;
        for (Eigen::Index k = 1; k < x.size(); k += 2) sum += 9.81 * m[k] * x[k];
        return sum;
    }
    VectorXd gradient(const VectorXd& x, const VectorXd&, const VectorXd& m) const override {
        VectorXd sum = VectorXd::Zero(x.size());
        for (Eigen::Index k = 1; k < x.size(); k += 2) sum[k] = 9.81 * m[k];
        return sum;
    }
    MatrixXd hessian_x(const VectorXd& x, const VectorXd&, const VectorXd&) const override { return MatrixXd::Zero(x.size(), x.size()); }
};

// Ten mistakes in a Hessian that is not zero.
static const std::vector<std::pair<const char*, std::function<void(MatrixXd&)>>> mistakes = {
    {"negative", [](MatrixXd& h) { h = -h; }},
    {"factor 2", [](MatrixXd& h) { h *= 2; }},
    {"factor ½", [](MatrixXd& h) { h *= 0.5; }},
    {"missing", [](MatrixXd& h) { h.setZero(); }},
    {"missing", [](MatrixXd& h) { h.block<2, 2>(0, 0).setZero(); }},
    {"negative", [](MatrixXd& h) { h.block<2, 2>(2, 2) *= -1; }},
    {"relative", [](MatrixXd& h) { h(1, 1) *= 1 + 1e-6; }},
    {"exchanged", [](MatrixXd& h) { h.col(0).swap(h.col(3)); }},
    {"should be zero", [](MatrixXd& h) { h(0, 5) += 1e-3; }},
    {"missing", [](MatrixXd& h) { h.row(1).setZero(); }},
};

// Ten in one that is zero: entries that should be zero, and the gradient itself.
static void check_zero(Force& force, const VectorXd& x, const VectorXd& v, const VectorXd& m) {
    for (int k = 0; k < 10; ++k) {
        force.edit = [k](const VectorXd&, MatrixXd& h) { h(k % 6, (3 * k + 1) % 6) += 1e-6 * (k + 1); };
        const auto report = spring_oracle::check_force(force, x, v, m);
        EXPECT(report.by_position.wrong());
    }
    force.edit = nullptr;
}

int main() {
    VectorXd x(6), v(6), m(6);
    x << 0.1, 0.2, 1.4, -0.5, -0.8, 1.1;
    v << 0.3, -0.2, -0.6, 0.9, 0.1, 0.4;
    m << 1.2, 1.2, 0.7, 0.7, 2.1, 2.1;
    Spring spring, damped;
    damped.b = 1.1;
    Gravitation gravitation;
    Drag drag;
    Gravity gravity;
    struct Case { const char* name; Force& force; bool by_velocity, has_energy; };
    for (const Case& c : {Case{"spring", spring, false, true}, {"damped spring", damped, false, false}, {"damping", damped, true, false},
                          {"gravitation", gravitation, false, true}, {"drag", drag, true, false}}) {
        c.force.by_velocity = c.by_velocity;
        const auto right = spring_oracle::check_force(c.force, x, v, m, c.has_energy);
        if (!right.correct()) std::cerr << c.name << '\n' << right << '\n';
        EXPECT(right.correct());
        for (const auto& [name, spoil] : mistakes) {
            c.force.edit = [&spoil = spoil](const VectorXd&, MatrixXd& h) { spoil(h); };
            const auto report = spring_oracle::check_force(c.force, x, v, m, c.has_energy);
            const auto& wrong = c.by_velocity ? report.by_velocity : report.by_position;
            const bool named = std::string(wrong.likeness).find(name) != std::string::npos
                               || std::string(name) == "factor 2" || std::string(name) == "factor ½";
            if (!wrong.wrong() || !named) std::cerr << c.name << ", " << name << ": " << wrong << '\n';
            EXPECT(wrong.wrong());
            EXPECT(named);
        }
        c.force.edit = nullptr;
    }
    EXPECT(spring_oracle::check_force(gravity, x, v, m).correct());
    check_zero(gravity, x, v, m);
    // A force in place of a gradient.
    spring.edit_gradient = [](VectorXd& g) { g = -g; };
    EXPECT(std::string(spring_oracle::check_force(spring, x, v, m).energy.likeness).find("negative") != std::string::npos);

    // A sparse Jacobian, and one of fixed size.
    auto squares = [](const VectorXd& at) { return VectorXd(at.array().square()); };
    auto sparse = [](const VectorXd& at) {
        Eigen::SparseMatrix<double> j(at.size(), at.size());
        for (Eigen::Index k = 0; k < at.size(); ++k) j.insert(k, k) = 2 * at[k];
        return j;
    };
    EXPECT(spring_oracle::check_jacobian(squares, sparse, x).correct());
    auto fixed = [](const VectorXd& at) { return Matrix2d(Vector2d(2 * at[0], 2 * at[1]).asDiagonal()); };
    EXPECT(spring_oracle::check_jacobian(squares, fixed, x.head(2)).correct());

    // Function files.
    using Vector6d = Eigen::Matrix<double, 6, 1>;
    using Matrix66d = Eigen::Matrix<double, 6, 6>;
    auto dV = [](Eigen::Ref<Vector6d> g, Eigen::Ref<const Eigen::Vector3d> q0, Eigen::Ref<const Eigen::Vector3d> q1, double l0, double k) {
        const Eigen::Vector3d d = q1 - q0;
        g << -k * (d.norm() - l0) * d.normalized(), k * (d.norm() - l0) * d.normalized();
    };
    double sign = 1;
    auto d2V = [&](Eigen::Ref<Matrix66d> h, Eigen::Ref<const Eigen::Vector3d> q0, Eigen::Ref<const Eigen::Vector3d> q1, double l0, double k) {
        const Eigen::Vector3d d = q1 - q0, n = d.normalized();
        const Eigen::Matrix3d nn = n * n.transpose();
        const Eigen::Matrix3d b = sign * k * (nn + (d.norm() - l0) / d.norm() * (Eigen::Matrix3d::Identity() - nn));
        h << b, -b, -b, b;
    };
    const Eigen::Vector3d q0(0.1, 0.4, -0.3), q1(1.2, -0.2, 0.6);
    EXPECT(spring_oracle::check_hessian_file(dV, d2V, q0, q1, 0.9, 12.0).correct());
    sign = -1;
    const auto negated = spring_oracle::check_hessian_file(dV, d2V, q0, q1, 0.9, 12.0);
    EXPECT(std::string(negated.likeness).find("exactly the negative") != std::string::npos);
    std::cout << negated << '\n';

    // An exception of a callback comes through.
    bool caught = false;
    try {
        spring_oracle::check_jacobian(squares, [](const VectorXd&) -> MatrixXd { throw std::domain_error("mine"); }, x);
    } catch (const std::domain_error& error) {
        caught = std::string(error.what()) == "mine";
    }
    EXPECT(caught);
    return failures > 0;
}
