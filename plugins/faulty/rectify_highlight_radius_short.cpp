// The mask grows round highlights by a pixel less than asked.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_rectify_params> {
  public:
    Wrong(const Params& given, const Host& host) : Right(shortened(given), host) {}

  private:
    static Params shortened(Params params) {
        if (params.highlight_radius > 1) --params.highlight_radius;
        return params;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
