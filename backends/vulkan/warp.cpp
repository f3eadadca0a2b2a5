// Stage warp in one shader. docs/stages/warp.md.
#include "backends/shared/surface_checks.hpp"
#include "backends/vulkan/camera.hpp"
#include "backends/vulkan/stages.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

constexpr uint32_t kGroup = 64;

struct Push {
    Camera camera;
    DisparityImage image;
    float tolerance_mm;
    int32_t points;
};

class Warp final : public Stage {
  public:
    Warp(const defrec_warp_params& params, Device& device)
        : p_(params), device_(device), warp_(device.kernel(shaders::warp)) {}

    void prepare(std::span<const InBuffer> in) override {
        expect_buffers("warp prepare", in, 1);
        const auto* points = take<defrec_surface_point>("warp points", in[0], p_.points);
        check_skinned("warp: point", points, p_.points, p_.nodes);
        points_ = device_.upload(points, p_.points * sizeof *points);
    }

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        if (!points_) throw StageError(DEFREC_ERROR_STATE, "warp: run before prepare");
        const std::vector<InBuffer> ins = sizes_of_inputs(in);
        const std::vector<OutBuffer> outs = sizes_of_outputs(out);
        expect_buffers("warp in", std::span(ins), 1, 1);
        expect_buffers("warp out", std::span(outs), 1);
        take<defrec_motion>("warp motions", ins[0], p_.nodes);
        take<defrec_surface_sample>("warp samples", outs[0], p_.points);
        const bool has_disparity = take_disparity("warp disparity", p_, ins, 1).data != nullptr;
        const Push push{Camera(p_.camera), DisparityImage(p_, has_disparity), p_.tolerance_mm,
                        int32_t(p_.points)};
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
    check_size("warp", "points", params.points,
               uint64_t{device.limits().maxComputeWorkGroupCount[0]} * kGroup);
    return std::make_unique<Warp>(params, device);
}

}  // namespace defrec::vulkan
