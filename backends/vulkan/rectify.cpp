// Stage rectify in shaders: sampling, then the mask grown round highlights.
// docs/stages/rectify.md.
#include "backends/stages/rectify.hpp"

#include "backends/vulkan/shaders/rectify_push.h"
#include "backends/vulkan/stages.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

struct RectifyPush {
    RectifyConstants constants;
    RectifyGiven given;
};

class Rectify final : public Stage {
  public:
    Rectify(const defrec_rectify_params& params, Device& device)
        : p_(params),
          sample_(device.kernel(shaders::rectify_sample, {params.format})),
          mask_rows_(device.wide() ? 2 : 4),
          mask_(device.kernel(shaders::rectify_mask, {mask_rows_, params.highlight_radius})) {}

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        const RectifyBuffers given =
            rectify_buffers(p_, sizes_of_inputs(in), sizes_of_outputs(out));
        const auto optional = [&](size_t i) { return i < in.size() ? in[i] : nullptr; };
        const RectifyPush push{constants_of(p_), {given.map != nullptr, given.ignore != nullptr}};
        const uint32_t words = cover(p_.width, 4);
        // A word has the state of four pixels. Each set of buffers has its own, so that two views
        // are rectified beside each other.
        const Buffer& state = recorder.scratch(4 * uint64_t{words} * p_.height);
        recorder.dispatch(sample_, {in[0], optional(1), optional(2), out[0], state}, push,
                          {cover(words, 32), cover(p_.height, 4)});
        recorder.dispatch(mask_, {state, out[1]}, push,
                          {cover(words, 32), cover(p_.height, 4 * mask_rows_)});
    }

  private:
    defrec_rectify_params p_;
    std::shared_ptr<const Kernel> sample_;
    uint32_t mask_rows_;  // of an invocation
    std::shared_ptr<const Kernel> mask_;
};

}  // namespace

std::unique_ptr<Stage> make_rectify(const defrec_rectify_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Rectify>(params, device);
}

}  // namespace defrec::vulkan
