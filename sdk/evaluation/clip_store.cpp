// The folder of an evaluation.
#include "sdk/evaluation/clip_store.hpp"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr char kScoreFile[] = "score.json", kOutcomeFile[] = "clip.json";
constexpr std::size_t kLargestFile = 100'000'000;

// A path as one component that no other path has: everything but letters, digits and _-. becomes
// %XX, and so does a dot in front.
std::string component_of(const std::string& path) {
    constexpr char kDigits[] = "0123456789ABCDEF";
    std::string component;
    for (const char c : path) {
        const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                              (c >= '0' && c <= '9') || c == '_' || c == '-' ||
                              (c == '.' && !component.empty());
        if (is_plain) {
            component += c;
            continue;
        }
        const auto byte = static_cast<unsigned char>(c);
        component.append({'%', kDigits[byte / 16], kDigits[byte % 16]});
    }
    return component;
}

double number_or_nan(const Json& value) {
    return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

[[noreturn]] void cannot(const fs::path& path, const std::string& what,
                         const std::error_code& error) {
    throw CliError(ExitCode::kOutput, path.string() + ": the folder cannot be " + what + " (" +
                                          error.message() + ").");
}

}  // namespace

void write_score(const fs::path& folder, const ClipScore& score) {
    score.samples.write(folder / kSamplesFile);
    if (!score.picture.empty()) write_atomically(folder / kPictureFile, score.picture);
    const Json json = {{"frames", score.frames},
                       {"frame_ms", score.frame_ms.median},
                       {"frame_p95_ms", score.frame_ms.p95},
                       {"remark", score.remark},
                       {"doubt", score.doubt},
                       {"notes", score.notes}};
    write_atomically(folder / kScoreFile, json_text(json, 2) + "\n");
}

fs::path ClipStore::folder(const ClipName& name) const {
    return out_ / "clips" / component_of(name.variant) / component_of(name.clip);
}

fs::path ClipStore::partial(const ClipName& name) const {
    // No clip's folder begins with a dot.
    std::string hidden(1, '.');
    hidden.append(folder(name).filename().string()).append(".partial");
    return folder(name).replace_filename(hidden);
}

fs::path ClipStore::begin(const ClipName& name) const {
    fs::path path = partial(name);
    std::error_code error;
    fs::remove_all(path, error);
    if (error) cannot(path, "removed", error);
    create_output_folder(path);
    return path;
}

void ClipStore::commit(const ClipName& name, const Outcome& outcome) const {
    const fs::path from = partial(name), to = folder(name);
    Json json = {{"clip", name.clip},
                 {"variant", name.variant},
                 {"status", outcome.failure.empty() ? "done" : "quarantined"},
                 {"failure", outcome.failure},
                 {"settings", outcome.settings},
                 {"inputs", outcome.inputs},
                 {"seconds", outcome.seconds}};
    write_atomically(from / kOutcomeFile, json_text(json, 2) + "\n");
    std::error_code error;
    fs::remove_all(to, error);
    if (!error) fs::rename(from, to, error);
    if (error) cannot(to, "written", error);
}

std::optional<Outcome> ClipStore::outcome(const ClipName& name) const {
    const fs::path path = folder(name);
    std::error_code error;
    if (!fs::exists(path / kOutcomeFile, error)) return {};
    try {
        const auto read = [&](const char* file) {
            return Json::parse(read_text_file(path / file, kLargestFile, ExitCode::kInput));
        };
        const Json json = read(kOutcomeFile);
        Outcome outcome;
        outcome.failure = json.at("failure").get<std::string>();
        outcome.settings = json.at("settings").get<std::string>();
        outcome.inputs = json.value("inputs", "");  // none where an older version ran it
        outcome.seconds = json.at("seconds").get<double>();
        if (!outcome.failure.empty()) return outcome;
        const Json score = read(kScoreFile);
        outcome.frames = score.at("frames").get<std::int64_t>();
        outcome.frame_ms = {number_or_nan(score.at("frame_ms")),
                            number_or_nan(score.at("frame_p95_ms"))};
        outcome.remark = score.at("remark").get<std::string>();
        outcome.doubt = score.value("doubt", "");  // none where an older version ran it
        outcome.notes = score.value("notes", "");
        return outcome;
    } catch (const Json::exception& fault) {
        throw CliError(ExitCode::kInput, path.string() + ": this is not a clip's result (" +
                                             fault.what() + "); remove the folder.");
    }
}

}  // namespace defrec::cli
