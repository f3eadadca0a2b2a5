// StereoMIS: the trajectory of the camera.
#include <algorithm>
#include <cmath>
#include <map>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/base/util/median.hpp"
#include "sdk/evaluation/data_sets/point_tracks.hpp"
#include "sdk/evaluation/data_sets/trajectory_metrics.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kCalibration[] = "StereoCalibration.ini", kTruth[] = "groundtruth.txt";
constexpr char kTestSplit[] = "test_split.csv", kTrainSplit[] = "train_split.csv";
constexpr double kMillimetresPerMetre = 1000;

enum Column { kSegment, kFrame, kPosed, kErrorMm, kMotionMm, kMotionDegrees };

// [section], then key=value, as Python's configparser reads it.
class IniFile {
  public:
    explicit IniFile(const fs::path& path) : path_(path.string()) {
        constexpr std::size_t kLargestFile = 1'000'000;
        const std::string text = read_text_file(path, kLargestFile, ExitCode::kCalibration);
        std::string section;
        for (const std::string_view line : split(text, '\n')) {
            const std::string_view content = trim(line);
            if (content.empty() || content.front() == '#' || content.front() == ';') continue;
            if (content.front() == '[' && content.back() == ']') {
                section = content.substr(1, content.size() - 2);
                continue;
            }
            const std::size_t end = content.find_first_of("=:");
            if (end == std::string_view::npos) continue;
            values_[section + "/" + std::string(trim(content.substr(0, end)))] =
                trim(content.substr(end + 1));
        }
    }

    double number(const std::string& section, const std::string& key) const {
        const auto found = values_.find(section + "/" + key);
        const auto value = found == values_.end() ? std::nullopt : parse_double(found->second);
        if (value && std::isfinite(*value)) return *value;
        throw CliError(ExitCode::kCalibration,
                       path_ + ": [" + section + "]: " + key + ", a number, was expected.");
    }
    CameraCalibration camera(const std::string& section) const {
        constexpr int kCoefficients = 8;
        CameraCalibration camera;
        camera.fx = number(section, "fc_x");
        camera.fy = number(section, "fc_y");
        camera.cx = number(section, "cc_x");
        camera.cy = number(section, "cc_y");
        for (int i = 0; i < kCoefficients; ++i)
            camera.distortion.push_back(number(section, "kc_" + std::to_string(i)));
        camera.matrix_origin = path_ + ": [" + section + "]: fc_x to cc_y";
        camera.distortion_origin = path_ + ": [" + section + "]: kc_0 to kc_7";
        return camera;
    }

  private:
    std::string path_;
    std::map<std::string, std::string> values_;
};

StereoCalibration read_calibration(const fs::path& path) {
    const IniFile file(path);
    StereoCalibration rig;
    rig.width = static_cast<int>(file.number("StereoLeft", "res_x"));
    rig.height = static_cast<int>(file.number("StereoLeft", "res_y"));
    rig.left = file.camera("StereoLeft");
    rig.right = file.camera("StereoRight");
    for (std::size_t i = 0; i < rig.rotation.size(); ++i)
        rig.rotation[i] = file.number("StereoRight", "R_" + std::to_string(i));
    for (std::size_t i = 0; i < rig.translation.size(); ++i)
        rig.translation[i] = file.number("StereoRight", "T_" + std::to_string(i));
    rig.size_origin = path.string() + ": [StereoLeft]: res_x, res_y";
    rig.rotation_origin = path.string() + ": [StereoRight]: R_0 to R_8";
    rig.translation_origin = path.string() + ": [StereoRight]: T_0 to T_2";
    detail::check_and_normalise(rig, LengthUnit::kMillimetre, LengthUnit::kMillimetre);
    return rig;
}

cv::Matx33d rotation_of(double x, double y, double z, double w) {
    const double norm = std::sqrt(x * x + y * y + z * z + w * w);
    x /= norm;
    y /= norm;
    z /= norm;
    w /= norm;
    return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
            2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

// x, y, z, w with w at least 0.
cv::Vec4d quaternion_of(const cv::Matx33d& r) {
    // The component whose square is largest is worked out first.
    const double squares[4] = {1 + r(0, 0) - r(1, 1) - r(2, 2), 1 - r(0, 0) + r(1, 1) - r(2, 2),
                               1 - r(0, 0) - r(1, 1) + r(2, 2), 1 + r(0, 0) + r(1, 1) + r(2, 2)};
    const auto largest =
        static_cast<int>(std::max_element(squares, squares + 4) - std::begin(squares));
    const cv::Vec4d rows[4] = {
        {squares[0], r(0, 1) + r(1, 0), r(0, 2) + r(2, 0), r(2, 1) - r(1, 2)},
        {r(0, 1) + r(1, 0), squares[1], r(1, 2) + r(2, 1), r(0, 2) - r(2, 0)},
        {r(0, 2) + r(2, 0), r(1, 2) + r(2, 1), squares[2], r(1, 0) - r(0, 1)},
        {r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1), squares[3]}};
    const cv::Vec4d quaternion = rows[largest] / cv::norm(rows[largest]);
    return quaternion[3] < 0 ? -quaternion : quaternion;
}

// A pose for each frame: its lines, without comments.
std::vector<Pose> read_truth(const fs::path& path) {
    constexpr std::size_t kLargestFile = 1'000'000'000, kFields = 8;
    const std::string text = read_text_file(path, kLargestFile, ExitCode::kInput);
    std::vector<Pose> poses;
    int number = 0;
    for (const std::string_view line : split(text, '\n')) {
        ++number;
        if (trim(line).empty() || line.front() == '#') continue;
        std::string spaced(line);
        std::replace_if(
            spaced.begin(), spaced.end(), [](char c) { return c == ',' || c == '\t' || c == '\r'; },
            ' ');
        std::vector<double> values;
        for (const std::string_view field : split(spaced, ' ')) {
            if (field.empty()) continue;
            values.push_back(parse_double(field).value_or(kNoPlace));
        }
        const bool is_complete = values.size() == kFields &&
                                 std::all_of(values.begin(), values.end(),
                                             [](double value) { return std::isfinite(value); });
        if (!is_complete ||
            (values[4] == 0 && values[5] == 0 && values[6] == 0 && values[7] == 0)) {
            throw CliError(ExitCode::kInput,
                           path.string() + ":" + std::to_string(number) +
                               ": t tx ty tz qx qy qz qw, positions in m, were expected.");
        }
        poses.push_back({rotation_of(values[4], values[5], values[6], values[7]),
                         kMillimetresPerMetre * cv::Vec3d(values[1], values[2], values[3])});
    }
    if (!poses.empty()) return poses;
    throw CliError(ExitCode::kInput, path.string() + ": a pose for each frame was expected.");
}

// The frames that are tracked as one: first .. last - 1.
std::vector<FrameRange> segments_of(const fs::path& folder) {
    for (const char* name : {kTestSplit, kTrainSplit}) {
        std::error_code error;
        if (!fs::exists(folder / name, error)) continue;
        std::vector<FrameRange> segments;
        CsvReader csv(folder / name, {"start", "end"});
        while (csv.next()) {
            if (csv.integer(0) < 0 || csv.integer(1) <= csv.integer(0))
                csv.fail("a start of at least 0 and an end after it were expected.");
            segments.push_back({csv.integer(0), csv.integer(1)});
        }
        if (segments.empty()) csv.fail("lines with start and end were expected.");
        return segments;
    }
    return {FrameRange{}};
}

// The one video in the folder.
fs::path video_in(const fs::path& folder) {
    std::vector<fs::path> videos;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".mp4") videos.push_back(entry.path());
    if (videos.size() == 1) return videos.front();
    throw CliError(ExitCode::kInput, folder.string() +
                                         ": one file *.mp4, a video of both views, the left one on "
                                         "top, was expected; there are " +
                                         std::to_string(videos.size()) + ".");
}

std::vector<cv::Point2d> grid(const StereoCalibration& rig) {
    constexpr int kColumns = 20, kRows = 15;
    constexpr double kMargin = 0.05;  // of the image, on each side
    std::vector<cv::Point2d> points;
    for (int row = 0; row < kRows; ++row)
        for (int column = 0; column < kColumns; ++column) {
            const double across = kMargin + (1 - 2 * kMargin) * column / (kColumns - 1.0);
            const double down = kMargin + (1 - 2 * kMargin) * row / (kRows - 1.0);
            points.emplace_back(across * (rig.width - 1), down * (rig.height - 1));
        }
    return points;
}

// The rigid motion that most points follow: reweighted by the scale of their distances from it
// (Geman and McClure's weights).
Pose robust_fit(const std::vector<cv::Vec3d>& from, const std::vector<cv::Vec3d>& to) {
    constexpr int kIterations = 20;
    constexpr double kSigmaPerMedian = 1.4826, kMinScale = 0.1;  // mm
    std::vector<double> weights(from.size(), 1), distances(from.size());
    Pose pose;
    for (int i = 0; i < kIterations; ++i) {
        pose = rigid_fit(from, to, weights);
        for (std::size_t k = 0; k < from.size(); ++k)
            distances[k] = cv::norm(pose.rotation * from[k] + pose.position - to[k]);
        const double scale = std::max(kMinScale, kSigmaPerMedian * median(distances));
        for (std::size_t k = 0; k < from.size(); ++k) {
            const double ratio = distances[k] / scale;
            weights[k] = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
        }
    }
    return pose;
}

// Poses of the camera, in that of the first frame, by the tissue that both show. Frames with too
// little of it have the pose before.
struct TrackedPoses {
    std::vector<Pose> poses;
    std::vector<bool> is_posed;
};
TrackedPoses poses_of(const PointTracks& tracks, std::size_t points) {
    constexpr std::size_t kMinPoints = 10;
    TrackedPoses tracked;
    for (std::int64_t frame = tracks.first(); frame <= tracks.last(); ++frame) {
        std::vector<cv::Vec3d> start, now;
        for (std::size_t i = 0; i < points; ++i) {
            const FoundPoint& before = tracks.at(tracks.first(), i);
            const FoundPoint& found = tracks.at(frame, i);
            if (!before.has_place() || !found.has_place() || !found.is_tracked) continue;
            start.emplace_back(before.mm);
            now.emplace_back(found.mm);
        }
        const bool is_posed = start.size() >= kMinPoints;
        if (is_posed)
            tracked.poses.push_back(robust_fit(now, start));
        else
            tracked.poses.push_back(tracked.poses.empty() ? Pose() : tracked.poses.back());
        tracked.is_posed.push_back(is_posed);
    }
    return tracked;
}

void write_trajectory(const fs::path& path, const std::vector<Pose>& poses, std::int64_t first) {
    std::string text;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        text += std::to_string(first + static_cast<std::int64_t>(i));
        const cv::Vec3d position = poses[i].position * (1 / kMillimetresPerMetre);
        const cv::Vec4d quaternion = quaternion_of(poses[i].rotation);
        for (const double value : {position[0], position[1], position[2], quaternion[0],
                                   quaternion[1], quaternion[2], quaternion[3]})
            text.append(" ").append(exact(value));
        text += '\n';
    }
    write_atomically(path, text);
}

class StereoMis : public DataSet {
  public:
    std::string name() const override { return "stereomis"; }
    std::string summary() const override { return "StereoMIS: the camera's trajectory"; }
    std::string layout() const override {
        return "SEQ/ with one *.mp4 (left on top), StereoCalibration.ini, groundtruth.txt and, "
               "where only parts count, test_split.csv or train_split.csv";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::exists(folder / kCalibration, error);
    }

    std::vector<std::string> sample_columns() const override {
        return {"segment", "frame", "posed", "error_mm", "motion_mm", "motion_deg"};
    }
    std::vector<Metric> metrics() const override {
        return {{"ate_rmse_mm"}, {"rpe_trans_mm"}, {"rpe_rot_deg"}, {"posed_share", true}};
    }
    std::vector<double> summarise(const Samples& samples) const override {
        // Sums of each segment; the data set's tool takes the segments' mean.
        struct Sums {
            double frames = 0, squares = 0, posed = 0, motions = 0, mm = 0, degrees = 0;
        };
        std::vector<Sums> segments;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            if (i == 0 || samples.at(i, kSegment) != samples.at(i - 1, kSegment) ||
                samples.at(i, kFrame) <= samples.at(i - 1, kFrame))
                segments.emplace_back();
            Sums& sums = segments.back();
            ++sums.frames;
            sums.posed += samples.at(i, kPosed);
            sums.squares += samples.at(i, kErrorMm) * samples.at(i, kErrorMm);
            if (std::isnan(samples.at(i, kMotionMm))) continue;
            ++sums.motions;
            sums.mm += samples.at(i, kMotionMm);
            sums.degrees += samples.at(i, kMotionDegrees);
        }
        if (segments.empty()) return {kNoPlace, kNoPlace, kNoPlace, kNoPlace};
        double ate = 0, trans = 0, rot = 0, posed = 0;
        const auto count = static_cast<double>(segments.size());
        for (const Sums& sums : segments) {
            ate += std::sqrt(sums.squares / sums.frames) / count;
            trans += sums.mm / sums.motions / count;  // NaN for a segment of one frame
            rot += sums.degrees / sums.motions / count;
            posed += sums.posed / sums.frames / count;
        }
        return {ate, trans, rot, posed};
    }

    ClipScore run(const ClipTask& task) const override {
        require_entries(task.folder, {{kCalibration, "[StereoLeft] and [StereoRight]"},
                                      {kTruth, "t tx ty tz qx qy qz qw of each frame, in m"}});
        PointClip clip;
        clip.source.stereo = video_in(task.folder).string();
        clip.source.layout = Layout::kTopBottom;
        clip.calibration = read_calibration(task.folder / kCalibration);
        const std::vector<Pose> truth = read_truth(task.folder / kTruth);
        {
            const FrameSource source(clip.source);
            fit_to_frames(clip.calibration, source.width(), source.height());
        }
        clip.points = grid(clip.calibration);
        ClipScore score{Samples(sample_columns()), 0, {}, {}, {}};
        std::vector<double> times;
        Worst worst;
        for (const FrameRange& segment : segments_of(task.folder)) {
            clip.source.range = segment;
            ClipTask part = task;
            part.out = task.out / ("from_" + std::to_string(segment.first));
            create_output_folder(part.out);
            const PointTracks tracks(part, clip);
            const std::vector<double> of_part = frame_times_in(part.out);
            times.insert(times.end(), of_part.begin(), of_part.end());
            require_truth(task.folder / kTruth, truth.size(), tracks.last());
            const TrackedPoses tracked = poses_of(tracks, clip.points.size());
            write_trajectory(
                task.out / ("trajectory_" + std::to_string(segment.first) + ".freiburg"),
                tracked.poses, segment.first);
            add(score.samples, worst, segment, truth, tracked);
        }
        score.frames = static_cast<std::int64_t>(times.size());
        score.frame_ms = frame_times_of(times);
        if (worst.error_mm < 0) return score;
        clip.source.range = {};
        score.picture = picture_of(clip.source, worst.frame, {});
        score.remark = "frame " + std::to_string(worst.frame) + ": " +
                       format_fixed(worst.error_mm, 2) + " mm off";
        const std::string state =
            state_of(task.out / ("from_" + std::to_string(worst.first)), worst.frame);
        if (!state.empty()) score.remark += "; " + state;
        return score;
    }

  private:
    struct Worst {
        double error_mm = -1;
        std::int64_t frame = 0, first = 0;  // and that of its segment
    };

    static void require_truth(const fs::path& path, std::size_t poses, std::int64_t last) {
        if (static_cast<std::int64_t>(poses) > last) return;
        throw CliError(ExitCode::kInput, path.string() + ": a pose for each of the frames 0 to " +
                                             std::to_string(last) + " was expected; there are " +
                                             std::to_string(poses) + ".");
    }

    // Like the data set's tool without the first and the last frame of the truth.
    static void add(Samples& samples, Worst& worst, const FrameRange& segment,
                    const std::vector<Pose>& truth, const TrackedPoses& tracked) {
        std::vector<Pose> is, found;
        std::vector<std::size_t> places;
        for (std::size_t i = 0; i < tracked.poses.size(); ++i) {
            const std::size_t frame = static_cast<std::size_t>(segment.first) + i;
            if (frame == 0 || frame + 1 >= truth.size()) continue;
            is.push_back(truth[frame]);
            found.push_back(tracked.poses[i]);
            places.push_back(i);
        }
        const std::vector<double> errors = absolute_errors(is, found);
        const std::vector<MotionError> motions = relative_errors(is, found);
        for (std::size_t i = 0; i < places.size(); ++i) {
            const std::int64_t frame = segment.first + static_cast<std::int64_t>(places[i]);
            const MotionError motion =
                i < motions.size() ? motions[i] : MotionError{kNoPlace, kNoPlace};
            samples.add({static_cast<double>(segment.first), static_cast<double>(frame),
                         tracked.is_posed[places[i]] ? 1.0 : 0.0, errors[i], motion.mm,
                         motion.degrees});
            if (errors[i] > worst.error_mm) worst = {errors[i], frame, segment.first};
        }
    }
};

}  // namespace

std::unique_ptr<DataSet> make_stereomis() { return std::make_unique<StereoMis>(); }

}  // namespace defrec::cli
