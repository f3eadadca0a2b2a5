// The patches' centres in their views are rounded down to 1/256 px instead of to the nearest: half
// an lsb.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_align_params> {
  public:
    Wrong(const Params& given, const Host& host)
        : Right(given, host), patches_(HostAllocator<defrec_patch>(host)) {}
    void prepare(Inputs in) override {
        const auto* first = in[0].as<defrec_patch>();
        patches_.assign(first, first + in[0].size / sizeof *first);
        for (defrec_patch& patch : patches_) {
            patch.u -= 1.0f / 512;
            patch.v -= 1.0f / 512;
        }
        ChangedInputs changed(in);
        changed[0].data = patches_.data();
        Right::prepare(changed);
    }

  private:
    HostVector<defrec_patch> patches_;
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
