// See stage_params.hpp.
#include "sdk/device/stage_params.hpp"

#include "backends/stages/all.hpp"
#include "sdk/base/util/check_ranges.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/base/util/struct_size.hpp"
#include "sdk/device/device.hpp"

namespace defrec {
namespace {

template <class Params>
StageParams::Any read(const void* given) {
    Params params = read_struct<Params>("params", given);
    fill_defaults(params);
    check_ranges(params);
    return params;
}

StageParams::Any read_any(uint32_t stage, const void* given) {
    switch (stage) {
#define DEFREC_CASE(name, NAME) \
    case DEFREC_STAGE_##NAME:   \
        return read<defrec_##name##_params>(given);
        DEFREC_STAGES(DEFREC_CASE, DEFREC_NOTHING)
#undef DEFREC_CASE
        default:
            fail(DEFREC_ERROR_ARGUMENT, "unknown stage ", stage, ", 0 to ",
                 DEFREC_STAGE_COUNT_V1 - 1, " expected");
    }
}

}  // namespace

StageParams::StageParams(uint32_t stage, const void* given)
    : stage_(stage),
      params_(read_any(stage, given)),
      buffers_(std::visit([](const auto& params) { return buffer_table(params); }, params_)) {}

const void* StageParams::get() const {
    return std::visit([](const auto& params) -> const void* { return &params; }, params_);
}
uint64_t StageParams::input_bytes(size_t index) const { return buffers_.inputs.bytes(index); }
uint64_t StageParams::output_bytes(size_t index) const { return buffers_.outputs.bytes(index); }

}  // namespace defrec
