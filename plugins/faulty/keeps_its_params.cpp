// Rectify looks at its parameters when it runs, where they were when it was created.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Stage {
  public:
    using Params = defrec_rectify_params;
    Wrong(const Params& given, const Host& host) : given_(given), host_(host) {}
    void run(Inputs in, Outputs out) override { cpu::make_rectify(given_, host_)->run(in, out); }

  private:
    const Params& given_;
    Host host_;
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
