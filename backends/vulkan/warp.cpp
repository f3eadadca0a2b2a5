// Stage warp in one shader. docs/stages/warp.md.
#include "backends/stages/warp.hpp"

#include "backends/vulkan/stages.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

constexpr uint32_t kGroup = 64;

struct WarpPush {
    WarpConstants constants;
    DisparityGrid image;
};

class Warp final : public Stage {
  public:
    Warp(const defrec_warp_params& params, Device& device)
        : p_(params), device_(device), warp_(device.kernel(shaders::warp)) {}

    void prepare(std::span<const InBuffer> in) override {
        const defrec_surface_point* points = read_template(p_, in).points;
        points_ = device_.upload(points, p_.points * sizeof *points);
    }

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        if (!points_) throw StageError(DEFREC_ERROR_STATE, "warp: run before prepare");
        const auto given =
            view_buffers<WarpBuffers>(p_, sizes_of_inputs(in), sizes_of_outputs(out));
        const bool has_disparity = given.disparity != nullptr;
        const WarpPush push{constants_of(p_), disparity_grid(p_, has_disparity)};
        recorder.dispatch(warp_, {points_, in[0], has_disparity ? in[1] : nullptr, out[0]}, push,
                          {cover(p_.points, kGroup)});
    }

  private:
    defrec_warp_params p_;
    Device& device_;
    std::shared_ptr<const Kernel> warp_;
    Buffer points_;
};

}  // namespace

std::unique_ptr<Stage> make_warp(const defrec_warp_params& params, Device& device) {
    check_params(params);
    check_size("warp", "points", params.points,
               uint64_t{device.limits().maxComputeWorkGroupCount[0]} * kGroup);
    return std::make_unique<Warp>(params, device);
}

}  // namespace defrec::vulkan
