// STIR 2024 and 2025: points marked by ICG in the first and the last frame of a clip.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/evaluation/data_sets/depth_meter.hpp"
#include "sdk/evaluation/data_sets/json_file.hpp"
#include "sdk/evaluation/data_sets/point_tracks.hpp"
#include "sdk/evaluation/data_sets/stir_metrics.hpp"
#include "sdk/evaluation/score/percentile.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kCalibration[] = "calib.json";
constexpr char kPositions[] = "positions.json", kPositions3d[] = "positions3d.json";

enum Column { kDimensions, kError, kStillError };

bool starts_with(const fs::path& path, const char* prefix) {
    return path.filename().string().starts_with(prefix);
}

// The folder of both views.
fs::path root_of(const fs::path& left) { return left.parent_path().parent_path(); }

// The folder of the right view's sequence.
fs::path right_of(const fs::path& left) {
    const std::string view = left.parent_path().filename().string();
    return root_of(left) / ("right" + view.substr(4)) / left.filename();
}

fs::path only_file(const fs::path& folder, const std::string& end, const std::string& what) {
    std::vector<fs::path> found;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error))
        if (entry.path().filename().string().ends_with(end)) found.push_back(entry.path());
    if (found.size() == 1) return found.front();
    throw CliError(ExitCode::kInput, folder.string() + ": one file *" + end +
                                         " was expected here, " + what + "; there are " +
                                         std::to_string(found.size()) + ".");
}

struct View {
    fs::path video, start_image, end_image, start_marks, end_marks;
};

View view_in(const fs::path& sequence) {
    require_entries(sequence, {{"segmentation/icgstartseg.png", "the marks in the first frame"},
                               {"segmentation/icgendseg.png", "the marks in the last frame"}});
    return {only_file(sequence / "frames", ".mp4", "the clip's video"),
            only_file(sequence, "_icgstart.png", "the first frame in ICG light"),
            only_file(sequence, "_icgend.png", "the last frame in ICG light"),
            sequence / "segmentation" / "icgstartseg.png",
            sequence / "segmentation" / "icgendseg.png"};
}

// The data set's truth is of images that are not rectified; x_right = x_left - baseline but for the
// principal points.
struct Calibration {
    StereoCalibration rig;
    StirStereo stereo;
};

Calibration read_calibration(const fs::path& path) {
    const nlohmann::json json = read_json_object(
        path, "leftcameramat, rightcameramat, rotation and translation", ExitCode::kCalibration);
    StereoCalibration rig;
    rig.left = camera_of(path, json, "leftcameramat", "leftdistortioncoeffs");
    rig.right = camera_of(path, json, "rightcameramat", "rightdistortioncoeffs");
    const std::vector<double>& right = rig.right.distortion;
    if (std::any_of(right.begin(), right.end(), [](double value) { return value != 0; })) {
        throw CliError(ExitCode::kCalibration,
                       path.string() + ": rightdistortioncoeffs; zeros were expected.");
    }
    set_pose(path, json, "rotation", "translation", rig);
    // The data set's own loader takes the baseline's length; so may the sign be either.
    if (rig.translation[0] > 0)
        for (double& component : rig.translation) component = -component;
    detail::check_and_normalise(rig, LengthUnit::kMetre, LengthUnit::kMetre);
    return {rig, {rig.left.fx, rig.left.cx, rig.left.cy, rig.right.cx, -rig.translation[0]}};
}

struct Marks {
    std::vector<StirMark> marks;
    std::vector<cv::Point3d> px, mm;
};

Marks read_marks(const fs::path& segmentation, const fs::path& right_segmentation,
                 const fs::path& image, const fs::path& right_image, const StirStereo& stereo) {
    Marks result;
    const auto read = [](const fs::path& path) { return read_image(path, cv::IMREAD_GRAYSCALE); };
    result.marks = stir_marks(read(segmentation));
    if (result.marks.empty()) {
        throw CliError(ExitCode::kInput, segmentation.string() +
                                             ": marks that are not black were expected; the image "
                                             "has none.");
    }
    for (const StirMark& mark : result.marks) {
        const cv::Point centre = mark.centre();
        result.px.emplace_back(centre.x, centre.y, 0);
    }
    const cv::Mat left = read_image(image, cv::IMREAD_COLOR);
    const cv::Mat right = read_image(right_image, cv::IMREAD_COLOR);
    if (left.size() != right.size()) {
        throw CliError(ExitCode::kInput,
                       right_image.string() + ": the right image has not the left one's size.");
    }
    result.mm =
        stir_places(result.marks, stir_marks(read(right_segmentation)), left, right, stereo);
    return result;
}

template <typename Point>
void write_predictions(const fs::path& path, const fs::path& sequence,
                       const std::vector<Point>& points) {
    std::string text = json_text(nlohmann::json(sequence.string())).insert(0, 1, '{').append(":[");
    for (std::size_t i = 0; i < points.size(); ++i)
        text.append(i > 0 ? "," : "").append(json_of(points[i]));
    write_atomically(path, text + "]}\n");
}

std::vector<double> errors_in(const Samples& samples, int dimensions, Column column) {
    std::vector<double> errors;
    for (std::size_t i = 0; i < samples.size(); ++i)
        if (samples.at(i, kDimensions) == dimensions) errors.push_back(samples.at(i, column));
    return errors;
}

class Stir : public DataSet {
  public:
    std::string name() const override { return "stir"; }
    std::string summary() const override {
        return "STIR 2024 and 2025: points in the last frame of a clip, in 2D and 3D";
    }
    std::string layout() const override {
        return "N/ with calib.json, left*/seqNN/ and right*/seqNN/, each with frames/*.mp4, "
               "segmentation/icgstartseg.png and icgendseg.png, *_icgstart.png and *_icgend.png";
    }
    bool is_clip(const fs::path& folder) const override {
        return starts_with(folder, "seq") && starts_with(folder.parent_path(), "left");
    }
    std::vector<std::string> prediction_files() const override {
        return {kPositions, kPositions3d};
    }

    std::vector<std::string> sample_columns() const override {
        return {"dimensions", "error", "still_error"};
    }
    std::vector<Metric> metrics() const override {
        std::vector<Metric> metrics{{"average_px", true}};
        for (const double px : kStirPixels)
            metrics.push_back({"within_" + format_fixed(px, 0) + "_px", true});
        metrics.push_back({"mean_px"});
        metrics.push_back({"median_px"});
        metrics.push_back({"still_average_px", true});
        metrics.push_back({"average_mm", true});
        for (const double mm : kStirMillimetres)
            metrics.push_back({"within_" + format_fixed(mm, 0) + "_mm", true});
        metrics.push_back({"mean_mm"});
        metrics.push_back({"median_mm"});
        return metrics;
    }
    std::vector<double> summarise(const Samples& samples) const override {
        std::vector<double> values;
        const auto add = [&](int dimensions, const std::array<double, 5>& thresholds) {
            std::vector<double> errors = errors_in(samples, dimensions, kError);
            const auto shares = shares_within(errors, thresholds);
            values.push_back(shares.back());
            values.insert(values.end(), shares.begin(), shares.end() - 1);
            const auto count = static_cast<double>(errors.size());
            std::sort(errors.begin(), errors.end());
            values.push_back(errors.empty()
                                 ? kNoPlace
                                 : std::accumulate(errors.begin(), errors.end(), 0.0) / count);
            values.push_back(percentile(errors, 0.5));
        };
        add(2, kStirPixels);
        values.push_back(shares_within(errors_in(samples, 2, kStillError), kStirPixels).back());
        add(3, kStirMillimetres);
        return values;
    }

    std::vector<fs::path> inputs_of(const fs::path& clip) const override {
        return {clip, right_of(clip), root_of(clip) / kCalibration};
    }
    ClipScore run(const ClipTask& task) const override {
        const fs::path& clip = task.folder;
        const fs::path root = root_of(clip);
        require_entries(root, {{kCalibration, "leftcameramat, rightcameramat and so on"}});
        const Calibration calibration = read_calibration(root / kCalibration);
        const View left = view_in(clip), right = view_in(right_of(clip));
        const Marks start = read_marks(left.start_marks, right.start_marks, left.start_image,
                                       right.start_image, calibration.stereo);
        const Marks end = read_marks(left.end_marks, right.end_marks, left.end_image,
                                     right.end_image, calibration.stereo);

        PointClip points;
        points.source.left = left.video.string();
        points.source.right = right.video.string();
        points.calibration = calibration.rig;
        for (const cv::Point3d& mark : start.px) points.points.emplace_back(mark.x, mark.y);
        const PointTracks tracks(task, points);
        return score(task, points, tracks, start, end);
    }

  private:
    ClipScore score(const ClipTask& task, const PointClip& points, const PointTracks& tracks,
                    const Marks& start, const Marks& end) const {
        std::vector<cv::Point2d> positions;
        std::vector<cv::Point3d> positions3d, flat;
        for (std::size_t i = 0; i < points.points.size(); ++i) {
            const FoundPoint found = tracks.last_known(tracks.last(), i);
            positions.push_back(std::isfinite(found.px.x) ? found.px : points.points[i]);
            positions3d.push_back(found.has_place() ? found.mm : cv::Point3d());
            flat.emplace_back(positions.back().x, positions.back().y, 0);
        }
        write_predictions(task.out / kPositions, task.folder, positions);
        write_predictions(task.out / kPositions3d, task.folder, positions3d);

        ClipScore score{Samples(sample_columns()), 0, {}, {}, {}};
        set_times(task.out, score);
        const std::vector<double> errors = nearest_errors(flat, end.px);
        const std::vector<double> still = nearest_errors(start.px, end.px);
        for (std::size_t i = 0; i < errors.size(); ++i) score.samples.add({2, errors[i], still[i]});
        if (!end.mm.empty())
            for (const double error : nearest_errors(positions3d, end.mm))
                score.samples.add({3, error, kNoPlace});

        std::vector<MarkedPoint> marked;
        for (const cv::Point3d& mark : end.px) {
            const auto nearest =
                std::min_element(flat.begin(), flat.end(), [&](const auto& a, const auto& b) {
                    return cv::norm(a - mark) < cv::norm(b - mark);
                });
            marked.push_back({mark.x, mark.y, nearest->x, nearest->y});
        }
        score.picture = picture_of(points.source, tracks.last(), marked);
        score.remark = "last frame, " + std::to_string(end.px.size()) + " marks, " +
                       std::to_string(flat.size()) + " points: mean error " +
                       format_fixed(std::accumulate(errors.begin(), errors.end(), 0.0) /
                                        static_cast<double>(errors.size()),
                                    1) +
                       " px";
        const std::string state = state_of(task.out, tracks.last());
        if (!state.empty()) score.remark += "; " + state;
        return score;
    }
};

// Zero-mean normalised correlation; 0 where a patch is uniform.
double correlation(const cv::Mat& a, const cv::Mat& b) {
    cv::Mat x, y;
    a.convertTo(x, CV_64F);
    b.convertTo(y, CV_64F);
    x = x.reshape(1, 1);
    y = y.reshape(1, 1);
    x -= cv::mean(x);
    y -= cv::mean(y);
    const double scale = cv::norm(x) * cv::norm(y);
    return scale > 0 ? x.dot(y) / scale : 0;
}

}  // namespace

std::vector<double> nearest_errors(const std::vector<cv::Point3d>& predicted,
                                   const std::vector<cv::Point3d>& truth) {
    std::vector<double> errors;
    for (const cv::Point3d& point : predicted) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const cv::Point3d& true_point : truth)
            nearest = std::min(nearest, cv::norm(point - true_point));
        errors.push_back(nearest);
    }
    return errors;
}

std::array<double, 6> shares_within(const std::vector<double>& errors,
                                    const std::array<double, 5>& thresholds) {
    std::array<double, 6> shares{};
    for (std::size_t i = 0; i < thresholds.size(); ++i) {
        const auto within = std::count_if(errors.begin(), errors.end(),
                                          [&](double error) { return error <= thresholds[i]; });
        shares[i] = static_cast<double>(within) / static_cast<double>(errors.size());
        shares.back() += shares[i] / static_cast<double>(thresholds.size());
    }
    return shares;
}

std::vector<StirMark> stir_marks(const cv::Mat& segmentation) {
    std::vector<std::vector<cv::Point>> contours;
    cv::findContours(segmentation, contours, cv::RETR_TREE, cv::CHAIN_APPROX_SIMPLE);
    std::vector<StirMark> marks;
    for (const auto& contour : contours) marks.push_back({cv::boundingRect(contour)});
    return marks;
}

std::vector<cv::Point3d> stir_places(const std::vector<StirMark>& left,
                                     const std::vector<StirMark>& right, const cv::Mat& left_image,
                                     const cv::Mat& right_image, const StirStereo& stereo) {
    constexpr int kMaxRows = 10;
    constexpr double kMinDisparity = 8, kMaxDisparity = 105;
    const cv::Rect image({}, left_image.size());
    std::vector<cv::Point3d> places;
    for (const StirMark& mark : left) {
        const cv::Point centre = mark.centre();
        double best = -std::numeric_limits<double>::infinity(), disparity = 0;
        for (const StirMark& other : right) {
            const cv::Point place = other.centre();
            const double d = centre.x + (stereo.right_cx - stereo.cx) - place.x;
            const cv::Rect box(place.x - mark.box.width / 2, mark.box.y, mark.box.width,
                               mark.box.height);
            if (std::abs(place.y - centre.y) > kMaxRows || d < kMinDisparity || d > kMaxDisparity ||
                (box & image) != box)
                continue;
            const double score = correlation(left_image(mark.box), right_image(box));
            if (score <= best) continue;
            best = score;
            disparity = d;
        }
        if (disparity == 0) continue;
        const double scale = stereo.baseline_mm / disparity;
        places.emplace_back((centre.x - stereo.cx) * scale, (centre.y - stereo.cy) * scale,
                            stereo.fx * scale);
    }
    return places;
}

std::unique_ptr<DataSet> make_stir() { return std::make_unique<Stir>(); }

}  // namespace defrec::cli
