// SurgT: boxes of tissue that are followed in both views of a rectified video.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/base/util/median.hpp"
#include "sdk/evaluation/data_sets/point_tracks.hpp"
#include "sdk/evaluation/data_sets/surgt_metrics.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/text.hpp"
#include "sdk/io/yaml_document.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kInfo[] = "info.yaml", kCalibration[] = "calibration.yaml";
constexpr char kConfig[] = "config.yaml", kBoxes[] = "boxes.json";
constexpr int kLongestVideo = 1'000'000;  // frames
constexpr std::size_t kUsualStep = 50;    // frames from anchor to anchor
constexpr int kGrid = 5;                  // points of a box in each direction

enum Column {
    kKeypoint,
    kAnchor,
    kFrame,
    kTimesInCurve,
    kOverlapInCurve,
    kCounted,
    kHit2d,
    kHit3d,
    kOverlap,
    kErrorPx,
    kErrorMm,
    kWindowFirst,
    kWindowLast
};

struct Info {
    Layout layout = Layout::kTopBottom;
    cv::Size size;  // of a view
    std::string video;
    std::vector<std::string> truth;  // a file for each keypoint
};

const YamlNode& value_of(const YamlDocument& document, const YamlNode& map, const std::string& key,
                         YamlNode::Kind kind, const std::string& what) {
    const YamlEntry* entry = map.find(key);
    if (entry == nullptr || entry->value.kind != kind) {
        document.fail(entry != nullptr ? entry->line : map.line, key,
                      what + (entry != nullptr ? " was expected here." : " was expected."));
    }
    return entry->value;
}

// The name of a file in the clip's own folder.
void require_plain(const YamlDocument& document, const YamlNode& node, const std::string& key) {
    const std::string& name = node.scalar;
    if (name.empty() || name == "." || name == ".." ||
        name.find_first_of("/\\") != std::string::npos)
        document.fail(node.line, key, "a file name without a folder was expected.");
}

Info read_info(const fs::path& path) {
    using Kind = YamlNode::Kind;
    constexpr int kLargestSide = 16384;
    const YamlDocument document = YamlDocument::load(path, ExitCode::kInput);
    const YamlNode& root = document.root();
    Info info;
    const YamlNode& stack =
        value_of(document, root, "video_stack", Kind::kScalar, "vertical or horizontal");
    if (stack.scalar != "vertical" && stack.scalar != "horizontal")
        document.fail(stack.line, "video_stack", "vertical or horizontal was expected.");
    info.layout = stack.scalar == "vertical" ? Layout::kTopBottom : Layout::kSideBySide;
    const YamlNode& size =
        value_of(document, root, "resolution", Kind::kMap, "height and width of a view");
    const auto side = [&](const char* name) {
        const YamlNode& node = value_of(document, size, name, Kind::kScalar, "a number of pixels");
        return document.integer(node, name, 1, kLargestSide);
    };
    info.size = {side("width"), side("height")};
    const YamlNode& video =
        value_of(document, root, "name_video", Kind::kScalar, "the video's file name");
    require_plain(document, video, "name_video");
    info.video = video.scalar;
    const char* what = "a list of the truth's file names";
    const YamlNode& names = value_of(document, root, "name_ground_truth", Kind::kSequence, what);
    for (const YamlNode& name : names.items) {
        if (name.kind != Kind::kScalar) document.fail(name.line, "name_ground_truth", what);
        require_plain(document, name, "name_ground_truth");
        info.truth.push_back(name.scalar);
    }
    if (info.truth.empty()) document.fail(names.line, "name_ground_truth", what);
    return info;
}

bool read_flag(const YamlDocument& document, const YamlNode& node, const std::string& key) {
    std::string text = node.scalar;
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (text != "true" && text != "false")
        document.fail(node.line, key, "true or false was expected.");
    return text == "true";
}

Box read_box(const YamlDocument& document, const YamlNode& node, const std::string& key) {
    if (node.items.size() != 4)
        document.fail(node.line, key, "a box [u, v, width, height] was expected.");
    const auto number = [&](std::size_t i) { return document.number(node.items[i], key); };
    const Box box{number(0), number(1), number(2), number(3)};
    if (!(box.width > 0) || !(box.height > 0))
        document.fail(node.line, key, "a box with a positive width and height was expected.");
    return box;
}

TrueBoxes read_true_boxes(const YamlDocument& document, const YamlNode& node,
                          const std::string& key) {
    if (node.items.size() != 3) {
        document.fail(node.line, key,
                      "[visible in both views, difficult, two boxes or null] was expected.");
    }
    TrueBoxes truth;
    truth.visible_in_both = read_flag(document, node.items[0], key);
    truth.is_difficult = read_flag(document, node.items[1], key);
    const YamlNode& boxes = node.items[2];
    if (boxes.kind != YamlNode::Kind::kNull) {
        if (boxes.items.size() != 2)
            document.fail(boxes.line, key, "two boxes, left and right, or null were expected.");
        truth.boxes = {read_box(document, boxes.items[0], key),
                       read_box(document, boxes.items[1], key)};
    }
    if (truth.counts() && !truth.boxes)
        document.fail(node.line, key, "boxes were expected, since both views show them.");
    return truth;
}

// Boxes of each frame; the file has a list, or a map whose keys are the frames.
std::vector<TrueBoxes> read_truth(const fs::path& path) {
    constexpr YamlLimits kLimits{50'000'000, 100'000, true};
    const YamlDocument document = YamlDocument::load(path, ExitCode::kInput, kLimits);
    const YamlNode& root = document.root();
    std::vector<TrueBoxes> truth;
    for (const YamlNode& item : root.items)
        truth.push_back(read_true_boxes(document, item, "frame " + std::to_string(truth.size())));
    for (const YamlEntry& entry : root.entries) {
        if (parse_integer(entry.key) != static_cast<std::int64_t>(truth.size())) {
            document.fail(entry.line, entry.key,
                          "frame " + std::to_string(truth.size()) + " was expected here.");
        }
        truth.push_back(read_true_boxes(document, entry.value, "frame " + entry.key));
    }
    return truth;
}

// What the data set's tool keeps in its config.yaml.
struct Plan {
    std::vector<std::vector<std::size_t>> anchors;  // of each keypoint
    std::size_t first = 150, last = 829;            // the window of EAO
};

// The tool's file, beside its folder data/; empty where there is none.
fs::path config_of(const fs::path& clip) {
    constexpr int kLevels = 4;
    fs::path folder = clip;
    for (int i = 0; i < kLevels; ++i) {
        folder = folder.parent_path();
        std::error_code error;
        if (fs::exists(folder / kConfig, error)) return folder / kConfig;
    }
    return {};
}

std::vector<std::size_t> read_anchors(const YamlDocument& document, const YamlNode& list) {
    std::vector<std::size_t> anchors;
    for (const YamlNode& item : list.items)
        anchors.push_back(
            static_cast<std::size_t>(document.integer(item, "anchors", 0, kLongestVideo)));
    if (anchors.empty()) document.fail(list.line, "anchors", "a list of frames was expected.");
    return anchors;
}

// Number `key` of a map, where it is one.
std::optional<std::size_t> count_in(const YamlDocument& document, const YamlNode& map,
                                    const std::string& key) {
    const YamlEntry* entry = map.find(key);
    if (entry == nullptr || entry->value.scalar == "None") return std::nullopt;
    return static_cast<std::size_t>(document.integer(entry->value, key, 0, kLongestVideo));
}

// clip: .../SUBSET/CASE/SAMPLE.
Plan plan_of(const fs::path& clip, const std::vector<std::vector<TrueBoxes>>& truth) {
    Plan plan;
    const std::string sample = clip.filename().string();
    const std::string case_name = clip.parent_path().filename().string();
    const std::string subset = clip.parent_path().parent_path().filename().string();
    if (subset == "test") {
        plan.first = 140;
        plan.last = 683;
    }
    const YamlEntry* of_sample = nullptr;
    if (const fs::path config = config_of(clip); !config.empty()) {
        const YamlDocument document = YamlDocument::load(config, ExitCode::kInput);
        if (const YamlEntry* of_subset = document.root().find(subset)) {
            plan.first = count_in(document, of_subset->value, "N_min").value_or(plan.first);
            plan.last = count_in(document, of_subset->value, "N_max").value_or(plan.last);
            const YamlEntry* anchors = of_subset->value.find("anchors");
            const YamlEntry* of_case =
                anchors != nullptr ? anchors->value.find(case_name) : nullptr;
            of_sample = of_case != nullptr ? of_case->value.find(sample) : nullptr;
        }
        if (of_sample != nullptr) {
            if (of_sample->value.items.size() != truth.size()) {
                document.fail(of_sample->line, "anchors",
                              "a list of frames for each of the " + std::to_string(truth.size()) +
                                  " files of truth was expected.");
            }
            for (const YamlNode& list : of_sample->value.items)
                plan.anchors.push_back(read_anchors(document, list));
            return plan;
        }
    }
    for (const std::vector<TrueBoxes>& of_keypoint : truth) {
        plan.anchors.emplace_back();
        for (std::size_t frame = 0; frame < of_keypoint.size(); frame += kUsualStep)
            plan.anchors.back().push_back(frame);
    }
    return plan;
}

// The cameras, and those of the rectified images in which the truth is given.
class Rectification {
  public:
    Rectification(const StereoCalibration& calibration, cv::Size size)
        : matrix_(matrix_of(calibration.left)), distortion_(calibration.left.distortion) {
        const cv::Mat r(3, 3, CV_64F, const_cast<double*>(calibration.rotation.data()));
        const cv::Mat t(3, 1, CV_64F, const_cast<double*>(calibration.translation.data()));
        cv::Mat r1, r2, p1, p2, q;
        cv::stereoRectify(matrix_, distortion_, matrix_of(calibration.right),
                          calibration.right.distortion, size, r, t, r1, r2, p1, p2, q,
                          cv::CALIB_ZERO_DISPARITY, 0);
        rotation_ = r1;
        projection_[0] = p1;
        projection_[1] = p2;
        q_ = q;
    }

    const cv::Matx44d& q() const { return q_; }

    // Pixel of the left image as given, of a pixel of the rectified one.
    cv::Point2d raw_of(cv::Point2d pixel) const {
        const cv::Matx34d& p = projection_[0];
        const cv::Vec3d ray = rotation_.t() * cv::Vec3d((pixel.x - p(0, 2)) / p(0, 0),
                                                        (pixel.y - p(1, 2)) / p(1, 1), 1);
        std::vector<cv::Point2d> raw;
        cv::projectPoints(std::vector<cv::Point3d>{{ray[0], ray[1], ray[2]}}, cv::Vec3d(),
                          cv::Vec3d(), matrix_, distortion_, raw);
        return raw.front();
    }
    // The pixel of a point in the left camera, mm.
    cv::Point2d pixel_of(const cv::Point3d& place, std::size_t view) const {
        const cv::Vec3d turned = rotation_ * cv::Vec3d(place.x, place.y, place.z);
        const cv::Vec3d pixel = projection_[view] * cv::Vec4d(turned[0], turned[1], turned[2], 1);
        return {pixel[0] / pixel[2], pixel[1] / pixel[2]};
    }

  private:
    static cv::Mat matrix_of(const CameraCalibration& camera) {
        return (cv::Mat_<double>(3, 3) << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0,
                1);
    }

    cv::Mat matrix_;
    std::vector<double> distortion_;
    cv::Matx33d rotation_;
    cv::Matx34d projection_[2];
    cv::Matx44d q_;
};

// Where a box goes with points that lie in it: by the median of their shifts.
Box moved_box(const Box& box, const std::vector<cv::Point2d>& before,
              const std::vector<cv::Point2d>& now) {
    std::vector<double> right, down;
    for (std::size_t i = 0; i < before.size(); ++i) {
        right.push_back(now[i].x - before[i].x);
        down.push_back(now[i].y - before[i].y);
    }
    return {box.u + median(std::move(right)), box.v + median(std::move(down)), box.width,
            box.height};
}

// The points of a keypoint among those that are tracked from a frame on.
struct Followed {
    std::size_t keypoint, first_point;
    BoxPair boxes;
};

std::vector<cv::Point2d> points_in(const Box& box, const Rectification& rectification) {
    std::vector<cv::Point2d> points;
    for (int row = 0; row < kGrid; ++row)
        for (int column = 0; column < kGrid; ++column) {
            points.push_back(rectification.raw_of({box.u + box.width * (column + 0.5) / kGrid,
                                                   box.v + box.height * (row + 0.5) / kGrid}));
        }
    return points;
}

// Empty where less than a third of the points have a place.
std::optional<BoxPair> predict(const PointTracks& tracks, const Followed& followed,
                               std::int64_t frame, const Rectification& rectification) {
    constexpr std::size_t kPoints = kGrid * kGrid, kMinPoints = kPoints / 3;
    std::vector<cv::Point2d> before[2], now[2];
    for (std::size_t i = 0; i < kPoints; ++i) {
        const FoundPoint& start = tracks.at(tracks.first(), followed.first_point + i);
        const FoundPoint& found = tracks.at(frame, followed.first_point + i);
        if (!start.has_place() || !found.has_place()) continue;
        for (std::size_t view = 0; view < 2; ++view) {
            before[view].push_back(rectification.pixel_of(start.mm, view));
            now[view].push_back(rectification.pixel_of(found.mm, view));
        }
    }
    if (now[0].size() < kMinPoints) return std::nullopt;
    return BoxPair{moved_box(followed.boxes[0], before[0], now[0]),
                   moved_box(followed.boxes[1], before[1], now[1])};
}

// What was predicted from one anchor on.
struct Prediction {
    std::size_t anchor = 0, first = 0;  // the frame that was asked for, and that of the boxes given
    std::vector<std::optional<BoxPair>> boxes;  // from frame first + 1 on
};

// The first frame from the anchor on whose boxes the tracker can be given; empty: none.
std::optional<std::size_t> start_of(const std::vector<TrueBoxes>& truth, std::size_t anchor,
                                    cv::Size size) {
    const auto is_inside = [&size](const Box& box) {
        return box.u >= 0 && box.v >= 0 && box.u + box.width < size.width &&
               box.v + box.height < size.height;
    };
    for (std::size_t i = anchor; i < truth.size(); ++i) {
        if (truth[i].counts() && is_inside((*truth[i].boxes)[0]) && is_inside((*truth[i].boxes)[1]))
            return i;
    }
    return std::nullopt;
}

nlohmann::ordered_json json_of(const Prediction& prediction) {
    nlohmann::ordered_json boxes = nlohmann::ordered_json::array();
    for (const auto& pair : prediction.boxes) {
        nlohmann::ordered_json item;
        if (pair)
            for (const Box& box : *pair) item.push_back({box.u, box.v, box.width, box.height});
        boxes.push_back(std::move(item));
    }
    return {{"anchor", prediction.anchor}, {"first", prediction.first}, {"boxes", boxes}};
}

struct Scores {
    double eao = kNoPlace;
    double accuracy = kNoPlace, robustness_2d = kNoPlace, robustness_3d = kNoPlace;
    double error_px = kNoPlace, error_std_px = kNoPlace;
    double error_mm = kNoPlace, error_std_mm = kNoPlace;
};

// Mean of values, and the mean of the anchors' standard deviations, weighted by their values.
class Mean {
  public:
    void add(double value) {
        if (!std::isnan(value)) of_anchor_.push_back(value);
    }
    void end_anchor() {
        double sum = 0, squares = 0;
        for (const double value : of_anchor_) sum += value;
        const auto count = static_cast<double>(of_anchor_.size());
        for (const double value : of_anchor_)
            squares += (value - sum / count) * (value - sum / count);
        if (count > 0) weighted_std_ += count * std::sqrt(squares / count);
        sum_ += sum;
        count_ += count;
        of_anchor_.clear();
    }
    double mean() const { return count_ > 0 ? sum_ / count_ : kNoPlace; }
    double standard_deviation() const { return count_ > 0 ? weighted_std_ / count_ : kNoPlace; }

  private:
    std::vector<double> of_anchor_;
    double sum_ = 0, weighted_std_ = 0, count_ = 0;
};

Scores scores_of(const Samples& samples) {
    Scores scores;
    Mean overlap, error_px, error_mm;
    double counted = 0, hits_2d = 0, hits_3d = 0;
    bool has_one_window = true;
    std::vector<OverlapCurve> of_keypoints, of_anchors;
    const auto end_keypoint = [&] {
        of_keypoints.push_back(mean_curve(of_anchors));
        of_anchors.clear();
    };
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const auto column = [&](Column name) { return samples.at(i, name); };
        // Rows are in the order of keypoint, anchor and frame; one that is not begins a clip.
        const auto key = [&](std::size_t row) {
            return std::array{samples.at(row, kKeypoint), samples.at(row, kAnchor),
                              samples.at(row, kFrame)};
        };
        const bool is_new_clip = i == 0 || key(i) <= key(i - 1);
        const bool is_new_keypoint = is_new_clip || key(i)[0] != key(i - 1)[0];
        if (is_new_keypoint || key(i)[1] != key(i - 1)[1]) {
            if (is_new_keypoint && i > 0) end_keypoint();
            of_anchors.emplace_back();
            for (Mean* mean : {&overlap, &error_px, &error_mm}) mean->end_anchor();
        }
        const double in_curve = column(kOverlapInCurve);
        of_anchors.back().insert(of_anchors.back().end(),
                                 static_cast<std::size_t>(column(kTimesInCurve)),
                                 std::isnan(in_curve) ? std::nullopt : std::optional(in_curve));
        counted += column(kCounted);
        hits_2d += column(kHit2d);
        hits_3d += column(kHit3d);
        overlap.add(column(kOverlap));
        error_px.add(column(kErrorPx));
        error_mm.add(column(kErrorMm));
        has_one_window = has_one_window && column(kWindowFirst) == samples.at(0, kWindowFirst) &&
                         column(kWindowLast) == samples.at(0, kWindowLast);
    }
    if (samples.size() == 0) return scores;
    end_keypoint();
    for (Mean* mean : {&overlap, &error_px, &error_mm}) mean->end_anchor();
    if (has_one_window) {
        scores.eao = expected_average_overlap(mean_curve(of_keypoints),
                                              static_cast<std::size_t>(samples.at(0, kWindowFirst)),
                                              static_cast<std::size_t>(samples.at(0, kWindowLast)));
    }
    scores.accuracy = overlap.mean();
    scores.error_px = error_px.mean();
    scores.error_std_px = error_px.standard_deviation();
    scores.error_mm = error_mm.mean();
    scores.error_std_mm = error_mm.standard_deviation();
    if (counted > 0) {
        scores.robustness_2d = hits_2d / counted;
        scores.robustness_3d = hits_3d / counted;
    }
    return scores;
}

class Surgt : public DataSet {
  public:
    std::string name() const override { return "surgt"; }
    bool has_units() const override { return true; }
    std::string summary() const override { return "SurgT: boxes of tissue in both views"; }
    std::string layout() const override {
        return "{validation,test}/CASE/SAMPLE/ with info.yaml, calibration.yaml, the video and the "
               "gt_rectified_K.yaml that info.yaml names; above them the tool's config.yaml, if it "
               "is there";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::exists(folder / kInfo, error);
    }
    std::vector<std::string> prediction_files() const override { return {kBoxes}; }

    std::vector<std::string> sample_columns() const override {
        return {"keypoint", "anchor",       "frame",      "times_in_curve", "overlap_in_curve",
                "counted",  "hit_2d",       "hit_3d",     "overlap",        "error_px",
                "error_mm", "window_first", "window_last"};
    }
    std::vector<Metric> metrics() const override {
        return {{"eao", true},   {"accuracy", true},  {"robustness_2d", true},
                {"error_2d_px"}, {"error_2d_std_px"}, {"robustness_3d", true},
                {"error_3d_mm"}, {"error_3d_std_mm"}};
    }
    std::vector<double> summarise(const Samples& samples) const override {
        const Scores scores = scores_of(samples);
        return {scores.eao,      scores.accuracy,     scores.robustness_2d,
                scores.error_px, scores.error_std_px, scores.robustness_3d,
                scores.error_mm, scores.error_std_mm};
    }

    std::vector<fs::path> inputs_of(const fs::path& clip) const override {
        return {clip, config_of(fs::absolute(clip).lexically_normal())};
    }
    ClipScore run(const ClipTask& task) const override {
        const fs::path folder = fs::absolute(task.folder).lexically_normal();
        require_entries(folder, {{kInfo,
                                  "video_stack, resolution, name_video and "
                                  "name_ground_truth"},
                                 {kCalibration, "OpenCV stereo YAML, M1 D1 M2 D2 R T in mm"}});
        const Info info = read_info(folder / kInfo);
        require_entries(folder, {{info.video, "the video that info.yaml names"}});
        std::vector<std::vector<TrueBoxes>> truth;
        for (const std::string& file : info.truth) {
            require_entries(folder, {{file, "the truth that info.yaml names"}});
            truth.push_back(read_truth(folder / file));
        }
        StereoCalibration calibration =
            load_calibration((folder / kCalibration).string(), task.settings.units);
        fit_to_frames(calibration, info.size.width, info.size.height);
        PointClip clip;
        clip.source.stereo = (folder / info.video).string();
        clip.source.layout = info.layout;
        clip.calibration = calibration;
        if (const FrameSource source(clip.source);
            source.width() != info.size.width || source.height() != info.size.height) {
            throw CliError(ExitCode::kInput, (folder / kInfo).string() + ": views of " +
                                                 std::to_string(info.size.width) + "x" +
                                                 std::to_string(info.size.height) +
                                                 " were expected; those of " + info.video +
                                                 " are " + std::to_string(source.width()) + "x" +
                                                 std::to_string(source.height()) + ".");
        }
        const Rectification rectification(calibration, info.size);
        Run run{task, folder, info, clip, truth, plan_of(folder, truth), rectification, {}, {}};
        run.track();
        run.write_predictions();
        return run.score(sample_columns());
    }

  private:
    // One clip that is run.
    struct Run {
        const ClipTask& task;
        const fs::path& folder;
        const Info& info;
        PointClip& clip;
        const std::vector<std::vector<TrueBoxes>>& truth;
        Plan plan;
        const Rectification& rectification;
        std::vector<std::vector<Prediction>> predictions;  // of each keypoint, by anchor
        std::vector<double> times;

        // Once from each frame in which boxes are given, as the tool does.
        void track() {
            std::map<std::size_t, std::vector<std::size_t>> keypoints_from;
            predictions.resize(truth.size());
            for (std::size_t keypoint = 0; keypoint < truth.size(); ++keypoint) {
                for (const std::size_t anchor : plan.anchors[keypoint]) {
                    const auto start = start_of(truth[keypoint], anchor, info.size);
                    if (!start) continue;
                    predictions[keypoint].push_back({anchor, *start, {}});
                    auto& keypoints = keypoints_from[*start];
                    if (keypoints.empty() || keypoints.back() != keypoint)
                        keypoints.push_back(keypoint);
                }
            }
            for (const auto& [start, keypoints] : keypoints_from) track_from(start, keypoints);
        }

        void track_from(std::size_t start, const std::vector<std::size_t>& keypoints) {
            std::vector<Followed> followed;
            clip.points.clear();
            for (const std::size_t keypoint : keypoints) {
                const BoxPair& boxes = *truth[keypoint][start].boxes;
                followed.push_back({keypoint, clip.points.size(), boxes});
                const auto points = points_in(boxes[0], rectification);
                clip.points.insert(clip.points.end(), points.begin(), points.end());
            }
            ClipTask part = task;
            part.out = task.out / ("from_" + std::to_string(start));
            create_output_folder(part.out);
            clip.source.range.first = static_cast<std::int64_t>(start);
            const PointTracks tracks(part, clip);
            const std::vector<double> of_part = frame_times_in(part.out);
            times.insert(times.end(), of_part.begin(), of_part.end());
            for (const Followed& box : followed) {
                require_truth(box.keypoint, tracks.last());
                for (Prediction& prediction : predictions[box.keypoint]) {
                    if (prediction.first != start) continue;
                    for (std::int64_t frame = tracks.first() + 1; frame <= tracks.last(); ++frame)
                        prediction.boxes.push_back(predict(tracks, box, frame, rectification));
                }
            }
        }

        void require_truth(std::size_t keypoint, std::int64_t last) const {
            if (static_cast<std::int64_t>(truth[keypoint].size()) > last) return;
            throw CliError(ExitCode::kInput, (folder / info.truth[keypoint]).string() +
                                                 ": the truth of " + std::to_string(last + 1) +
                                                 " frames was expected, as many as " + info.video +
                                                 " has; there are " +
                                                 std::to_string(truth[keypoint].size()) + ".");
        }

        void write_predictions() const {
            nlohmann::ordered_json of_clip = nlohmann::ordered_json::array();
            for (const auto& of_keypoint : predictions) {
                nlohmann::ordered_json list = nlohmann::ordered_json::array();
                for (const Prediction& prediction : of_keypoint)
                    list.push_back(json_of(prediction));
                of_clip.push_back(std::move(list));
            }
            const fs::path name = folder.parent_path().parent_path().filename() /
                                  folder.parent_path().filename() / folder.filename();
            const nlohmann::ordered_json whole = {{name.generic_string(), of_clip}};
            write_atomically(task.out / kBoxes, json_text(whole) + "\n");
        }

        ClipScore score(const std::vector<std::string>& columns) const {
            ClipScore score{Samples(columns),
                            static_cast<std::int64_t>(times.size()),
                            frame_times_of(times),
                            {},
                            {}};
            Worst worst;
            for (std::size_t keypoint = 0; keypoint < truth.size(); ++keypoint) {
                for (const Prediction& prediction : predictions[keypoint]) {
                    const std::vector<BoxFrame> frames = assess_boxes(
                        truth[keypoint], prediction.first, prediction.boxes, rectification.q());
                    for (std::size_t i = 0; i < frames.size(); ++i) {
                        add(score.samples, keypoint, prediction, i, frames[i]);
                        if (frames[i].overlap_in_curve < worst.overlap)
                            worst = {frames[i].overlap_in_curve, keypoint, i, &prediction};
                    }
                }
            }
            if (worst.prediction == nullptr) return score;
            const auto frame = static_cast<std::int64_t>(worst.prediction->first + 1 + worst.place);
            score.picture = picture_of(clip.source, frame, marks_of(worst, frame));
            score.remark = "box " + std::to_string(worst.keypoint) + " from frame " +
                           std::to_string(worst.prediction->first) + ", frame " +
                           std::to_string(frame) + ": overlap " + format_fixed(worst.overlap, 3);
            const std::string state =
                state_of(task.out / ("from_" + std::to_string(worst.prediction->first)), frame);
            if (!state.empty()) score.remark += "; " + state;
            return score;
        }

        struct Worst {
            double overlap = std::numeric_limits<double>::infinity();
            std::size_t keypoint = 0, place = 0;
            const Prediction* prediction = nullptr;
        };

        // The box's centre in the left image as given.
        std::vector<MarkedPoint> marks_of(const Worst& worst, std::int64_t frame) const {
            const auto centre = [this](const Box& box) {
                return rectification.raw_of({box.u + box.width / 2, box.v + box.height / 2});
            };
            const auto& boxes = truth[worst.keypoint][static_cast<std::size_t>(frame)].boxes;
            const cv::Point2d is = centre((*boxes)[0]);
            const auto& predicted = worst.prediction->boxes[worst.place];
            const cv::Point2d found =
                predicted ? centre((*predicted)[0]) : cv::Point2d(kNoPlace, kNoPlace);
            return {{is.x, is.y, found.x, found.y}};
        }

        void add(Samples& samples, std::size_t keypoint, const Prediction& prediction,
                 std::size_t place, const BoxFrame& frame) const {
            const auto flag = [](bool is_set) { return is_set ? 1.0 : 0.0; };
            samples.add({static_cast<double>(keypoint), static_cast<double>(prediction.anchor),
                         static_cast<double>(prediction.first + 1 + place),
                         static_cast<double>(frame.times_in_curve), frame.overlap_in_curve,
                         flag(frame.is_counted), flag(frame.is_hit_2d), flag(frame.is_hit_3d),
                         frame.overlap, frame.error_px, frame.error_mm,
                         static_cast<double>(plan.first), static_cast<double>(plan.last)});
        }
    };
};

}  // namespace

std::unique_ptr<DataSet> make_surgt() { return std::make_unique<Surgt>(); }

}  // namespace defrec::cli
