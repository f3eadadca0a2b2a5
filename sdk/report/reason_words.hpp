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

/// A name of DEFREC_REASON_* or kPointErrorReason, what it says, and what to do at the table;
/// empty: nothing. of_one: what it says of a picture that it is known to speak of; empty: it never
/// does.
struct ReasonWords {
    std::string_view name, words, remedy, of_one{};
};
/// What explains others comes before them.
const std::vector<ReasonWords>& reason_words();
/// null for a name that has none.
const ReasonWords* words_of(std::string_view name);
/// One of a frame's reasons as it is said; names that have no words stay.
struct ToldReason {
    std::string_view name;
    std::string words;
    std::string_view remedy;
};
/// In the order of the words, each thing once: that a picture is black says why it has no contrast.
/// reasons: names with ", " or '|' between them. faulty_views: "left", "right", "both" or empty, as
/// in frames.csv.
std::vector<ToldReason> told_reasons(std::string_view reasons, std::string_view faulty_views);
/// Their words.
std::vector<std::string> reasons_in_words(std::string_view reasons, std::string_view faulty_views);
/// What to do in a frame of that state. While tissue is followed, few matches do no harm; where it
/// is "unfound" it was never followed.
std::string_view remedy_of(const ToldReason& reason, std::string_view state);

}  // namespace defrec::cli
