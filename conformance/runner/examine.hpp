// One run of the suite on one plugin: from the command line's options to the record that the
// reports are made of.
#pragma once
#include "conformance/runner/options.hpp"
#include "conformance/runner/runner.hpp"
#include "conformance/worker/record.hpp"

namespace defrec::conformance {

inline constexpr char kSuiteVersion[] =
    "11";  // grows when a case or a definition changes; a new case says with `since`

// The plugin or device cannot be examined; what() is the reason.
class Unavailable : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

// How the cases of a run with these options are done.
RunSettings settings_of(const RunOptions& options);
// Throws Unavailable; Error where the options make no sense.
RunRecord examine(const RunOptions& options);

}  // namespace defrec::conformance
