// One more feature is written than counted, where the capacity has room.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_orb_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        Right::run(in, out);
        const uint32_t count = *out[0].as<uint32_t>();
        auto* features = out[1].as<defrec_feature>();
        if (count > 0 && count < params().capacity) features[count] = features[count - 1];
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
