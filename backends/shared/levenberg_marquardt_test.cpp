// When the minimiser of lm gives up: backends/agreement tries what single precision does not hold,
// double precision fails by problems of its own here.
#include "backends/shared/levenberg_marquardt.hpp"

#include <doctest/doctest.h>

#include <array>
#include <limits>

#include "backends/shared/test_host.hpp"

using namespace defrec;

namespace {

// A cost of one match that no step is found for.
struct Unsolvable {
    double cost;
    LmSums sums() const {
        LmSums sums;
        sums.match.cost = cost;
        sums.match.count = 1;
        return sums;
    }
    LmSums begin(std::span<NodePose<double>>) { return sums(); }
    LmSums evaluate(std::span<NodePose<double>>, bool) { return sums(); }
    void accept() {}
    bool solve(double, double*) { return false; }
};

defrec_lm_summary minimise(double cost, std::span<NodePose<double>> nodes) {
    const test::TestHost host;
    defrec_lm_params params{};
    params.iterations = 3;
    params.damping = 1e-3f;
    params.node_spacing_mm = 5;
    Unsolvable problem{cost};
    std::array<NodePose<double>, 1> trial{};
    std::array<double, 6> step{};
    return levenberg_marquardt(problem, params, host.host(), nodes, std::span(trial),
                               std::span(step));
}

}  // namespace

TEST_CASE("a cost that is not finite has failed before the first step") {
    std::array<NodePose<double>, 1> nodes{{{{1, 0, 0, 0}, {1, 2, 3}}}};
    for (const double cost :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        const defrec_lm_summary summary = minimise(cost, nodes);
        CHECK(summary.failed == 1);
        CHECK(summary.iterations == 0);
    }
    CHECK(nodes[0].position.z == 3);
}

TEST_CASE("systems without a finite solution have failed, and nothing has moved") {
    std::array<NodePose<double>, 1> nodes{{{{1, 0, 0, 0}, {1, 2, 3}}}};
    const defrec_lm_summary summary = minimise(7, nodes);
    CHECK(summary.failed == 1);
    CHECK(summary.iterations == 3);
    CHECK(summary.final_cost == 7);
    CHECK(nodes[0].position.z == 3);
}
