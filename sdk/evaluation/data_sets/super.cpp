// SuPer: points in the left images of a sequence, in 2D.
#include <algorithm>
#include <cmath>
#include <map>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/evaluation/data_sets/json_file.hpp"
#include "sdk/evaluation/data_sets/point_tracks.hpp"
#include "sdk/input/image_stream.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr char kTruth[] = "rgb/left_pts.json", kCalibration[] = "calibration.yaml";
constexpr char kPoints[] = "tracked_points.json";

enum Column { kFrame, kPoint, kFound, kErrorPx };

struct Label {
    cv::Point2d px;
    bool is_valid = false;
};
using Labels = std::map<std::int64_t, std::vector<Label>>;  // by the number in the images' names

std::vector<Label> labels_of(const fs::path& path, const std::string& key, const Json& rows) {
    const auto is_label = [](const Json& row) {
        return row.is_array() && row.size() == 3 &&
               std::all_of(row.begin(), row.end(),
                           [](const Json& item) { return item.is_number(); });
    };
    if (!rows.is_array() || !std::all_of(rows.begin(), rows.end(), is_label)) {
        throw CliError(ExitCode::kInput,
                       path.string() + ": " + key + ": rows [u, v, valid] were expected.");
    }
    std::vector<Label> labels;
    for (const Json& row : rows) {
        labels.push_back({{row[0].get<double>(), row[1].get<double>()}, row[2].get<double>() == 1});
    }
    return labels;
}

Labels read_labels(const fs::path& path) {
    const Json json = read_json_object(path, "\"gt\"", ExitCode::kInput);
    if (!json.contains("gt") || !json["gt"].is_object() || json["gt"].empty()) {
        throw CliError(ExitCode::kInput,
                       path.string() + ": \"gt\", labels by the images' numbers, was expected.");
    }
    Labels labels;
    for (const auto& [key, rows] : json["gt"].items()) {
        const auto number = parse_integer(key);
        if (!number || *number < 0) {
            throw CliError(ExitCode::kInput,
                           path.string() + ": " + key +
                               ": the number of an image was expected as key, like 000010.");
        }
        labels[*number] = labels_of(path, key, rows);
        if (labels[*number].size() == labels.begin()->second.size()) continue;
        throw CliError(ExitCode::kInput, path.string() + ": " + key +
                                             ": as many points as in the other images were "
                                             "expected.");
    }
    return labels;
}

// Which of the sequence's frames the image of a number is.
std::map<std::int64_t, std::int64_t> frames_by_number(const std::string& pattern) {
    std::map<std::int64_t, std::int64_t> frames;
    const auto images = ImageStream::open(pattern);
    for (const fs::path& file : images->files()) {
        const std::string name = file.filename().string();
        const auto number = parse_integer(name.substr(0, name.find('-')));
        if (number) frames.emplace(*number, static_cast<std::int64_t>(frames.size()));
    }
    return frames;
}

std::int64_t frame_of(const std::map<std::int64_t, std::int64_t>& frames, std::int64_t number,
                      const fs::path& truth) {
    const auto found = frames.find(number);
    if (found != frames.end()) return found->second;
    throw CliError(ExitCode::kInput, truth.string() + ": image " + std::to_string(number) +
                                         " is labelled; rgb/ has none of this number.");
}

class SuPer : public DataSet {
  public:
    std::string name() const override { return "super"; }
    bool has_units() const override { return true; }
    std::string summary() const override { return "SuPer: points in 2D in some of the frames"; }
    std::string layout() const override {
        return "a folder with rgb/000000-left.png and -right.png, rgb/left_pts.json, which "
               "scripts/convert_super_truth.py makes of left_pts.npy, and calibration.yaml";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::exists(folder / "rgb" / "left_pts.npy", error) ||
               fs::exists(folder / kTruth, error);
    }
    std::vector<std::string> prediction_files() const override { return {kPoints}; }

    std::vector<std::string> sample_columns() const override {
        return {"frame", "point", "found", "error_px"};
    }
    std::vector<Metric> metrics() const override {
        return {{"mean_px"}, {"std_px"}, {"found_share", true}};
    }
    std::vector<double> summarise(const Samples& samples) const override {
        // A row that is not in the order of frame and point begins a clip.
        std::vector<std::map<double, std::vector<double>>> clips;
        double found = 0;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            const auto key = [&](std::size_t row) {
                return std::pair(samples.at(row, kFrame), samples.at(row, kPoint));
            };
            if (i == 0 || key(i) <= key(i - 1)) clips.emplace_back();
            clips.back()[samples.at(i, kPoint)].push_back(samples.at(i, kErrorPx));
            found += samples.at(i, kFound);
        }
        double mean = 0, deviation = 0, points = 0;
        for (const auto& clip : clips) {
            for (const auto& [point, errors] : clip) {
                const auto count = static_cast<double>(errors.size());
                double sum = 0, squares = 0;
                for (const double error : errors) sum += error;
                for (const double error : errors)
                    squares += (error - sum / count) * (error - sum / count);
                mean += sum / count;
                deviation += std::sqrt(squares / count);
                ++points;
            }
        }
        if (points == 0) return {kNoPlace, kNoPlace, kNoPlace};
        return {mean / points, deviation / points, found / static_cast<double>(samples.size())};
    }

    ClipScore run(const ClipTask& task) const override {
        require_entries(task.folder,
                        {{kTruth, "made of left_pts.npy by scripts/convert_super_truth.py"},
                         {kCalibration, "OpenCV stereo YAML of the images, M1 M2 R T in mm"}});
        PointClip clip;
        clip.calibration =
            load_calibration((task.folder / kCalibration).string(), task.settings.units);
        clip.source.left = (task.folder / "rgb" / "%06d-left.png").string();
        clip.source.right = (task.folder / "rgb" / "%06d-right.png").string();
        const Labels labels = read_labels(task.folder / kTruth);
        const auto frames = frames_by_number(clip.source.left);
        std::vector<std::size_t> followed;  // those that the first labelled image shows
        const auto& [first, start] = *labels.begin();
        for (std::size_t i = 0; i < start.size(); ++i) {
            if (!start[i].is_valid) continue;
            followed.push_back(i);
            clip.points.push_back(start[i].px);
        }
        if (followed.empty()) {
            throw CliError(ExitCode::kInput, (task.folder / kTruth).string() + ": image " +
                                                 std::to_string(first) +
                                                 " is the first; a valid label was expected.");
        }
        clip.source.range.first = frame_of(frames, first, task.folder / kTruth);
        clip.source.range.last = frame_of(frames, labels.rbegin()->first, task.folder / kTruth) + 1;
        {
            const FrameSource source(clip.source);
            fit_to_frames(clip.calibration, source.width(), source.height());
        }
        const PointTracks tracks(task, clip);
        return score(task, clip, tracks, labels, frames, followed);
    }

  private:
    ClipScore score(const ClipTask& task, const PointClip& clip, const PointTracks& tracks,
                    const Labels& labels, const std::map<std::int64_t, std::int64_t>& frames,
                    const std::vector<std::size_t>& followed) const {
        ClipScore score{Samples(sample_columns()), 0, {}, {}, {}};
        set_times(task.out, score);
        nlohmann::ordered_json predictions = nlohmann::ordered_json::object();
        double worst = -1;
        std::int64_t worst_frame = 0;
        std::vector<MarkedPoint> marked;
        for (const auto& [number, of_image] : labels) {
            const std::int64_t frame = frame_of(frames, number, task.folder / kTruth);
            nlohmann::ordered_json rows = nlohmann::ordered_json::array();
            for (std::size_t i = 0; i < of_image.size(); ++i) rows.push_back({0, 0, 0});
            std::vector<MarkedPoint> marks;
            double sum = 0;
            for (std::size_t k = 0; k < followed.size(); ++k) {
                const FoundPoint last = tracks.last_known(frame, k);
                const cv::Point2d px = std::isfinite(last.px.x) ? last.px : clip.points[k];
                const bool is_found = tracks.at(frame, k).has_place();
                rows[followed[k]] = {px.x, px.y, is_found ? 1 : 0};
                const Label& label = of_image[followed[k]];
                if (!label.is_valid || number == labels.begin()->first) continue;
                const double error = cv::norm(label.px - px);
                score.samples.add({static_cast<double>(number), static_cast<double>(followed[k]),
                                   is_found ? 1.0 : 0.0, error});
                sum += error;
                marks.push_back({label.px.x, label.px.y, is_found ? px.x : kNoPlace,
                                 is_found ? px.y : kNoPlace});
            }
            std::string key = std::to_string(number);
            key.insert(0, 6 - std::min<std::size_t>(6, key.size()), '0');
            predictions[key] = std::move(rows);
            if (marks.empty() || sum / static_cast<double>(marks.size()) <= worst) continue;
            worst = sum / static_cast<double>(marks.size());
            worst_frame = frame;
            marked = std::move(marks);
        }
        const nlohmann::ordered_json whole = {
            {fs::absolute(task.folder).lexically_normal().filename().string(), predictions}};
        write_atomically(task.out / kPoints, json_text(whole) + "\n");
        if (worst < 0) return score;
        score.picture = picture_of(clip.source, worst_frame, marked);
        score.remark = "frame " + std::to_string(worst_frame) + ": mean error " +
                       format_fixed(worst, 2) + " px";
        const std::string state = state_of(task.out, worst_frame);
        if (!state.empty()) score.remark += "; " + state;
        return score;
    }
};

}  // namespace

std::unique_ptr<DataSet> make_super() { return std::make_unique<SuPer>(); }

}  // namespace defrec::cli
