// What patches say does not enter the cost.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_lm_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        ChangedInputs changed(in);
        changed.leave_out(2);
        Right::run(changed, out);
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
