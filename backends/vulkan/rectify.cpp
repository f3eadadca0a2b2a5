// Stage rectify in shaders: sampling, then the mask grown along rows and along columns.
// docs/stages/rectify.md.
#include "backends/stages/rectify.hpp"

#include "backends/vulkan/shaders/rectify_push.h"
#include "backends/vulkan/stages.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

struct Push {
    RectifyConstants constants;
    RectifyGiven given;
};

class Rectify final : public Stage {
  public:
    Rectify(const defrec_rectify_params& params, Device& device)
        : p_(params),
          sample_(device.kernel(shaders::rectify_sample, {params.format})),
          rows_(device.kernel(shaders::rectify_rows)),
          mask_(device.kernel(shaders::rectify_mask)),
          state_(device, uint64_t{params.width} * params.height),
          near_(device, state_.size()) {}

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        const RectifyBuffers given =
            rectify_buffers(p_, sizes_of_inputs(in), sizes_of_outputs(out));
        const auto optional = [&](size_t i) { return i < in.size() ? in[i] : nullptr; };
        const Push push{constants_of(p_), {given.map != nullptr, given.ignore != nullptr}};
        const Groups groups{cover(p_.width, 32), cover(p_.height, 8)};
        recorder.dispatch(sample_, {in[0], optional(1), optional(2), out[0], state_}, push, groups);
        recorder.dispatch(rows_, {state_, near_}, push, groups);
        recorder.dispatch(mask_, {near_, out[1]}, push, groups);
    }

  private:
    defrec_rectify_params p_;
    std::shared_ptr<const Kernel> sample_, rows_, mask_;
    Buffer state_, near_;
};

}  // namespace

std::unique_ptr<Stage> make_rectify(const defrec_rectify_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Rectify>(params, device);
}

}  // namespace defrec::vulkan
