// The last bit of the last feature's descriptor is turned round.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_orb_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        Right::run(in, out);
        const uint32_t count = *out[0].as<uint32_t>();
        if (count > 0) out[1].as<defrec_feature>()[count - 1].descriptor[7] ^= 1u << 31;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
