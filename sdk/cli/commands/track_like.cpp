// See track_like.hpp.
#include "sdk/cli/commands/track_like.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "sdk/input/camera_name.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/terminal.hpp"
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
constexpr const char* kSources[] = {"left", "right", "stereo"};
constexpr const char* kFiles[] = {"recording", "bag",    "times",     "points",       "targets",
                                  "plan",      "config", "disparity", "from-template"};
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

// A calibration as it is from here: a file, or two with a comma between them.
std::string calibration_from_here(const std::string& text, const fs::path& folder) {
    std::error_code error;
    if (fs::exists(folder / text, error)) return (folder / text).string();
    std::string paths;
    for (const std::string_view each : split(text, ','))
        paths += (paths.empty() ? "" : ",") + (folder / each).string();
    return paths;
}

Json read_summary(const std::string& path) {
    const Json summary =
        Json::parse(read_file(path, kMaxSummaryBytes, ExitCode::kInput), nullptr, false);
    if (!summary.is_object() || !summary.contains("options") || !summary["options"].is_object() ||
        !summary.contains("folder") || !summary["folder"].is_string() ||
        !fs::path(summary["folder"].get<std::string>()).is_absolute())
        throw CliError(ExitCode::kInput,
                       path + ": this is no summary.json of `defrec track` with its options.");
    return summary;
}

// The options of a summary, of whose writer nothing is known.
class Summary {
  public:
    Summary(const std::string& path, const CLI::App& command)
        : path_(path), json_(read_summary(path)), folder_(json_["folder"].get<std::string>()) {
        for (const RecordedOption& option : recorded_options(command))
            is_flag_[option.name] = option.is_flag;
    }

    const Json& options() const { return json_["options"]; }

    // The words that give the option as it was recorded. is_quiet: without a notice.
    std::vector<std::string> words_of(const std::string& name, const Json& value,
                                      bool is_quiet) const {
        const auto option = is_flag_.find(name);
        if (option == is_flag_.end() || !(option->second ? value.is_boolean() : value.is_string()))
            throw CliError(ExitCode::kInput, path_ + ": its option " + json_text(Json(name)) +
                                                 " is none as `defrec track` records them.");
        if (option->second) return {"--" + name};
        return {"--" + name, repeated(name, value.get<std::string>(), is_quiet)};
    }

  private:
    std::string repeated(const std::string& name, const std::string& text, bool is_quiet) const {
        if (is_one_of(name, kSources)) return source_of(name, text, is_quiet);
        if (name == "calibration") return calibration_from_here(text, folder_);
        return is_one_of(name, kFiles) ? (folder_ / text).string() : text;
    }

    // Addresses of cameras stay as they are.
    std::string source_of(const std::string& name, const std::string& text, bool is_quiet) const {
        if (parse_camera(text).kind == CameraName::Kind::kPipeline)
            throw CliError(ExitCode::kUsage,
                           path_ + ": --" + name +
                               " is a pipeline of GStreamer there, which may run any command; if "
                               "it is yours, give it beside --like.");
        if (text.find("://") == std::string::npos) return (folder_ / text).string();
        const std::optional<std::string> address = without_hidden_user(text);
        if (!address) return text;
        if (!is_quiet)
            print_notice(path_ + " has --" + name + " without user and password: " + *address +
                         " is taken; if the camera asks for them, give the whole address beside "
                         "--like.");
        return *address;
    }

    const std::string path_;
    const Json json_;
    const fs::path folder_;
    std::map<std::string, bool> is_flag_;  // the command's options
};

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
        if (each.value && is_one_of(each.name, kSources)) each.value = shown_source(*each.value);
        recorded.push_back(std::move(each));
    }
    return recorded;
}

Arguments with_recorded_options(const CLI::App& app, std::vector<std::string> words) {
    if (words.size() < 2 || words[1] != "track") return Arguments(std::move(words));
    const std::optional<std::string> path = value_of(words, "like");
    if (!path) return Arguments(std::move(words));
    const Summary summary(*path, *app.get_subcommand("track"));
    const bool is_quiet = is_given(words, "quiet");
    std::vector<std::string> more;
    // A bag whose views are in two topics has no use for the layout of a video.
    const auto is_of_video = [&](const std::string& name) {
        return name == "layout" && value_of(words, "bag") &&
               summary.options().value("stereo", Json()).is_string();
    };
    for (const auto& [name, value] : summary.options().items()) {
        const bool is_not_given = value.is_null() || value == Json(false);
        if (is_not_given || is_one_of(name, kNotRepeated) || is_given(words, name) ||
            is_of_video(name))
            continue;
        const std::vector<std::string> given = summary.words_of(name, value, is_quiet);
        more.insert(more.end(), given.begin(), given.end());
    }
    words.insert(words.begin() + 2, more.begin(), more.end());
    return Arguments(std::move(words));
}

}  // namespace defrec::cli
