// The live depth is that of the nearest pixel everywhere, and never interpolated.
#include <algorithm>
#include <cmath>

#include "backends/stages/warp.hpp"
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_warp_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        Right::run(in, out);
        const auto buffers = view_buffers<WarpBuffers>(params(), in, out);
        const DisparityImage image = disparity_image(params(), buffers.disparity);
        defrec_surface_sample* samples = buffers.samples;
        for (size_t i = 0; image.data != nullptr && i < params().points; ++i)
            if (samples[i].observation != DEFREC_OUTSIDE) observe(image, samples[i]);
    }

  private:
    void observe(const DisparityImage& image, defrec_surface_sample& sample) const {
        const auto position = load3<double>(sample.position), normal = load3<double>(sample.normal);
        Pixel<double> pixel;
        if (!project_inside(params().camera, image, position, pixel)) return;
        const auto x = size_t(pixel.u + 0.5), y = size_t(pixel.v + 0.5);
        const int16_t disparity = image.data[y * image.stride + x];
        sample.residual = 0;
        sample.observation = DEFREC_NO_DEPTH;
        if (disparity <= 0) return;
        const defrec_camera& camera = params().camera;
        const double difference =
            double(DEFREC_DISPARITY_ONE) * camera.fx * camera.baseline_mm / disparity - position.z;
        sample.residual = float(difference);
        if (!(dot(normal, position) < 0))
            sample.observation = DEFREC_INCONSISTENT;
        else if (std::abs(difference) <= params().tolerance_mm)
            sample.observation = DEFREC_OBSERVED;
        else
            sample.observation = difference < 0 ? DEFREC_OCCLUDED : DEFREC_INCONSISTENT;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
