// Reference k is drawn with the random number of k - 1.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_ransac_params> {
  public:
    Wrong(const Params& given, const Host& host) : Right(one_before(given), host) {}

  private:
    static Params one_before(Params params) {
        params.seed -= 0x9e3779b97f4a7c15u;  // the increment of docs/stages/ransac.md
        return params;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
