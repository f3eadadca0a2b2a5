// Rows of the disparity image are written to the end of their stride.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_stereo_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        Right::run(in, out);
        for (size_t y = 0; y + 1 < params().height; ++y)
            for (size_t x = params().width; x < params().stride; ++x)
                out[0].as<int16_t>()[y * params().stride + x] = DEFREC_DISPARITY_NONE;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
