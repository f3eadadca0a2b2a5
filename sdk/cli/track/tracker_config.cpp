// --config: parameters of the tracker by name.
#include "sdk/cli/track/tracker_config.hpp"

#include <algorithm>
#include <variant>

#include "sdk/cli/io/text.hpp"
#include "sdk/cli/io/yaml_document.hpp"

namespace defrec::cli {
namespace {

struct Parameter {
    const char* name;
    std::variant<std::uint32_t defrec_tracker_desc::*, std::int32_t defrec_tracker_desc::*,
                 float defrec_tracker_desc::*>
        member;
    double low, high;
};

const Parameter kParameters[] = {
    {"disparities", &defrec_tracker_desc::disparities, 0, 1024},
    {"min_disparity", &defrec_tracker_desc::min_disparity, 0, 4096},
    {"min_depth_mm", &defrec_tracker_desc::min_depth_mm, 0, 10000},
    {"node_spacing_px", &defrec_tracker_desc::node_spacing_px, 0, 1000},
    {"vertex_spacing_px", &defrec_tracker_desc::vertex_spacing_px, 0, 1000},
    {"max_features", &defrec_tracker_desc::max_features, 0, 65535},
    {"max_patches", &defrec_tracker_desc::max_patches, 0, 65535},
    {"arap_weight", &defrec_tracker_desc::arap_weight, 0, 1e6},
    {"coarse_iterations", &defrec_tracker_desc::coarse_iterations, 0, 1000},
    {"fine_iterations", &defrec_tracker_desc::fine_iterations, 0, 1000},
};

void set(const YamlDocument& document, const YamlEntry& entry, const Parameter& parameter,
         defrec_tracker_desc& desc) {
    if (const auto* member = std::get_if<float defrec_tracker_desc::*>(&parameter.member)) {
        const double value = document.number(entry.value, entry.key);
        if (value < parameter.low || value > parameter.high) {
            document.fail(entry.line, entry.key,
                          format_fixed(value, 3) + " is outside " + format_fixed(parameter.low, 0) +
                              ".." + format_fixed(parameter.high, 0) + ".");
        }
        desc.*(*member) = static_cast<float>(value);
        return;
    }
    const int value = document.integer(entry.value, entry.key, static_cast<int>(parameter.low),
                                       static_cast<int>(parameter.high));
    if (const auto* member = std::get_if<std::int32_t defrec_tracker_desc::*>(&parameter.member)) {
        desc.*(*member) = value;
    } else {
        desc.*std::get<std::uint32_t defrec_tracker_desc::*>(parameter.member) =
            static_cast<std::uint32_t>(value);
    }
}

}  // namespace

std::vector<std::string> config_keys() {
    std::vector<std::string> names;
    for (const Parameter& parameter : kParameters) names.emplace_back(parameter.name);
    return names;
}

void read_config(const std::filesystem::path& path, defrec_tracker_desc& desc) {
    const YamlDocument document = YamlDocument::load(path, ExitCode::kUsage);
    document.require_known_keys(document.root(), config_keys());
    for (const YamlEntry& entry : document.root().entries) {
        const auto* parameter =
            std::find_if(std::begin(kParameters), std::end(kParameters),
                         [&](const Parameter& p) { return entry.key == p.name; });
        set(document, entry, *parameter, desc);
    }
}

}  // namespace defrec::cli
