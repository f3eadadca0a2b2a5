// A frame's reasons in plain words, as the pages say them (web/reasons.js).
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace defrec::cli {

/// Names of DEFREC_REASON_* with their words.
const std::vector<std::pair<std::string_view, std::string_view>>& reason_words();
/// names: with ", " between them.
std::vector<std::string> reasons_in_words(std::string_view names);

}  // namespace defrec::cli
