#include "backends/cpu/stages.hpp"

namespace defrec::cpu {
std::unique_ptr<Stage> make_align(const defrec_align_params&, const Host&) { throw StageError(DEFREC_ERROR_UNSUPPORTED, "not written"); }
}  // namespace defrec::cpu
