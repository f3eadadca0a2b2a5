// Parameters of a stage as a device gets them: copied in, every default filled in, checked.
#pragma once
#include <cstdint>
#include <variant>

#include "include/defrec_c.h"

namespace defrec {

class StageParams {
  public:
    // given: the stage's defrec_*_params of any version. Throws Error with the field's name.
    StageParams(uint32_t stage, const void* given);

    uint32_t stage() const { return stage_; }
    const void* get() const;  // the stage's defrec_*_params

    // Bytes that buffer `index` must have at least; 0 where the stage itself classifies it. 64-bit.
    uint64_t input_bytes(size_t index) const;
    uint64_t output_bytes(size_t index) const;

    using Any = std::variant<defrec_rectify_params, defrec_stereo_params, defrec_orb_params,
                             defrec_match_params, defrec_align_params, defrec_ransac_params,
                             defrec_lm_params, defrec_warp_params>;

  private:
    uint32_t stage_;
    Any params_;
};

}  // namespace defrec
