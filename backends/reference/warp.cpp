#include "backends/reference/stages.hpp"

namespace defrec::reference {
std::unique_ptr<Stage> make_warp(const defrec_warp_params&, const Host&) { throw StageError(DEFREC_ERROR_UNSUPPORTED, "not written"); }
}  // namespace defrec::reference
