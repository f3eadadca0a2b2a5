// Stage warp: buffers, motions, and the groups shared out to threads; warp_groups.cpp computes.
#include "backends/cpu/stages.hpp"
#include "backends/cpu/warp_groups.hpp"
#include "backends/shared/surface_checks.hpp"

namespace defrec::cpu {
namespace {

constexpr size_t kTasks = 8;

class Warp : public Stage {
  public:
    Warp(const defrec_warp_params& params, const Host& host)
        : params_(params),
          host_(host),
          points_(host),
          motions_(params.nodes, HostAllocator<NodeMotion>(host)) {}

    void prepare(std::span<const InBuffer> in) override {
        expect_buffers("warp prepare", in, 1);
        const auto* points = take<defrec_surface_point>("warp points", in[0], params_.points);
        check_skinned("warp: point", points, params_.points, params_.nodes);
        points_.build(points, params_.points);
        prepared_ = true;
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!prepared_) throw StageError(DEFREC_ERROR_STATE, "warp: run before prepare");
        expect_buffers("warp in", in, 1, 1);
        expect_buffers("warp out", out, 1);
        const auto* motions = take<defrec_motion>("warp motions", in[0], params_.nodes);
        const DisparityImage image = take_disparity("warp disparity", params_, in, 1);
        auto* samples = take<defrec_surface_sample>("warp samples", out[0], params_.points);

        for (size_t i = 0; i < params_.nodes; ++i)
            motions_[i].set(usable_motion<double>(motions[i]), {});
        const WarpTask task{&points_, motions_.data(),      params_.camera,
                            image,    params_.tolerance_mm, samples};
        const size_t groups = points_.groups.size();
        host_.parallel_for(kTasks, [&](size_t i) {
            warp_groups(task, groups * i / kTasks, groups * (i + 1) / kTasks);
        });
    }

  private:
    defrec_warp_params params_;
    Host host_;
    WarpPoints points_;
    HostVector<NodeMotion> motions_;
    bool prepared_ = false;
};

}  // namespace

std::unique_ptr<Stage> make_warp(const defrec_warp_params& params, const Host& host) {
    return std::make_unique<Warp>(params, host);
}

}  // namespace defrec::cpu
