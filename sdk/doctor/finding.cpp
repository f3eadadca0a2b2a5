// See finding.hpp.
#include "sdk/doctor/finding.hpp"

#include <utility>

namespace defrec::cli {

Look::Look(const char* id, const char* title, Severity severity) {
    finding_.id = id;
    finding_.title = title;
    finding_.severity = severity;
}

Look& Look::measured(double value, const char* unit) {
    finding_.value = value;
    finding_.unit = unit;
    return *this;
}

Finding Look::fine(std::string what) { return end(Verdict::kFine, std::move(what), {}); }

Finding Look::unknown(std::string why) { return end(Verdict::kUnknown, std::move(why), {}); }

Finding Look::found(std::string what, std::string remedy) {
    return end(Verdict::kFound, std::move(what), std::move(remedy));
}

Finding Look::end(Verdict verdict, std::string what, std::string remedy) {
    finding_.verdict = verdict;
    finding_.what = std::move(what);
    finding_.remedy = std::move(remedy);
    return finding_;
}

}  // namespace defrec::cli
