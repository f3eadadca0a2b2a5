// The list of data sets, and what they share.
#include "sdk/evaluation/data_sets/data_set.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "sdk/evaluation/score/percentile.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepestFolder = 6;

std::vector<std::unique_ptr<DataSet>> make_data_sets() {
    std::vector<std::unique_ptr<DataSet>> sets;
    sets.push_back(make_defrec_sequences());
    sets.push_back(make_d4d());
    sets.push_back(make_hamlyn());
    sets.push_back(make_heart_phantom());
    sets.push_back(make_scared());
    sets.push_back(make_serv_ct());
    sets.push_back(make_stereomis());
    sets.push_back(make_stir());
    sets.push_back(make_stir_2026());
    sets.push_back(make_super());
    sets.push_back(make_surgt());
    return sets;
}

// Folders that are clips, each once: by its own name, or where only links lead to it by the first
// of these.
class ClipSearch {
  public:
    ClipSearch(const DataSet& data_set, const fs::path& root) : data_set_(data_set), root_(root) {
        visit(root, 0);
        while (!links_.empty()) {
            std::sort(links_.begin(), links_.end());
            for (const auto& [link, depth] : std::exchange(links_, {})) visit(link, depth);
        }
    }

    std::vector<std::string> take() { return std::move(clips_); }

  private:
    void visit(const fs::path& folder, int depth) {
        std::error_code error;
        const fs::path real = fs::canonical(folder, error);
        if (!error && !seen_.insert(real).second) return;
        if (data_set_.is_clip(folder))
            clips_.push_back(folder.lexically_relative(root_).generic_string());
        if (depth == kDeepestFolder) return;
        for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
             entry.increment(error)) {
            // A link that leads nowhere is no folder.
            std::error_code unknown;
            if (!entry->is_directory(unknown) || entry->path().filename().string().starts_with("."))
                continue;
            if (entry->is_symlink(unknown))
                links_.emplace_back(entry->path(), depth + 1);
            else
                visit(entry->path(), depth + 1);
        }
        if (error)
            throw CliError(ExitCode::kInput, folder.string() + ": the folder cannot be read (" +
                                                 error.message() + ").");
    }

    const DataSet& data_set_;
    const fs::path& root_;
    std::set<fs::path> seen_;  // canonical
    std::vector<std::pair<fs::path, int>> links_;
    std::vector<std::string> clips_;
};

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
    const fs::path base = root.has_filename() ? root : root.parent_path();  // "a/" is "a"
    std::vector<std::string> clips = ClipSearch(data_set, base).take();
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
