// Patches are turned with the surface, not strained with it.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_align_params> {
  public:
    using Right::Right;
    void prepare(Inputs in) override { Right::prepare(in.first(std::min<size_t>(in.size(), 2))); }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
