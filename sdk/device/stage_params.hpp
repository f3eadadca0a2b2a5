// Parameters of a stage as a device gets them: copied in, every default filled in, checked.
#pragma once
#include <cstdint>
#include <variant>

#include "backends/stages/contract.hpp"
#include "backends/stages/list.hpp"

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

    using Any = std::variant<DEFREC_STAGES(DEFREC_STAGE_PARAMS, DEFREC_COMMA)>;

  private:
    uint32_t stage_;
    Any params_;
    BufferTable buffers_;
};

}  // namespace defrec
