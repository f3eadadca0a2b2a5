#include "backends/reference/stages.hpp"

namespace defrec::reference {
std::unique_ptr<Stage> make_stereo(const defrec_stereo_params&, const Host&) { throw StageError(DEFREC_ERROR_UNSUPPORTED, "not written"); }
}  // namespace defrec::reference
