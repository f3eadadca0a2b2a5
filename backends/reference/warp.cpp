// Stage warp: the template's points moved to the present frame, and what the frame says of each
// (docs/stages/warp.md).
#include <cmath>

#include "backends/reference/stages.hpp"
#include "backends/shared/live_depth.hpp"
#include "backends/shared/surface_checks.hpp"

namespace defrec::reference {
namespace {

class Warp : public Stage {
  public:
    Warp(const defrec_warp_params& params, const Host& host)
        : params_(params),
          points_(params.points, HostAllocator<defrec_surface_point>(host)),
          motions_(params.nodes, HostAllocator<DualQuaternion<double>>(host)) {}

    void prepare(std::span<const InBuffer> in) override {
        expect_buffers("warp prepare", in, 1);
        const auto* points = take<defrec_surface_point>("warp points", in[0], params_.points);
        check_skinned("warp: point", points, params_.points, params_.nodes);
        points_.assign(points, points + params_.points);
        prepared_ = true;
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!prepared_) throw StageError(DEFREC_ERROR_STATE, "warp: run before prepare");
        expect_buffers("warp in", in, 1, 1);
        expect_buffers("warp out", out, 1);
        const auto* motions = take<defrec_motion>("warp motions", in[0], params_.nodes);
        const DisparityImage image = take_disparity("warp disparity", params_, in, 1);
        auto* samples = take<defrec_surface_sample>("warp samples", out[0], params_.points);
        for (size_t i = 0; i < params_.nodes; ++i) motions_[i] = usable_motion<double>(motions[i]);
        for (size_t i = 0; i < params_.points; ++i) samples[i] = sample(points_[i], image);
    }

  private:
    defrec_surface_sample sample(const defrec_surface_point& point,
                                 const DisparityImage& image) const {
        const auto motion = blend<double>(motions_.data(), point.node, point.weight);
        const Vec3<double> position = apply(motion, load3<double>(point.position));
        const Vec3<double> normal = rotate(motion, load3<double>(point.normal));
        defrec_surface_sample result{};
        store3(position, result.position);
        store3(normal, result.normal);
        result.observation = observe(position, normal, image, result.residual);
        return result;
    }

    uint32_t observe(Vec3<double> position, Vec3<double> normal, const DisparityImage& image,
                     float& residual) const {
        Pixel<double> pixel;
        if (!project_inside(params_.camera, image, position, pixel)) return DEFREC_OUTSIDE;
        const double depth = live_depth(params_.camera, image, pixel);
        if (depth == 0) return DEFREC_NO_DEPTH;
        const double difference = depth - position.z;
        residual = float(difference);
        if (!(dot(normal, position) < 0)) return DEFREC_INCONSISTENT;
        if (std::abs(difference) <= params_.tolerance_mm) return DEFREC_OBSERVED;
        return difference < 0 ? DEFREC_OCCLUDED : DEFREC_INCONSISTENT;
    }

    defrec_warp_params params_;
    HostVector<defrec_surface_point> points_;
    HostVector<DualQuaternion<double>> motions_;
    bool prepared_ = false;
};

}  // namespace

std::unique_ptr<Stage> make_warp(const defrec_warp_params& params, const Host& host) {
    return std::make_unique<Warp>(params, host);
}

}  // namespace defrec::reference
