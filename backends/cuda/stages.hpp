// Every stage as CUDA kernels. One maker per stage; parameters arrive checked and complete.
// docs/stages.md defines what each computes. A maker throws StageError(DEFREC_ERROR_UNSUPPORTED)
// where the device is too small.
#pragma once
#include <memory>

#include "backends/cuda/stage.hpp"

namespace defrec::cuda {

std::unique_ptr<Stage> make_rectify(const defrec_rectify_params& params, Device& device);
std::unique_ptr<Stage> make_stereo(const defrec_stereo_params& params, Device& device);
std::unique_ptr<Stage> make_orb(const defrec_orb_params& params, Device& device);
std::unique_ptr<Stage> make_match(const defrec_match_params& params, Device& device);
std::unique_ptr<Stage> make_align(const defrec_align_params& params, Device& device);
std::unique_ptr<Stage> make_ransac(const defrec_ransac_params& params, Device& device);
std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, Device& device);
std::unique_ptr<Stage> make_warp(const defrec_warp_params& params, Device& device);

}  // namespace defrec::cuda
