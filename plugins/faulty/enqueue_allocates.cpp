// Each run of warp takes memory of the host, and gives it back.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_warp_params> {
  public:
    Wrong(const Params& given, const Host& host) : Right(given, host), host_(host) {}
    void run(Inputs in, Outputs out) override {
        const HostVector<defrec_surface_sample> working_space(
            params().points, HostAllocator<defrec_surface_sample>(host_));
        Right::run(in, out);
    }

  private:
    Host host_;
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
