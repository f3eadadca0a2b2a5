// See status.hpp.
#include "sdk/base/util/status.hpp"

#include "sdk/base/util/text_buffer.hpp"
#include "sdk/contract/enumerations.hpp"

namespace defrec {
namespace {
thread_local TextBuffer<1024> last_error_text;
}  // namespace

const char* status_name(defrec_status status) noexcept {
    for (const EnumeratorName& known : kStatusNames)
        if (known.value == status) return known.name;
    return "unknown status";
}

void set_last_error(std::string_view text) noexcept { last_error_text.set(text); }
const char* last_error() noexcept { return last_error_text.text(); }

}  // namespace defrec
