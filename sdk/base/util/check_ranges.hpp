// The ranges of the public headers, checked where a caller's struct comes in.
#pragma once
#include "sdk/base/util/error.hpp"
#include "sdk/contract/descs.hpp"
#include "sdk/contract/stage_params.hpp"

namespace defrec {

// Throws Error(DEFREC_ERROR_ARGUMENT) naming field, value and range where a field is out of it.
template <class Struct>
void check_ranges(const Struct& given) {
    if (const std::string error = range_error(given); !error.empty())
        fail(DEFREC_ERROR_ARGUMENT, error);
}

}  // namespace defrec
