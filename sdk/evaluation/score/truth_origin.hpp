// Which recording and which points a result is of, by its summary.json, against where a truth
// stands: a truth itself bears no mark of its sequence.
#pragma once

#include <filesystem>
#include <string>

namespace defrec::cli {

// Both empty where there is none.
struct Contradiction {
    std::string why;     // what was tracked is not what the truth is of
    std::string remedy;  // a sentence
};

// Compares what was tracked into `folder` with a truth, which is of the recording in its own
// folder. are_given: it is of points that were given, too.
Contradiction contradiction_of(const std::filesystem::path& folder,
                               const std::filesystem::path& truth, bool are_given);

}  // namespace defrec::cli
