// Patches are predicted into the left view where the right one is asked for.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_align_params> {
  public:
    Wrong(const Params& given, const Host& host) : Right(of_left_view(given), host) {}

  private:
    static Params of_left_view(Params params) {
        params.right_view = 0;
        return params;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
