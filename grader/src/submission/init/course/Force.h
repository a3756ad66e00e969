#pragma once
// A force, by the energy that it derives from, or as if it derived from one.

#include "MathDefs.h"

class Force {
public:
    virtual ~Force() = default;

    // Adds the gradient of the energy, which is minus the force. m has the mass of a particle twice, as x has two
    // coordinates of it.
    virtual void addGradEToTotal(const VectorXs& x, const VectorXs& v, const VectorXs& m, VectorXs& gradE) = 0;

    // Add the derivatives of that gradient by x and by v, which are minus the Jacobians of the force.
    virtual void addHessXToTotal(const VectorXs& x, const VectorXs& v, const VectorXs& m, MatrixXs& hessE) = 0;
    virtual void addHessVToTotal(const VectorXs& x, const VectorXs& v, const VectorXs& m, MatrixXs& hessE) = 0;
};
