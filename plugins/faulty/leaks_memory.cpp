// Each match stage takes memory of the host that it never gives back.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_match_params> {
  public:
    Wrong(const Params& given, const Host& host) : Right(given, host) { host.allocate(64, 64); }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
