// The residual of points outside of the image is left as it was in memory.
#include <vector>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_warp_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        auto* samples = out[0].as<defrec_surface_sample>();
        const std::vector<defrec_surface_sample> before(samples, samples + params().points);
        Right::run(in, out);
        for (size_t i = 0; i < before.size(); ++i)
            if (samples[i].observation == DEFREC_OUTSIDE) samples[i].residual = before[i].residual;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
