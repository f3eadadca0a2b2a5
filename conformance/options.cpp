// See options.hpp.
#include "conformance/options.hpp"

#include <fnmatch.h>

#include <algorithm>

namespace defrec::conformance {

std::vector<Case> select_cases(std::vector<Case> cases, const RunOptions& options) {
    for (const std::string& pattern : options.cases)
        if (std::none_of(cases.begin(), cases.end(), [&](const Case& one) {
                return fnmatch(pattern.c_str(), one.id.c_str(), 0) == 0;
            }))
            fail(DEFREC_ERROR_ARGUMENT, "no case is called ", pattern, "; --list names them all");
    std::erase_if(cases, [&](const Case& one) {
        const auto matches = [&](const std::string& pattern) {
            return fnmatch(pattern.c_str(), one.id.c_str(), 0) == 0;
        };
        return (options.smoke && !one.smoke) ||
               (!options.tiers.empty() && std::find(options.tiers.begin(), options.tiers.end(),
                                                    one.tier) == options.tiers.end()) ||
               (!options.cases.empty() &&
                std::none_of(options.cases.begin(), options.cases.end(), matches));
    });
    return cases;
}

}  // namespace defrec::conformance
