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
/// What explains others comes before them.
const std::vector<ReasonWords>& reason_words();
/// null for a name that has none.
const ReasonWords* words_of(std::string_view name);
/// What to do in a frame of that state. While tissue is followed, few matches do no harm.
std::string_view remedy_of(std::string_view reason, std::string_view state);
/// A frame's names, which have ", " or '|' between them, in the order of the words.
std::vector<std::string_view> reason_names(std::string_view reasons);
/// The same in words; names that have none stay, and come last.
std::vector<std::string> reasons_in_words(std::string_view reasons);

}  // namespace defrec::cli
