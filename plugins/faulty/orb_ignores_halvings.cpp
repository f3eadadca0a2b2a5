// Features are of the image as it is where those of the halved image are asked for.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_orb_params> {
  public:
    Wrong(const Params& given, const Host& host) : Right(not_halved(given), host) {}

  private:
    static Params not_halved(Params params) {
        params.halvings = 0;
        return params;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
