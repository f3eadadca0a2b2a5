// How the program writes JSON.
#pragma once

#include <string>

namespace defrec::cli {

// On one line, or by so many columns indented. What is no UTF-8, as a file's name may be, becomes
// U+FFFD.
template <class Json>
std::string json_text(const Json& json, int indent = -1) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace defrec::cli
