// See options.hpp.
#include "conformance/runner/options.hpp"

#include <algorithm>
#include <string_view>

namespace defrec::conformance {
namespace {

// In a pattern a star stands for any text.
bool matches(std::string_view pattern, std::string_view text) {
    const size_t star = pattern.find('*');
    if (star == std::string_view::npos) return pattern == text;
    if (!text.starts_with(pattern.substr(0, star))) return false;
    pattern.remove_prefix(star + 1);
    for (text.remove_prefix(star);; text.remove_prefix(1)) {
        if (matches(pattern, text)) return true;
        if (text.empty()) return false;
    }
}

}  // namespace

std::vector<Case> select_cases(std::vector<Case> cases, const RunOptions& options) {
    for (const std::string& pattern : options.cases)
        if (std::none_of(cases.begin(), cases.end(),
                         [&](const Case& one) { return matches(pattern, one.id); }))
            fail(DEFREC_ERROR_ARGUMENT, "no case is called ", pattern, "; --list names them all");
    std::erase_if(cases, [&](const Case& one) {
        const auto is_asked_for = [&](const std::string& pattern) {
            return matches(pattern, one.id);
        };
        return (options.smoke && !one.smoke) ||
               (!options.tiers.empty() && std::find(options.tiers.begin(), options.tiers.end(),
                                                    one.tier) == options.tiers.end()) ||
               (!options.cases.empty() &&
                std::none_of(options.cases.begin(), options.cases.end(), is_asked_for));
    });
    return cases;
}

}  // namespace defrec::conformance
