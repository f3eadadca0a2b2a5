// A frame's state and reasons in plain words, as the pages say them (web/colours.js and
// web/reasons.js).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace defrec::cli {

/// A state's name and what it is called where people read it.
struct StateWord {
    std::string_view name, word;
};
const std::vector<StateWord>& state_words();
/// The name of a state that has none.
std::string_view word_of_state(std::string_view name);

/// A name of DEFREC_REASON_*, what it says, and what to do at the table; empty: nothing.
struct ReasonWords {
    std::string_view name, words, remedy;
};
const std::vector<ReasonWords>& reason_words();
/// null for a name that has none.
const ReasonWords* words_of(std::string_view name);
/// A frame's names, which have ", " or '|' between them.
std::vector<std::string_view> reason_names(std::string_view reasons);
/// The same in words; names that have none stay.
std::vector<std::string> reasons_in_words(std::string_view reasons);

}  // namespace defrec::cli
