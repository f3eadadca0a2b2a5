// Stage warp: buffers, motions, and the groups shared out to threads; warp_groups.cpp computes.
#include "backends/stages/warp.hpp"

#include "backends/cpu/disparity_bytes.hpp"
#include "backends/cpu/stages.hpp"
#include "backends/cpu/warp_groups.hpp"

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
        const defrec_surface_point* points = read_template(params_, in).points;
        points_.build(points, params_.points);
        prepared_ = true;
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!prepared_) throw StageError(DEFREC_ERROR_STATE, "warp: run before prepare");
        const auto b = view_buffers<WarpBuffers>(params_, in, out);
        const DisparityImage image = disparity_image(params_, b.disparity);

        for (size_t i = 0; i < params_.nodes; ++i)
            motions_[i].set(usable_motion<double>(b.motions[i]), {});
        const WarpTask task{&points_, motions_.data(),      params_.camera,
                            image,    params_.tolerance_mm, b.samples};
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
    check_params(params);
    check_disparity_bytes("warp", params);
    return std::make_unique<Warp>(params, host);
}

}  // namespace defrec::cpu
