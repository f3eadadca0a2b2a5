// STIR 2026: points with visibility in many frames of a video, in 2D and 3D.
#include <algorithm>
#include <cmath>
#include <map>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/evaluation/data_sets/json_file.hpp"
#include "sdk/evaluation/data_sets/point_tracks.hpp"
#include "sdk/evaluation/data_sets/stir_2026_metrics.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr char kAnnotations[] = "annotations.json", kCalibration[] = "calib.json";
constexpr char kMono[] = "mono/preds.json", kStereo[] = "stereo/preds.json";
constexpr char kUsualVideos[] = "left.mp4,right.mp4";
constexpr double kMillimetresPerMetre = 1000;
constexpr std::array<double, 5> kThresholds{2, 4, 8, 16, 32};
constexpr std::size_t kWarmUpFrames = 11;  // that count in no latency

enum Column { kFrame, kVisibleLeft, kVisibleBoth, kSaidVisible, kErrorPx, kErrorMm };

struct TruePoint {
    cv::Point2d px;
    cv::Point3d mm;
    bool in_left = false, in_both = false;
};
using Truth = std::map<std::int64_t, std::vector<TruePoint>>;  // by frame

StereoCalibration read_calibration(const fs::path& path) {
    const Json json = read_json_object(path, "K_left, K_right, R_left_to_right and so on",
                                       ExitCode::kCalibration);
    StereoCalibration rig;
    rig.left = camera_of(path, json, "K_left", "D_left");
    rig.right = camera_of(path, json, "K_right", "D_right");
    set_pose(path, json, "R_left_to_right", "t_left_to_right", rig);
    detail::check_and_normalise(rig, LengthUnit::kMetre, LengthUnit::kMetre);
    return rig;
}

// The numbers, or booleans, under `name`.
std::vector<double> array_of(const fs::path& path, const std::string& key, const Json& annotation,
                             const char* name) {
    std::vector<double> values;
    const bool is_array =
        annotation.is_object() && annotation.contains(name) && annotation[name].is_array();
    for (const Json& value : is_array ? annotation[name] : Json::array()) {
        if (value.is_boolean())
            values.push_back(value.get<bool>() ? 1 : 0);
        else if (value.is_number())
            values.push_back(value.get<double>());
        else
            values.push_back(kNoPlace);
    }
    if (is_array) return values;
    throw CliError(ExitCode::kInput,
                   path.string() + ": " + key + ": an array " + name + " was expected.");
}

std::vector<TruePoint> points_of(const fs::path& path, const std::string& key,
                                 const Json& annotation, const StereoCalibration& rig) {
    const auto x = array_of(path, key, annotation, "left_x");
    const auto y = array_of(path, key, annotation, "left_y");
    const auto disparity = array_of(path, key, annotation, "disparity");
    const auto left = array_of(path, key, annotation, "left_visibility");
    const auto right = array_of(path, key, annotation, "right_visibility");
    for (const auto* values : {&y, &disparity, &left, &right}) {
        if (values->size() == x.size()) continue;
        throw CliError(ExitCode::kInput, path.string() + ": " + key +
                                             ": arrays of the same length were expected; there "
                                             "are " +
                                             std::to_string(x.size()) + " and " +
                                             std::to_string(values->size()) + " numbers.");
    }
    constexpr double kMinDisparity = 1e-6;
    std::vector<TruePoint> points;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double z = rig.left.fx * -rig.translation[0] / std::max(disparity[i], kMinDisparity);
        points.push_back(
            {{x[i], y[i]},
             {(x[i] - rig.left.cx) * z / rig.left.fx, (y[i] - rig.left.cy) * z / rig.left.fy, z},
             left[i] != 0,
             left[i] != 0 && right[i] != 0});
    }
    return points;
}

Truth read_truth(const fs::path& path, const StereoCalibration& rig) {
    const Json json = read_json_object(path, "\"frame/instance\" as its keys", ExitCode::kInput);
    Truth truth;
    for (const auto& [key, annotation] : json.items()) {
        const std::vector<std::string_view> parts = split(key, '/');
        const auto frame = parse_integer(parts.front());
        const auto instance = parse_integer(parts.back());
        if (parts.size() != 2 || !frame || !instance || *frame < 0) {
            throw CliError(ExitCode::kInput, path.string() + ": " + key +
                                                 ": keys like \"0/0\", frame and instance, were "
                                                 "expected.");
        }
        if (*instance == 0) truth[*frame] = points_of(path, key, annotation, rig);
    }
    const auto first = truth.find(0);
    if (first == truth.end() || first->second.empty()) {
        throw CliError(ExitCode::kInput,
                       path.string() + ": 0/0, the points that are to be tracked, was expected.");
    }
    for (const auto& [frame, points] : truth) {
        if (points.size() == first->second.size()) continue;
        throw CliError(ExitCode::kInput, path.string() + ": frame " + std::to_string(frame) +
                                             " has " + std::to_string(points.size()) + " points; " +
                                             std::to_string(first->second.size()) +
                                             " were expected, as in frame 0.");
    }
    return truth;
}

// Each point of a frame as it is predicted: where it is, else where it was seen last.
struct Predicted {
    cv::Point2d px;
    cv::Point3d mm;
    bool said_visible = false;
};
std::vector<Predicted> predictions_of(const PointTracks& tracks, std::int64_t frame,
                                      const std::vector<TruePoint>& start) {
    std::vector<Predicted> points;
    for (std::size_t i = 0; i < start.size(); ++i) {
        const FoundPoint found = tracks.last_known(frame, i);
        points.push_back({std::isfinite(found.px.x) ? found.px : start[i].px,
                          found.has_place() ? found.mm : cv::Point3d(),
                          tracks.at(frame, i).is_tracked});
    }
    return points;
}

void write_predictions(const ClipTask& task, const std::string& sequence, const PointTracks& tracks,
                       const std::vector<TruePoint>& start) {
    const std::vector<double> times = frame_times_in(task.out);
    std::string mono = json_text(Json(sequence)).insert(0, 1, '{').append(":{");
    std::string stereo = mono;
    for (std::int64_t frame = 0; frame <= tracks.last(); ++frame) {
        std::string coords, coords3d, visibilities;
        for (const Predicted& point : predictions_of(tracks, frame, start)) {
            const char* comma = coords.empty() ? "" : ",";
            coords.append(comma).append(json_of(point.px));
            coords3d.append(comma).append(json_of(point.mm * (1 / kMillimetresPerMetre)));
            visibilities.append(comma).append(point.said_visible ? "true" : "false");
        }
        const std::string rest = "],\"visibilities\":[" + visibilities + "],\"latency_ms\":" +
                                 exact(times.at(static_cast<std::size_t>(frame))) + "}";
        const std::string begin =
            (frame > 0 ? ",\"" : "\"") + std::to_string(frame) + "\":{\"coords\":[";
        mono.append(begin).append(coords).append(rest);
        stereo.append(begin).append(coords3d).append(rest);
    }
    for (const auto& [file, text] : {std::pair(kMono, mono), std::pair(kStereo, stereo)}) {
        create_output_folder((task.out / file).parent_path());
        write_atomically(task.out / file, text + "}}\n");
    }
}

std::vector<VisiblePoint> points_in(const Samples& samples, Column visible, Column error) {
    std::vector<VisiblePoint> points;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        points.push_back(
            {samples.at(i, visible) != 0, samples.at(i, kSaidVisible) != 0, samples.at(i, error)});
    }
    return points;
}

class Stir2026 : public DataSet {
  public:
    std::string name() const override { return "stir-2026"; }
    std::string summary() const override {
        return "STIR 2026: points with visibility in many frames, in 2D and 3D";
    }
    std::string layout() const override {
        return "SEQ/ with annotations.json, calib.json and the videos that --video names "
               "(left.mp4,right.mp4)";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::exists(folder / kAnnotations, error);
    }
    std::vector<std::string> prediction_files() const override { return {kMono, kStereo}; }

    std::vector<std::string> sample_columns() const override {
        return {"frame", "visible_left", "visible_both", "said_visible", "error_px", "error_mm"};
    }
    std::vector<Metric> metrics() const override {
        std::vector<Metric> metrics;
        for (const std::string unit : {"px", "mm"}) {
            metrics.push_back({"average_jaccard_" + unit, true});
            metrics.push_back({"average_accuracy_" + unit, true});
            metrics.push_back({"occlusion_accuracy_" + unit, true});
            for (const char* name : {"jaccard_", "accuracy_"})
                for (const double threshold : kThresholds)
                    metrics.push_back({name + format_fixed(threshold, 0) + "_" + unit, true});
        }
        return metrics;
    }
    std::vector<double> summarise(const Samples& samples) const override {
        std::vector<double> values;
        for (const auto& [visible, error] :
             {std::pair(kVisibleLeft, kErrorPx), std::pair(kVisibleBoth, kErrorMm)}) {
            const TrackingScores scores = tracking_scores(points_in(samples, visible, error));
            values.insert(values.end(), {scores.average_jaccard, scores.average_accuracy,
                                         scores.occlusion_accuracy});
            values.insert(values.end(), scores.jaccard.begin(), scores.jaccard.end());
            values.insert(values.end(), scores.accuracy.begin(), scores.accuracy.end());
        }
        return values;
    }

    ClipScore run(const ClipTask& task) const override {
        const std::string names = task.settings.video.empty() ? kUsualVideos : task.settings.video;
        const std::vector<std::string_view> videos = split(names, ',');
        if (videos.size() != 2) {
            throw CliError(ExitCode::kUsage, "--video: '" + names +
                                                 "' was given; two names were expected, as in " +
                                                 kUsualVideos + ".");
        }
        const std::string left(videos[0]), right(videos[1]);
        require_entries(task.folder, {{kCalibration, "K_left, K_right and so on"},
                                      {kAnnotations, "the points of each frame"},
                                      {left, "the left video; --video names others"},
                                      {right, "the right video; --video names others"}});
        PointClip clip;
        clip.calibration = read_calibration(task.folder / kCalibration);
        const Truth truth = read_truth(task.folder / kAnnotations, clip.calibration);
        const std::vector<TruePoint>& start = truth.at(0);
        for (const TruePoint& point : start) clip.points.push_back(point.px);
        clip.source.left = (task.folder / left).string();
        clip.source.right = (task.folder / right).string();
        const PointTracks tracks(task, clip);
        if (truth.rbegin()->first > tracks.last()) {
            throw CliError(ExitCode::kInput, (task.folder / kAnnotations).string() + ": frame " +
                                                 std::to_string(truth.rbegin()->first) +
                                                 " is annotated; the video's last one is " +
                                                 std::to_string(tracks.last()) + ".");
        }
        write_predictions(task, task.folder.filename().string(), tracks, start);
        return score(task, clip, tracks, truth);
    }

  private:
    ClipScore score(const ClipTask& task, const PointClip& clip, const PointTracks& tracks,
                    const Truth& truth) const {
        ClipScore score{Samples(sample_columns()), 0, {}, {}, {}};
        set_times(task.out, score);
        std::vector<double> times = frame_times_in(task.out);
        times.erase(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(
                                                       std::min(kWarmUpFrames, times.size())));
        if (!times.empty()) score.frame_ms = frame_times_of(times);

        double worst = -1;
        std::int64_t worst_frame = 0;
        std::vector<MarkedPoint> marked;
        for (const auto& [frame, points] : truth) {
            if (frame == 0) continue;  // it gives the points
            const std::vector<Predicted> predicted = predictions_of(tracks, frame, truth.at(0));
            Samples of_frame(sample_columns());
            std::vector<MarkedPoint> marks;
            for (std::size_t i = 0; i < points.size(); ++i) {
                of_frame.add({static_cast<double>(frame), points[i].in_left ? 1.0 : 0.0,
                              points[i].in_both ? 1.0 : 0.0, predicted[i].said_visible ? 1.0 : 0.0,
                              cv::norm(points[i].px - predicted[i].px),
                              cv::norm(points[i].mm - predicted[i].mm)});
                const cv::Point2d found =
                    predicted[i].said_visible ? predicted[i].px : cv::Point2d(kNoPlace, kNoPlace);
                if (points[i].in_left)
                    marks.push_back({points[i].px.x, points[i].px.y, found.x, found.y});
            }
            const double loss =
                1 - tracking_scores(points_in(of_frame, kVisibleLeft, kErrorPx)).average_jaccard;
            score.samples.append(of_frame);
            if (loss <= worst) continue;
            worst = loss;
            worst_frame = frame;
            marked = std::move(marks);
        }
        if (worst < 0) return score;
        score.picture = picture_of(clip.source, worst_frame, marked);
        score.remark = "frame " + std::to_string(worst_frame) + ": average Jaccard " +
                       format_fixed(1 - worst, 3);
        const std::string state = state_of(task.out, worst_frame);
        if (!state.empty()) score.remark += "; " + state;
        return score;
    }
};

}  // namespace

TrackingScores tracking_scores(const std::vector<VisiblePoint>& points) {
    TrackingScores scores;
    const auto share = [](std::size_t part, std::size_t whole) {
        return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
    };
    std::size_t visible = 0, right = 0;
    for (const VisiblePoint& point : points) {
        visible += point.is_visible ? 1 : 0;
        right += point.is_visible == point.said_visible ? 1 : 0;
    }
    for (std::size_t i = 0; i < kThresholds.size(); ++i) {
        std::size_t within = 0, true_positive = 0, false_positive = 0;
        for (const VisiblePoint& point : points) {
            const bool is_within = point.is_visible && point.error < kThresholds[i];
            within += is_within ? 1 : 0;
            true_positive += is_within && point.said_visible ? 1 : 0;
            false_positive += point.said_visible && !is_within ? 1 : 0;
        }
        // Visible points are true positives or false negatives.
        scores.jaccard[i] = share(true_positive, visible + false_positive);
        scores.accuracy[i] = share(within, visible);
        scores.average_jaccard += scores.jaccard[i] / kThresholds.size();
        scores.average_accuracy += scores.accuracy[i] / kThresholds.size();
    }
    scores.occlusion_accuracy = share(right, points.size());
    return scores;
}

std::unique_ptr<DataSet> make_stir_2026() { return std::make_unique<Stir2026>(); }

}  // namespace defrec::cli
