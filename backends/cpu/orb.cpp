#include "backends/cpu/stages.hpp"

namespace defrec::cpu {
std::unique_ptr<Stage> make_orb(const defrec_orb_params&, const Host&) { throw StageError(DEFREC_ERROR_UNSUPPORTED, "not written"); }
}  // namespace defrec::cpu
