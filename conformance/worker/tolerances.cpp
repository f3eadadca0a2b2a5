// See tolerances.hpp.
#include "conformance/worker/tolerances.hpp"

#include <yaml-cpp/yaml.h>

#include <charconv>
#include <cmath>
#include <set>

#include "conformance/embedded_tolerances.hpp"
#include "sdk/base/util/error.hpp"

namespace defrec::conformance {
namespace {

template <class... Pieces>
[[noreturn]] void refuse(const YAML::Mark& mark, const Pieces&... pieces) {
    fail(DEFREC_ERROR_ARGUMENT, "tolerances, line ", mark.line + 1, ": ", pieces...);
}

std::string text(const YAML::Node& entry, const char* key) {
    const YAML::Node node = entry[key];
    if (!node || !node.IsScalar() || node.Scalar().empty())
        refuse(entry.Mark(), key, " is missing");
    return node.Scalar();
}

// Independent of the locale, as yaml-cpp's own conversion is not.
double number(const YAML::Node& entry, const char* key) {
    const std::string given = text(entry, key);
    double value = 0;
    const auto [end, error] = std::from_chars(given.data(), given.data() + given.size(), value);
    if (error != std::errc() || end != given.data() + given.size() || !std::isfinite(value) ||
        value < 0)
        refuse(entry[key].Mark(), key, " is \"", given, "\", a number of at least 0 expected");
    return value;
}

}  // namespace

Tolerances Tolerances::parse(std::string_view yaml) {
    Tolerances tolerances;
    YAML::Node root;
    try {
        root = YAML::Load(std::string(yaml));
    } catch (const YAML::Exception& error) {
        refuse(error.mark, error.msg);
    }
    if (!root.IsMap()) refuse(root.Mark(), "quantities by name expected");
    static const std::set<std::string> kKeys = {"unit", "maximum", "p99", "provenance", "command"};
    for (const auto& pair : root) {
        const std::string& name = pair.first.Scalar();
        const YAML::Node& entry = pair.second;
        if (!entry.IsMap()) refuse(entry.Mark(), name, " has no values");
        for (const auto& item : entry)
            if (!kKeys.contains(item.first.Scalar()))
                refuse(item.first.Mark(), "unknown key ", item.first.Scalar());
        const Tolerance tolerance{text(entry, "unit"), number(entry, "maximum"),
                                  number(entry, "p99"), text(entry, "provenance"),
                                  text(entry, "command")};
        if (tolerance.p99 > tolerance.maximum)
            refuse(entry.Mark(), name, ": p99 is larger than maximum");
        if (!tolerances.all_.emplace(name, tolerance).second)
            refuse(pair.first.Mark(), name, " appears twice");
    }
    return tolerances;
}

const Tolerances& Tolerances::of_suite() {
    static const Tolerances tolerances = parse(kEmbeddedTolerances);
    return tolerances;
}

const Tolerance& Tolerances::at(const std::string& quantity) const {
    const auto found = all_.find(quantity);
    if (found == all_.end()) fail(DEFREC_ERROR_INTERNAL, "there is no tolerance for ", quantity);
    return found->second;
}

}  // namespace defrec::conformance
