// Stage lm: the control points' motions that fit a frame best (docs/stages/lm.md).
#include "backends/definition/lm_stage.hpp"
#include "backends/reference/lm_problem.hpp"
#include "backends/reference/stages.hpp"

namespace defrec::reference {

std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, const Host& host) {
    check_params(params);
    return std::make_unique<LmStage<LmProblem>>(params, host);
}

}  // namespace defrec::reference
