// Every stage fast on a CPU: Highway with run-time dispatch, the host's threads, no allocation per
// frame. One maker per stage; parameters arrive checked and complete. docs/stages.md defines what
// each computes.
#pragma once
#include <memory>

#include "backends/shared/stage.hpp"

namespace defrec::cpu {

std::unique_ptr<Stage> make_rectify(const defrec_rectify_params& params, const Host& host);
std::unique_ptr<Stage> make_stereo(const defrec_stereo_params& params, const Host& host);
std::unique_ptr<Stage> make_orb(const defrec_orb_params& params, const Host& host);
std::unique_ptr<Stage> make_match(const defrec_match_params& params, const Host& host);
std::unique_ptr<Stage> make_align(const defrec_align_params& params, const Host& host);
std::unique_ptr<Stage> make_ransac(const defrec_ransac_params& params, const Host& host);
std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, const Host& host);
std::unique_ptr<Stage> make_warp(const defrec_warp_params& params, const Host& host);

}  // namespace defrec::cpu
