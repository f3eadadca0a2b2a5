// Where both motions and predictions are given, the motions are used.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_align_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        ChangedInputs changed(in);
        if (in.size() > 2 && in[2].data != nullptr) changed.leave_out(3);
        Right::run(changed, out);
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
