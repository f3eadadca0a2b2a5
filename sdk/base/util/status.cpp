// See status.hpp.
#include "sdk/base/util/status.hpp"

#include "sdk/base/util/text_buffer.hpp"

namespace defrec {
namespace {
thread_local TextBuffer<1024> last_error_text;
}  // namespace

const char* status_name(defrec_status status) noexcept {
    switch (status) {
        case DEFREC_OK:
            return "DEFREC_OK";
        case DEFREC_TIMEOUT:
            return "DEFREC_TIMEOUT";
        case DEFREC_ERROR_ARGUMENT:
            return "DEFREC_ERROR_ARGUMENT";
        case DEFREC_ERROR_VERSION:
            return "DEFREC_ERROR_VERSION";
        case DEFREC_ERROR_UNSUPPORTED:
            return "DEFREC_ERROR_UNSUPPORTED";
        case DEFREC_ERROR_OUT_OF_MEMORY:
            return "DEFREC_ERROR_OUT_OF_MEMORY";
        case DEFREC_ERROR_DEVICE_LOST:
            return "DEFREC_ERROR_DEVICE_LOST";
        case DEFREC_ERROR_PLUGIN:
            return "DEFREC_ERROR_PLUGIN";
        case DEFREC_ERROR_IO:
            return "DEFREC_ERROR_IO";
        case DEFREC_ERROR_HANDLE:
            return "DEFREC_ERROR_HANDLE";
        case DEFREC_ERROR_BUSY:
            return "DEFREC_ERROR_BUSY";
        case DEFREC_ERROR_STATE:
            return "DEFREC_ERROR_STATE";
        case DEFREC_ERROR_INTERNAL:
            return "DEFREC_ERROR_INTERNAL";
        default:
            return "unknown status";
    }
}

void set_last_error(std::string_view text) noexcept { last_error_text.set(text); }
const char* last_error() noexcept { return last_error_text.text(); }

}  // namespace defrec
