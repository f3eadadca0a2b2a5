// A clip that is tracked.
#include "sdk/evaluation/data_sets/tracked_clip.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "sdk/evaluation/data_sets/opencv_method.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

nlohmann::json read_summary(const fs::path& out) {
    constexpr std::size_t kLargestFile = 100'000'000;
    return nlohmann::json::parse(
        read_text_file(out / "summary.json", kLargestFile, ExitCode::kInternal));
}

}  // namespace

void track_clip(const ClipTask& task, TrackOptions options) {
    if (task.settings.method == Method::kOpenCv) return track_by_opencv(options, task.out);
    if (task.settings.method == Method::kStill) return leave_points(options, task.out);
    options.out = task.out.string();
    options.config = task.settings.config;
    options.backend = task.settings.backend;
    options.device = task.settings.device;
    options.threads = task.settings.threads;
    options.seed = task.settings.seed;
    options.recordings.overlay = options.recordings.report = false;
    options.quiet = true;
    const auto code = static_cast<ExitCode>(run_track(options));
    if (code == ExitCode::kOk || code == ExitCode::kNothingTracked) return;
    const nlohmann::json summary = read_summary(task.out);
    std::string notes;
    for (const auto& note : summary["notes"])
        notes.append(notes.empty() ? "" : " ").append(note.get<std::string>());
    throw CliError(code, notes.empty() ? "tracking ended early." : notes);
}

std::vector<double> frame_times_in(const fs::path& out) {
    std::vector<double> times;
    std::error_code error;
    const fs::path frames = out / "frames.csv";
    CsvReader csv(fs::exists(frames, error) ? frames : out / kFrameTimesFile, {"frame_ms"});
    while (csv.next()) times.push_back(csv.number(0));
    return times;
}

void set_times(const fs::path& out, ClipScore& score) {
    const std::vector<double> times = frame_times_in(out);
    score.frames = static_cast<std::int64_t>(times.size());
    score.frame_ms = frame_times_of(times);
}

std::string state_of(const fs::path& out, std::int64_t frame) {
    std::error_code error;
    if (!fs::exists(out / "frames.csv", error)) return {};
    CsvReader csv(out / "frames.csv", {"frame", "state", "reasons"});
    while (csv.next()) {
        if (csv.integer(0) != frame) continue;
        std::string state(csv.field(1));
        if (!csv.is_empty(2)) state += " (" + std::string(csv.field(2)) + ")";
        return state;
    }
    return {};
}

std::string picture_of(const SourceOptions& source, std::int64_t frame,
                       const std::vector<MarkedPoint>& points) {
    constexpr int kMaxWidth = 480, kRadius = 4, kQuality = 80;
    SourceOptions options = source;
    options.range = {frame, frame + 1};
    FrameSource reader(options);
    StereoFrame pair;
    if (!reader.next(pair)) return {};
    const cv::Mat left = mat_of(pair.left);
    const double scale = std::min(1.0, static_cast<double>(kMaxWidth) / left.cols);
    cv::Mat picture;
    cv::resize(left, picture, {}, scale, scale, cv::INTER_AREA);
    if (picture.channels() == 1) cv::cvtColor(picture, picture, cv::COLOR_GRAY2BGR);
    const cv::Scalar green(80, 220, 60), red(60, 60, 255), blue(255, 180, 60);
    for (const MarkedPoint& point : points) {
        // The centre of a pixel stays where it is in the scene.
        const auto place = [&](double u, double v) {
            return cv::Point(static_cast<int>(std::lround((u + 0.5) * scale - 0.5)),
                             static_cast<int>(std::lround((v + 0.5) * scale - 0.5)));
        };
        if (!std::isfinite(point.true_u) || !std::isfinite(point.true_v)) continue;
        const cv::Point true_place = place(point.true_u, point.true_v);
        const bool is_found = std::isfinite(point.found_u) && std::isfinite(point.found_v);
        if (is_found)
            cv::line(picture, true_place, place(point.found_u, point.found_v), blue, 1,
                     cv::LINE_AA);
        cv::circle(picture, true_place, kRadius, is_found ? green : red, 1, cv::LINE_AA);
    }
    std::vector<unsigned char> bytes;
    cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality});
    return {bytes.begin(), bytes.end()};
}

}  // namespace defrec::cli
