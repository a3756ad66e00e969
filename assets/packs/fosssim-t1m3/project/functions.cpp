// functions CALLS ANSWERS: calls a function of a force, one in each line. A line of calls: the force and what is asked of it, the dimension,
// masses, positions and velocities of the particles, parameters. A line of answers: a matrix, row by row.

#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "DragDampingForce.h"
#include "GravitationalForce.h"
#include "SimpleGravityForce.h"
#include "SpringForce.h"

int main(int, char** argv) {
    std::ifstream calls(argv[1]);
    std::FILE* answers = std::fopen(argv[2], "w");
    for (std::string line, name; std::getline(calls, line);) {
        std::istringstream words(line);
        words >> name;
        std::vector<double> all;
        for (double value; words >> value;) all.push_back(value);
        const std::string force = name.substr(0, name.find('-'));
        const int particles = force == "spring" || force == "gravitation" ? 2 : 1, size = 2 * particles;
        VectorXs x(size), v(size), m(size);
        for (int i = 0; i < size; ++i) {
            m[i] = all[1 + i / 2];
            x[i] = all[1 + particles + i];
            v[i] = all[1 + particles + size + i];
        }
        const double* parameter = &all[1 + particles + 2 * size];
        const std::pair<int, int> ends(0, 1);
        std::unique_ptr<Force> of;
        if (force == "spring") of.reset(new SpringForce(ends, parameter[0], parameter[1], parameter[2]));
        if (force == "gravitation") of.reset(new GravitationalForce(ends, parameter[0]));
        if (force == "gravity") of.reset(new SimpleGravityForce(Vector2s(parameter[0], parameter[1])));
        if (force == "drag") of.reset(new DragDampingForce(parameter[0]));
        MatrixXs sum = MatrixXs::Zero(size, size);
        if (name.find("-hessian-x") != std::string::npos)
            of->addHessXToTotal(x, v, m, sum);
        else
            of->addHessVToTotal(x, v, m, sum);
        for (int i = 0; i < size * size; ++i) std::fprintf(answers, "%.17g ", sum(i / size, i % size));
        std::fprintf(answers, "\n");
    }
    std::fclose(answers);
}
