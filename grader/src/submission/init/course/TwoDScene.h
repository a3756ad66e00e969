#pragma once
// The state of a scene, and the sums of its forces.

#include <memory>

#include "Force.h"

class TwoDScene {
public:
    int getNumParticles() const { return static_cast<int>(m_fixed.size()); }
    VectorXs& getX() { return m_x; }
    VectorXs& getV() { return m_v; }
    const VectorXs& getM() const { return m_m; }
    // A fixed particle feels no force: it keeps its velocity, and moves by it.
    bool isFixed(int particle) const { return m_fixed[particle]; }

    // Adds the gradient of all energies at the positions x + dx and the velocities v + dv; empty: at x and v.
    void accumulateGradU(VectorXs& F, const VectorXs& dx = {}, const VectorXs& dv = {}) const {
        for (const auto& force : m_forces) force->addGradEToTotal(sum(m_x, dx), sum(m_v, dv), m_m, F);
    }

    // Add its derivatives by positions and by velocities.
    void accumulateddUdxdx(MatrixXs& A, const VectorXs& dx = {}, const VectorXs& dv = {}) const {
        for (const auto& force : m_forces) force->addHessXToTotal(sum(m_x, dx), sum(m_v, dv), m_m, A);
    }
    void accumulateddUdxdv(MatrixXs& A, const VectorXs& dx = {}, const VectorXs& dv = {}) const {
        for (const auto& force : m_forces) force->addHessVToTotal(sum(m_x, dx), sum(m_v, dv), m_m, A);
    }

    void insertParticle(scalar m, scalar px, scalar py, scalar vx, scalar vy, bool fixed) {
        m_m.insert(m_m.end(), {m, m});
        m_x.insert(m_x.end(), {px, py});
        m_v.insert(m_v.end(), {vx, vy});
        m_fixed.push_back(fixed);
    }
    void insertForce(std::unique_ptr<Force> force) { m_forces.push_back(std::move(force)); }

private:
    static VectorXs sum(VectorXs a, const VectorXs& b) {
        for (std::size_t k = 0; k < b.size(); ++k) a[k] += b[k];
        return a;
    }

    VectorXs m_x, m_v, m_m;
    std::vector<bool> m_fixed;
    std::vector<std::unique_ptr<Force>> m_forces;
};
