// Stage warp: the template's points moved to the present frame, and what the frame says of each
// (docs/stages/warp.md).
#include "backends/stages/warp.hpp"

#include <cmath>

#include "backends/reference/stages.hpp"
#include "backends/shared/live_depth.hpp"

namespace defrec::reference {
namespace {

class Warp : public Stage {
  public:
    Warp(const defrec_warp_params& params, const Host& host)
        : params_(params),
          points_(params.points, HostAllocator<defrec_surface_point>(host)),
          motions_(params.nodes, HostAllocator<DualQuaternion<double>>(host)) {}

    void prepare(std::span<const InBuffer> in) override {
        const defrec_surface_point* points = read_template(params_, in).points;
        points_.assign(points, points + params_.points);
        prepared_ = true;
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!prepared_) throw StageError(DEFREC_ERROR_STATE, "warp: run before prepare");
        const auto b = view_buffers<WarpBuffers>(params_, in, out);
        const DisparityImage image = disparity_image(params_, b.disparity);
        for (size_t i = 0; i < params_.nodes; ++i)
            motions_[i] = usable_motion<double>(b.motions[i]);
        for (size_t i = 0; i < params_.points; ++i) b.samples[i] = sample(points_[i], image);
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
    check_params(params);
    return std::make_unique<Warp>(params, host);
}

}  // namespace defrec::reference
