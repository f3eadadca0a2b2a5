// See output_checks.hpp.
#include "sdk/session/output_checks.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/camera_trajectory.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

// How files begin that `--save-template` and `--trace` write.
constexpr std::string_view kTemplateBegin = "defrecT", kTraceBegin = "{\"displayTime";

std::vector<fs::path> results_in(const TrackOptions& options) {
    std::vector<fs::path> names = {kPointsFile, kFramesFile, kSummaryFile, kTemplateFile,
                                   kTrajectoryFile};
    if (!options.targets.empty()) names.emplace_back(kTargetsFile);
    if (!options.plan.file.empty()) names.emplace_back(kPlanFile);
    if (options.display_delay_ms) names.emplace_back(kDisplayFile);
    // One of them: what OpenCV can encode decides.
    if (options.recordings.overlay)
        names.insert(names.end(), {"overlay.mp4", "overlay.webm", "overlay.avi"});
    if (options.recordings.report) names.emplace_back("report.html");
    for (fs::path& name : names) name = options.out / name;
    return names;
}

std::vector<fs::path> files_read(const TrackOptions& options) {
    std::vector<fs::path> files = {
        options.source.left,      options.source.right,     options.source.stereo,
        options.source.times,     options.source.recording, options.source.bag.path,
        options.source.disparity, options.points,           options.targets,
        options.plan.file,        options.config,           options.surface.load};
    for (const std::string_view file : split(options.calibration, ',')) files.emplace_back(file);
    return files;
}

bool is_same(const fs::path& a, const fs::path& b) {
    std::error_code error;
    return fs::equivalent(a.empty() ? "." : a, b.empty() ? "." : b, error);
}

fs::path folder_of(const fs::path& path) {
    // "images/" is the folder images.
    return (path.has_filename() ? path : path.parent_path()).parent_path();
}

// The folder of the images or of the video, or the one that holds the folders of both views.
bool holds_recording(const fs::path& folder, const std::string& source) {
    if (source.empty()) return false;
    std::error_code error;
    const fs::path parent = folder_of(source);
    if (fs::is_regular_file(source, error)) return is_same(folder, parent);
    if (fs::is_directory(source, error)) return is_same(folder, source) || is_same(folder, parent);
    // A pattern, or a camera, which lies in no folder of results.
    return source.find('%') != std::string::npos &&
           (is_same(folder, parent) || is_same(folder, folder_of(parent)));
}

bool is_in_recording(const fs::path& folder, const SourceOptions& source) {
    return holds_recording(folder, source.left) || holds_recording(folder, source.right) ||
           holds_recording(folder, source.stereo) || holds_recording(folder, source.bag.path);
}

void keep_files_of_others(const TrackOptions& options, const std::vector<fs::path>& results) {
    const fs::path out(options.out);
    std::error_code error;
    if (fs::exists(out / kSummaryFile, error) || !is_in_recording(out, options.source)) return;
    for (const fs::path& result : results)
        if (fs::exists(result, error))
            throw CliError(ExitCode::kUsage,
                           options.out + ": this folder is the recording's own, and " +
                               result.filename().string() +
                               " there, which no run left, would be overwritten; choose another "
                               "with --out.");
}

// Points and targets to follow have the names of results, and other columns.
void keep_points_to_follow(const TrackOptions& options) {
    for (const char* name : {kPointsFile, kTargetsFile}) {
        if (name == kTargetsFile && options.targets.empty()) continue;
        const fs::path file = fs::path(options.out) / name;
        std::string header;
        std::ifstream stream(file);
        if (!std::getline(stream, header) || header.compare(0, 16, "frame,timestamp_") == 0)
            continue;
        throw CliError(ExitCode::kUsage,
                       file.string() +
                           ": this file is no result of a run, and would be overwritten; is this "
                           "the folder of another recording? Choose another with --out.");
    }
}

// A template or a trace, as an earlier run left it.
bool is_of_a_run(const fs::path& file) {
    std::array<char, 16> begin{};
    std::ifstream stream(file, std::ios::binary);
    stream.read(begin.data(), begin.size());
    const std::string_view text(begin.data(), static_cast<std::size_t>(stream.gcount()));
    return text.starts_with(kTemplateBegin) || text.starts_with(kTraceBegin);
}

// Files that are named one by one: they replace none of the images of a folder, nor what else lies
// in the recording's own.
void keep_recording(const TrackOptions& options, const fs::path& output) {
    std::error_code error;
    if (output.empty() || !fs::exists(output, error)) return;
    const fs::path folder = output.parent_path();
    const SourceOptions& source = options.source;
    for (const std::string& images :
         {source.left, source.right, source.stereo, source.bag.path, source.disparity})
        if (fs::is_directory(images, error) && is_same(folder, images))
            throw CliError(ExitCode::kUsage, output.string() +
                                                 ": this file lies among the images of the "
                                                 "recording; choose another output.");
    if (is_in_recording(folder, source) && !is_of_a_run(output))
        throw CliError(ExitCode::kUsage,
                       output.string() +
                           ": this file lies in the recording's own folder, no run left it there, "
                           "and it would be overwritten; choose another output.");
}

// A folder of meshes is emptied of meshes first.
void keep_meshes_apart(const TrackOptions& options, const fs::path& folder) {
    std::error_code error;
    if (!fs::exists(folder, error)) return;
    for (const fs::path& input : files_read(options))
        if (!input.empty() && (is_same(folder, input) || is_same(folder, folder_of(input))))
            throw CliError(ExitCode::kUsage,
                           folder.string() + ": the run writes meshes into this folder, and " +
                               input.string() + " is read; choose another output with --out.");
}

}  // namespace

void check_outputs(const TrackOptions& options) {
    const std::vector<fs::path> results = results_in(options);
    std::vector<fs::path> outputs = results;
    outputs.emplace_back(options.recordings.trace);
    outputs.emplace_back(options.surface.save);
    keep_apart(files_read(options), outputs);
    if (!options.plan.file.empty() && options.plan.mesh_every > 0)
        keep_meshes_apart(options, fs::path(options.out) / kPlanFolder);
    keep_recording(options, options.recordings.trace);
    keep_recording(options, options.surface.save);
    keep_files_of_others(options, results);
    keep_points_to_follow(options);
}

}  // namespace defrec::cli
