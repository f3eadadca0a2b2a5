// The list of data sets, and what they share.
#include "sdk/evaluation/data_sets/data_set.hpp"

#include <algorithm>

#include "sdk/evaluation/score/percentile.hpp"
#include "sdk/input/image_stream.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepestFolder = 6;

std::vector<std::unique_ptr<DataSet>> make_data_sets() {
    std::vector<std::unique_ptr<DataSet>> sets;
    sets.push_back(make_defrec_sequences());
    sets.push_back(make_hamlyn());
    sets.push_back(make_scared());
    sets.push_back(make_serv_ct());
    sets.push_back(make_stereomis());
    sets.push_back(make_stir());
    sets.push_back(make_stir_2026());
    sets.push_back(make_super());
    sets.push_back(make_surgt());
    return sets;
}

void find_clips(const DataSet& data_set, const fs::path& folder, const fs::path& root, int depth,
                std::vector<std::string>& clips) {
    // By its name, also where it is a link.
    if (data_set.is_clip(folder)) clips.push_back(folder.lexically_relative(root).generic_string());
    if (depth == kDeepestFolder) return;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        if (entry.is_directory(error) && !entry.path().filename().string().starts_with("."))
            find_clips(data_set, entry.path(), root, depth + 1, clips);
    }
    if (error) {
        throw CliError(ExitCode::kInput,
                       folder.string() + ": the folder cannot be read (" + error.message() + ").");
    }
}

}  // namespace

FrameTimes frame_times_of(std::vector<double> milliseconds) {
    std::sort(milliseconds.begin(), milliseconds.end());
    return {percentile(milliseconds, 0.5), percentile(milliseconds, 0.95)};
}

const std::vector<std::unique_ptr<DataSet>>& data_sets() {
    static const std::vector<std::unique_ptr<DataSet>> sets = make_data_sets();
    return sets;
}

const DataSet& data_set_of(const std::string& name) {
    std::string names;
    for (const auto& data_set : data_sets()) {
        if (data_set->name() == name) return *data_set;
        names.append(names.empty() ? "" : ", ").append(data_set->name());
    }
    throw CliError(ExitCode::kUsage,
                   "--dataset: '" + name + "' is not known; there are: " + names + ".");
}

std::vector<std::string> clips_of(const DataSet& data_set, const fs::path& root) {
    std::error_code error;
    if (!fs::is_directory(root, error))
        throw CliError(ExitCode::kInput, root.string() + ": there is no such folder.");
    std::vector<std::string> clips;
    const fs::path base = root.has_filename() ? root : root.parent_path();  // "a/" is "a"
    find_clips(data_set, base, base, 0, clips);
    if (clips.empty()) {
        throw CliError(ExitCode::kInput, root.string() + ": no clip of data set " +
                                             data_set.name() + " was found; expected was " +
                                             data_set.layout() + ".");
    }
    std::sort(clips.begin(), clips.end(), precedes_by_name);
    return clips;
}

void require_entries(const fs::path& folder, const std::vector<Needed>& needed) {
    for (const auto& [path, what, is_folder] : needed) {
        std::error_code error;
        const fs::path whole = folder / path;
        if (is_folder ? fs::is_directory(whole, error) : fs::is_regular_file(whole, error))
            continue;
        throw CliError(ExitCode::kInput, whole.string() + ": this " +
                                             (is_folder ? "folder" : "file") +
                                             " was expected: " + what + ".");
    }
}

}  // namespace defrec::cli
