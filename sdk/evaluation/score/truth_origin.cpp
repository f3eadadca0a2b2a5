// Which recording and which points a result is of, against where a truth stands.
#include "sdk/evaluation/score/truth_origin.hpp"

#include <nlohmann/json.hpp>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kLargestFile = 100'000'000;

// The path that exists, without links; empty where it does not.
fs::path found(const fs::path& path) {
    std::error_code error;
    const fs::path canonical = fs::canonical(path, error);
    return error ? fs::path() : canonical;
}

std::string text_at(const Json& summary, const char* pointer) {
    const Json::json_pointer place(pointer);
    return summary.contains(place) && summary[place].is_string() ? summary[place].get<std::string>()
                                                                 : std::string();
}

// What was tracked: the left views, the file or folder of both, or the bag.
fs::path tracked_source(const Json& summary) {
    fs::path path;
    for (const char* input : {"/input/left", "/input/stereo", "/input/bag"})
        if (path.empty()) path = text_at(summary, input);
    // The folder of a pattern.
    if (path.filename().string().find('%') != std::string::npos) path = path.parent_path() / ".";
    if (path.empty()) return {};
    if (path.is_absolute()) return found(path);
    const std::string folder = text_at(summary, "/folder");
    return folder.empty() ? fs::path() : found(fs::path(folder) / path);
}

}  // namespace

Contradiction contradiction_of(const fs::path& folder, const fs::path& truth, bool are_given) {
    const fs::path path = folder / kSummaryFile;
    if (found(path).empty()) return {};
    const Json summary =
        Json::parse(read_text_file(path, kLargestFile, ExitCode::kInput), nullptr, false);
    if (!summary.is_object()) return {};
    const fs::path own = found(truth.parent_path().empty() ? "." : truth.parent_path());
    const fs::path beside = found(own / "left"), source = tracked_source(summary);
    if (!own.empty() && !beside.empty() && !source.empty() && source != own &&
        source.parent_path() != own) {
        return {folder.string() + " was tracked in " + source.string() + ", and " + truth.string() +
                    " is beside another recording",
                "Where it is the right truth after all, put it into a folder without a recording."};
    }
    const Json::json_pointer points("/input/points");
    if (are_given && summary.contains(points) && summary[points].is_null()) {
        return {folder.string() +
                    " was tracked without --points, so its points are a grid of its "
                    "own, and not those of " +
                    truth.string(),
                "Track with --points and the points of the truth."};
    }
    return {};
}

}  // namespace defrec::cli
