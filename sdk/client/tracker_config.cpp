// --config: parameters of the tracker by name.
#include "sdk/client/tracker_config.hpp"

#include <algorithm>
#include <variant>

#include "sdk/contract/descs.hpp"
#include "sdk/contract/tracker_options.hpp"
#include "sdk/io/text.hpp"
#include "sdk/io/yaml_document.hpp"

namespace defrec::cli {
namespace {

std::uint32_t read_choice(const YamlDocument& document, const YamlEntry& entry,
                          std::span<const TrackerChoice> choices) {
    std::string known;
    for (const TrackerChoice& choice : choices) {
        if (entry.value.scalar == choice.name) return choice.value;
        known += (known.empty() ? "" : ", ") + std::string(choice.name);
    }
    document.fail(entry.line, entry.key,
                  "is " + entry.value.scalar + "; expected one of: " + known + ".");
}

// The word, whole number or number that an entry gives; ranges are those of the library.
void set(const YamlDocument& document, const YamlEntry& entry, const TrackerOption& option,
         defrec_tracker_desc& desc) {
    if (const auto* real = std::get_if<float defrec_tracker_desc::*>(&option.member)) {
        desc.*(*real) = static_cast<float>(document.number(entry.value, entry.key));
    } else if (!option.choices.empty()) {
        desc.*std::get<std::uint32_t defrec_tracker_desc::*>(option.member) =
            read_choice(document, entry, option.choices);
    } else {
        const int value = document.integer(entry.value, entry.key, static_cast<int>(option.low),
                                           static_cast<int>(option.high));
        if (const auto* count = std::get_if<std::uint32_t defrec_tracker_desc::*>(&option.member))
            desc.*(*count) = static_cast<std::uint32_t>(value);
        else
            desc.*std::get<std::int32_t defrec_tracker_desc::*>(option.member) = value;
    }
    if (const std::string error = range_error(desc); !error.empty())
        document.fail(entry.line, entry.key, error + ".");
}

}  // namespace

std::vector<std::string> config_keys() {
    std::vector<std::string> names;
    for (const TrackerOption& option : kTrackerOptions) names.emplace_back(option.name);
    return names;
}

void read_config(const std::filesystem::path& path, defrec_tracker_desc& desc) {
    const YamlDocument document = YamlDocument::load(path, ExitCode::kUsage);
    document.require_known_keys(document.root(), config_keys());
    for (const YamlEntry& entry : document.root().entries) {
        const auto* option = std::find_if(std::begin(kTrackerOptions), std::end(kTrackerOptions),
                                          [&](const auto& o) { return entry.key == o.name; });
        set(document, entry, *option, desc);
    }
}

}  // namespace defrec::cli
