#pragma once
// A method that takes steps.

#include "TwoDScene.h"

class SceneStepper {
public:
    virtual ~SceneStepper() = default;

    // Takes one step of length dt: changes the positions and velocities of the scene.
    virtual bool stepScene(TwoDScene& scene, scalar dt) = 0;
};
