// One instance of CRISP's cart transport, pushed box or pushed T, from its example file, with the settings of that file.
//
//     crisp_transport MOTION start (4 numbers: x1 x2 v1 v2, m and m/s) goal (4 numbers)
//     crisp_push_box MOTION goal (3 numbers: x y angle, m and rad)
//     crisp_push_t MOTION
//
// How it is built: compare_peers.py. MOTION is written: all variables, step by step.

#define main example
#ifdef TRANSPORT
#include "examples/Transp/cpp/SolveTransp.cpp"
#elif defined(PUSH_BOX)
#include "examples/pushbox/SolvePushbox.cpp"
#else
#include "examples/pushT/SolvePushT.cpp"
#endif
#undef main

#include <cstdlib>
#include <fstream>
#include <iomanip>

static vector_t numbers(char **words, size_t count, size_t size) {
    vector_t found = vector_t::Zero(size);
    for (size_t k = 0; k < count; ++k)
        found[k] = std::atof(words[k]);
    return found;
}

int main(int count, char **words) {
#ifdef TRANSPORT
    const size_t expected = 10;
    const std::string name = "CartTransp", start = "cartTranspInitialConstraints", goal = "cartTranspObjective";
#elif defined(PUSH_BOX)
    const size_t expected = 5;
    const std::string name = "Pushbox", start = "pushboxInitialConstraints", goal = "pushboxObjective";
#else
    const size_t expected = 2;
    const std::string name = "PushT", start = "pushTInitialConstraints", goal = "pushTObjective";
#endif
    if (static_cast<size_t>(count) != expected) {
        std::cerr << words[0] << ": found " << count - 1 << " arguments, expected " << expected - 1 << std::endl;
        return 1;
    }
    const size_t variables = N * (num_state + num_control);
    const std::string folder = "model";
#ifdef PUSH_T
    const size_t given = 4;
#else
    const size_t given = num_state;
#endif
    OptimizationProblem problem(variables, name);
    const auto equality = [&](const std::string &of, auto function) {
        problem.addEqualityConstraint(std::make_shared<ConstraintFunction>(variables, name, folder, of, function));
    };
    const auto inequality = [&](const std::string &of, auto function) {
        problem.addInequalityConstraint(std::make_shared<ConstraintFunction>(variables, name, folder, of, function));
    };
    const auto initial = [&](auto function) {
        problem.addEqualityConstraint(
            std::make_shared<ConstraintFunction>(variables, given, name, folder, start, function));
    };
    const auto objective = [&](auto function) {
        problem.addObjective(std::make_shared<ObjectiveFunction>(variables, given, name, folder, goal, function));
    };
    SolverParameters parameters;
#ifdef TRANSPORT
    objective(cartTranspObjective);
    equality("cartTranspDynamicConstraints", cartTranspDynamicConstraints);
    initial(cartTranspInitialConstraints);
    inequality("cartTranspContactConstraints", cartTranspContactConstraints);
    SolverInterface solver(problem, parameters);
    solver.setProblemParameters(start, numbers(words + 2, 4, num_state));
    solver.setProblemParameters(goal, numbers(words + 6, 4, num_state));
#elif defined(PUSH_BOX)
    objective(pushboxObjective);
    equality("pushboxDynamicConstraints", pushboxDynamicConstraints);
    initial(pushboxInitialConstraints);
    inequality("pushboxContactConstraints", pushboxContactConstraints);
    inequality("pushboxContactSingleForceConstraints", pushboxContactSingleForceConstraints);
    SolverInterface solver(problem, parameters);
    for (const std::string tolerance : {"trailTol", "trustRegionTol"})
        solver.setHyperParameters(tolerance, vector_t::Constant(1, 1e-3));
    solver.setHyperParameters("WeightedMode", vector_t::Constant(1, 1));
    solver.setProblemParameters(start, vector_t::Zero(num_state));
    solver.setProblemParameters(goal, numbers(words + 2, 3, num_state));
#else
    objective(pushTObjective);
    equality("pushTDynamicConstraints", pushTDynamicConstraints);
    initial(pushTInitialConstraints);
    inequality("pushTContactConstraints", pushTContactConstraints);
    inequality("pushTContactSingleForceConstraints", pushTContactSingleForceConstraints);
    SolverInterface solver(problem, parameters);
    for (const std::string tolerance : {"trailTol", "trustRegionTol", "constraintTol"})
        solver.setHyperParameters(tolerance, vector_t::Constant(1, 1e-3));
    solver.setHyperParameters("WeightedMode", vector_t::Constant(1, 1));
    vector_t from(given), to(given);
    from << 0.24722, 0.0141359, std::cos(-2.95844), std::sin(-2.95844);
    to << 0.036, -0.143, std::cos(-2.637), std::sin(-2.637);
    solver.setProblemParameters(start, from);
    solver.setProblemParameters(goal, to);
#endif
    solver.initialize(vector_t::Zero(variables));
    solver.solve();
    std::ofstream(words[1]) << std::setprecision(17) << solver.getSolution() << std::endl;
}
