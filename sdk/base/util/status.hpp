// Names of statuses, and the error message behind this thread's last failed call.
#pragma once
#include <string_view>

#include "include/defrec_c.h"

namespace defrec {

const char* status_name(defrec_status status) noexcept;

void set_last_error(std::string_view text) noexcept;
// "" before the first failure. Valid until this thread's next failure.
const char* last_error() noexcept;

}  // namespace defrec
