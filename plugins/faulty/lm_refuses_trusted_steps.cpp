// The last step is taken only where it lowers the cost, though it is to be trusted.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_lm_params> {
  public:
    Wrong(const Params& given, const Host& host) : Right(without_trust(given), host) {}

  private:
    static Params without_trust(Params params) {
        params.trust_last_step = 0;
        return params;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
