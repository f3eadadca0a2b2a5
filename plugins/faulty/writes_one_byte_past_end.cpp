// Rectify writes a byte behind its mask, whether the buffer has room or not.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_rectify_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        Right::run(in, out);
        out[1].as<uint8_t>()[size_t(params().stride) * (params().height - 1) + params().width] ^=
            0xFF;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
