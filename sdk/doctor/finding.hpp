// A finding: the doctor's word on one thing that may be wrong with a recording or its calibration.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace defrec::cli {

enum class Verdict {
    kFine,
    kFound,
    kUnknown,  // the recording does not tell
};

enum class Severity {
    kWarning,  // tracking works worse
    kError,    // nothing is tracked, or lengths are wrong
};

struct Finding {
    std::string id;     // stable, for scripts
    std::string title;  // what was looked at
    Verdict verdict = Verdict::kUnknown;
    Severity severity = Severity::kWarning;  // of what was found
    std::string what;                        // a sentence, also where nothing is wrong
    std::string remedy;                      // what to do; empty unless found
    std::optional<double> value;             // as measured
    std::string unit;                        // of the value; empty: none
};

// A look at one thing: what its finding says wherever it ends.
class Look {
  public:
    Look(const char* id, const char* title, Severity severity);
    Look& measured(double value, const char* unit);
    Finding fine(std::string what);
    Finding unknown(std::string why);
    Finding found(std::string what, std::string remedy);

  private:
    Finding end(Verdict verdict, std::string what, std::string remedy);

    Finding finding_;
};

}  // namespace defrec::cli
