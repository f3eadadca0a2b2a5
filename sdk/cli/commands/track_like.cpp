// See track_like.hpp.
#include "sdk/cli/commands/track_like.hpp"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kMaxSummaryBytes = 16'000'000;

// Each run has its own place for results, and its own views and receivers of them.
constexpr const char* kNotRepeated[] = {"out",         "like",       "save-template", "trace",
                                        "quiet",       "json",       "view",          "igtl",
                                        "igtl-listen", "igtl-clock", "igtl-image"};
constexpr const char* kPaths[] = {"left",        "right",     "stereo",       "recording", "bag",
                                  "times",       "points",    "targets",      "plan",      "config",
                                  "calibration", "disparity", "from-template"};
// If the first of a line is given, the others of it are not taken from the summary.
constexpr const char* kContradicting[][2] = {
    {"left", "stereo layout recording bag left-topic right-topic stereo-topic"},
    {"right", "stereo layout recording bag left-topic right-topic stereo-topic"},
    {"stereo", "left right recording bag left-topic right-topic stereo-topic"},
    {"recording", "left right stereo layout times fps bag left-topic right-topic stereo-topic"},
    {"bag", "left right stereo recording times fps"},
    {"left-topic", "stereo-topic layout"},
    {"right-topic", "stereo-topic layout"},
    {"stereo-topic", "left-topic right-topic"},
    {"layout", "left-topic right-topic"},
    {"times", "recording fps bag"},
    {"fps", "recording times bag"},
    {"device", "backend"},
    {"backend", "device"},
    {"from-template", "template-frame"},
    {"template-frame", "from-template"}};

template <std::size_t kCount>
bool is_one_of(const std::string& name, const char* const (&names)[kCount]) {
    return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

// The option's name of "--name" or "--name=value"; empty for other words.
std::string option_name(const std::string& word) {
    if (word.compare(0, 2, "--") != 0) return {};
    return word.substr(2, word.find('=') - 2);
}

std::optional<std::string> value_of(const std::vector<std::string>& words,
                                    const std::string& option) {
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (option_name(words[i]) != option) continue;
        if (const std::size_t equals = words[i].find('='); equals != std::string::npos)
            return words[i].substr(equals + 1);
        if (i + 1 < words.size()) return words[i + 1];
    }
    return {};
}

bool is_given(const std::vector<std::string>& words, const std::string& option) {
    const auto same = [&](const std::string& word) { return option_name(word) == option; };
    if (std::any_of(words.begin(), words.end(), same)) return true;
    for (const auto& [given, others] : kContradicting) {
        const std::vector<std::string_view> names = split(others, ' ');
        if (std::find(names.begin(), names.end(), option) != names.end() && value_of(words, given))
            return true;
    }
    return false;
}

// A path as it is from here; addresses of cameras stay as they are.
std::string from_here(const std::string& path, const fs::path& folder) {
    if (path.find("://") != std::string::npos || path.compare(0, 4, "gst:") == 0) return path;
    std::string paths;  // two files, with a comma between them
    for (const std::string_view each : split(path, ','))
        paths += (paths.empty() ? "" : ",") + (folder / each).string();
    return paths;
}

Json read_summary(const std::string& path) {
    const Json summary =
        Json::parse(read_file(path, kMaxSummaryBytes, ExitCode::kInput), nullptr, false);
    if (!summary.is_object() || !summary.contains("options") || !summary["options"].is_object() ||
        !summary.contains("folder") || !summary["folder"].is_string())
        throw CliError(ExitCode::kInput,
                       path + ": this is no summary.json of `defrec track` with its options.");
    return summary;
}

}  // namespace

Arguments::Arguments(std::vector<std::string> words) : words_(std::move(words)) {
    for (const std::string& word : words_) pointers_.push_back(word.c_str());
    pointers_.push_back(nullptr);
}

std::vector<RecordedOption> recorded_options(const CLI::App& command) {
    std::vector<RecordedOption> recorded;
    for (const CLI::Option* option : command.get_options()) {
        if (option->get_lnames().empty() || option == command.get_help_ptr()) continue;
        RecordedOption each{option->get_lnames().front(), option->get_expected_max() == 0, {}};
        if (option->count() > 0)
            each.value = option->results().empty() ? std::string() : option->results().back();
        recorded.push_back(std::move(each));
    }
    return recorded;
}

Arguments with_recorded_options(std::vector<std::string> words) {
    if (words.size() < 2 || words[1] != "track") return Arguments(std::move(words));
    const std::optional<std::string> path = value_of(words, "like");
    if (!path) return Arguments(std::move(words));
    const Json summary = read_summary(*path);
    const fs::path folder = summary["folder"].get<std::string>();
    std::vector<std::string> more;
    // A bag whose views are in two topics has no use for the layout of a video.
    const auto is_of_video = [&](const std::string& name) {
        return name == "layout" && value_of(words, "bag") &&
               summary["options"].value("stereo", Json()).is_string();
    };
    for (const auto& [name, value] : summary["options"].items()) {
        if (value.is_null() || is_one_of(name, kNotRepeated) || is_given(words, name) ||
            is_of_video(name))
            continue;
        if (value.is_boolean()) {
            if (value.get<bool>()) more.push_back("--" + name);
        } else if (value.is_string()) {
            const std::string text = value.get<std::string>();
            more.push_back("--" + name);
            more.push_back(is_one_of(name, kPaths) ? from_here(text, folder) : text);
        }
    }
    words.insert(words.begin() + 2, more.begin(), more.end());
    return Arguments(std::move(words));
}

}  // namespace defrec::cli
