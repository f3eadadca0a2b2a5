// Stage lm: lm_problem evaluates and solves, backends/definition/lm_stage.hpp does the rest.
#include "backends/cpu/disparity_bytes.hpp"
#include "backends/cpu/lm_problem.hpp"
#include "backends/cpu/stages.hpp"
#include "backends/definition/lm_stage.hpp"

namespace defrec::cpu {

std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, const Host& host) {
    check_params(params);
    check_disparity_bytes("lm", params);
    return std::make_unique<LmStage<LmProblem>>(params, host);
}

}  // namespace defrec::cpu
