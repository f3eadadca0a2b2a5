// The last disparity of each image is 1/16 px too large.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_stereo_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        Right::run(in, out);
        for (size_t y = params().height; y-- > 0;)
            for (size_t x = params().width; x-- > 0;) {
                int16_t& disparity = out[0].as<int16_t>()[y * params().stride + x];
                if (disparity == DEFREC_DISPARITY_NONE) continue;
                ++disparity;
                return;
            }
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
