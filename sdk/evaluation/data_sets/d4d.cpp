// D4D: how far the surface that was followed is from a structured-light cloud at the clip's end.
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "sdk/evaluation/data_sets/depth_meter.hpp"
#include "sdk/evaluation/data_sets/json_file.hpp"
#include "sdk/evaluation/data_sets/point_cloud.hpp"
#include "sdk/evaluation/data_sets/point_tracks.hpp"
#include "sdk/evaluation/score/percentile.hpp"
#include "sdk/io/text.hpp"
#include "sdk/io/yaml_document.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr char kLeft[] = "left_images_rect", kRight[] = "right_images_rect";
constexpr char kMasks[] = "left_images_rect_masks", kClips[] = "clips.json";
constexpr double kMillimetresPerMetre = 1000;
// Followed points across the image.
constexpr int kColumns = 48;

enum Column { kPoint, kVisible, kStartMm, kEndMm };

// x_cloud = rotation * x_camera + position, or the inverse of that; the cloud's unit.
struct CameraPose {
    cv::Matx33d rotation;
    cv::Vec3d position;
    CameraPose inverse() const { return {rotation.t(), -(rotation.t() * position)}; }
};

CameraPose read_pose(const fs::path& path) {
    constexpr std::size_t kLargestFile = 100'000, kNumbers = 16;
    constexpr double kTolerance = 1e-3;  // of R^T R - 1 and the last row: files round
    std::string text = read_text_file(path, kLargestFile, ExitCode::kInput);
    std::replace_if(
        text.begin(), text.end(),
        [](char c) { return c == ',' || c == '\t' || c == '\r' || c == '\n'; }, ' ');
    std::vector<double> m;
    for (const std::string_view field : split(text, ' '))
        if (!field.empty()) m.push_back(parse_double(field).value_or(kNoPlace));
    if (m.size() == kNumbers) {
        const cv::Matx33d rotation(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
        const cv::Matx33d excess = rotation.t() * rotation - cv::Matx33d::eye();
        const cv::Vec4d row(m[12], m[13], m[14], m[15] - 1);
        const bool is_pose = cv::norm(excess, cv::NORM_INF) < kTolerance &&
                             cv::norm(row, cv::NORM_INF) < kTolerance &&
                             cv::determinant(rotation) > 0 && std::isfinite(m[3] + m[7] + m[11]);
        if (is_pose) return {rotation, {m[3], m[7], m[11]}};
    }
    throw CliError(ExitCode::kInput,
                   path.string() + ": a camera's pose, 4x4 numbers, was expected.");
}

// A view's matrix P, 3x4 numbers of a rectified camera.
struct Projection {
    std::vector<double> p;
    std::string origin;
};
Projection read_projection(const fs::path& path) {
    const YamlDocument document = YamlDocument::load(path, ExitCode::kCalibration);
    for (const char* key : {"projection_matrix", "P", "p"}) {
        const YamlEntry* entry = document.root().find(key);
        if (entry == nullptr) continue;
        const YamlEntry* data = entry->value.find("data");
        const YamlNode& list = data != nullptr ? data->value : entry->value;
        Projection projection{{}, path.string() + ":" + std::to_string(entry->line) + ": " + key};
        for (const YamlNode& item : list.items) projection.p.push_back(document.number(item, key));
        if (projection.p.size() != 12 || !(projection.p[0] > 0) || !(projection.p[5] > 0))
            document.fail(entry->line, key, "3x4 numbers of a camera were expected.");
        return projection;
    }
    document.fail(1, "projection_matrix", "this key, or P, is missing.");
}

// The only file of a view in a camera_info/.
std::optional<fs::path> camera_file(const fs::path& folder, const std::string& view) {
    std::vector<fs::path> found;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        const std::string extension = entry.path().extension().string();
        if ((extension == ".yaml" || extension == ".yml") &&
            entry.path().stem().string().find(view) != std::string::npos)
            found.push_back(entry.path());
    }
    if (found.size() == 1) return found.front();
    return std::nullopt;
}

fs::path session_of(const fs::path& clip) {
    return fs::absolute(clip).lexically_normal().parent_path().parent_path();
}

// The clip's own cameras, else the session's.
StereoCalibration read_cameras(const fs::path& clip, const fs::path& session) {
    for (const fs::path& folder : {clip / "camera_info", session / "camera_info"}) {
        const auto left = camera_file(folder, "left"), right = camera_file(folder, "right");
        if (!left || !right) continue;
        const Projection l = read_projection(*left), r = read_projection(*right);
        StereoCalibration rig;
        const auto camera_of = [](const Projection& from) {
            CameraCalibration camera;
            camera.fx = from.p[0];
            camera.fy = from.p[5];
            camera.cx = from.p[2];
            camera.cy = from.p[6];
            camera.matrix_origin = camera.distortion_origin = from.origin;
            return camera;
        };
        rig.left = camera_of(l);
        rig.right = camera_of(r);
        rig.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        rig.rotation_origin = rig.translation_origin = r.origin;
        // Longer than any endoscope's in m, shorter than any in mm.
        constexpr double kLongestInMetres = 0.1;
        const double baseline = std::abs(r.p[3] / r.p[0] - l.p[3] / l.p[0]);
        rig.translation = {-baseline, 0, 0};
        detail::check_and_normalise(
            rig, baseline < kLongestInMetres ? LengthUnit::kMetre : LengthUnit::kMillimetre,
            LengthUnit::kMetre);
        return rig;
    }
    throw CliError(ExitCode::kCalibration,
                   (session / "camera_info").string() +
                       ": one YAML file with left in its name and one with right were expected "
                       "here, or in the clip's camera_info.");
}

std::string clip_name(std::string name) {
    std::replace(name.begin(), name.end(), ' ', '_');
    return name;
}

// The clip's entry in clips.json: a list of entries, alone or under "clips".
Json read_entry(const fs::path& path, const std::string& clip) {
    constexpr std::size_t kLargestFile = 100'000'000;
    const Json json =
        Json::parse(read_text_file(path, kLargestFile, ExitCode::kInput), nullptr, false);
    const bool is_within = json.is_object() && json.contains("clips");
    for (const Json& entry : is_within ? json["clips"] : json) {
        const bool is_named =
            entry.is_object() && entry.contains("name") && entry["name"].is_string();
        if (is_named && clip_name(entry["name"].get<std::string>()) == clip_name(clip))
            return entry;
    }
    throw CliError(ExitCode::kInput, path.string() + ": an entry with \"name\": \"" + clip +
                                         "\", \"start_geometry\" and \"end_geometry\" was "
                                         "expected.");
}

fs::path geometry_of(const fs::path& session, const Json& entry, const std::string& key) {
    const fs::path clips = session / kClips;
    if (!entry.contains(key) || !entry[key].is_string())
        throw CliError(ExitCode::kInput,
                       clips.string() + ": \"" + key + "\", a PLY file, was expected.");
    const fs::path named = entry[key].get<std::string>();
    std::error_code error;
    for (const fs::path& path : {session / named, session / "pointcloud" / named,
                                 session / "pointcloud" / named.filename()})
        if (fs::is_regular_file(path, error)) return path;
    throw CliError(ExitCode::kInput, (session / "pointcloud" / named.filename()).string() +
                                         ": this file was expected: " + key + " of clips.json.");
}

std::vector<cv::Point3f> seen_from(const std::vector<cv::Point3f>& cloud, const CameraPose& pose) {
    const CameraPose to_camera = pose.inverse();
    std::vector<cv::Point3f> points;
    points.reserve(cloud.size());
    for (const cv::Point3f& point : cloud)
        points.emplace_back(cv::Point3d(to_camera.rotation * cv::Vec3d(point.x, point.y, point.z) +
                                        to_camera.position));
    return points;
}

bool is_inside(const cv::Point2d& pixel, const cv::Size& size) {
    return pixel.x > -0.5 && pixel.y > -0.5 && pixel.x < size.width - 0.5 &&
           pixel.y < size.height - 0.5;
}

// 255 at pixels of the left image that show a point; mm of the left camera.
cv::Mat shown(const std::vector<cv::Point3f>& points, const CameraCalibration& camera,
              const cv::Size& size) {
    cv::Mat pixels(size, CV_8U, cv::Scalar(0));
    for (const cv::Point3f& point : points) {
        if (!(point.z > 0)) continue;
        const cv::Point2d pixel(camera.fx * point.x / point.z + camera.cx,
                                camera.fy * point.y / point.z + camera.cy);
        if (is_inside(pixel, size))
            pixels.at<std::uint8_t>(cvRound(pixel.y), cvRound(pixel.x)) = 255;
    }
    return pixels;
}

// Both clouds of a clip in the left camera, mm, and where the first image shows the first one.
struct Clouds {
    std::vector<cv::Point3f> start, end;
    cv::Mat covered;
};
Clouds read_clouds(const fs::path& clip, const fs::path& session, const CameraCalibration& camera,
                   const cv::Size& size) {
    const Json entry = read_entry(session / kClips, clip.filename().string());
    const fs::path start_file = geometry_of(session, entry, "start_geometry");
    std::vector<cv::Point3f> start = read_point_cloud(start_file);
    std::vector<cv::Point3f> end = read_point_cloud(geometry_of(session, entry, "end_geometry"));
    CameraPose at_start = read_pose(clip / "curated_camera_pose_start.txt");
    CameraPose at_end = read_pose(clip / "curated_camera_pose_end.txt");

    // A view into an abdomen is wider in mm, and narrower in m.
    constexpr float kWidestInMetres = 5;
    cv::Point3f low = start.front(), high = low;
    for (const cv::Point3f& point : start) {
        low = {std::min(low.x, point.x), std::min(low.y, point.y), std::min(low.z, point.z)};
        high = {std::max(high.x, point.x), std::max(high.y, point.y), std::max(high.z, point.z)};
    }
    const cv::Point3f sides = high - low;
    if (std::max({sides.x, sides.y, sides.z}) < kWidestInMetres) {
        for (auto* cloud : {&start, &end})
            for (cv::Point3f& point : *cloud) point *= kMillimetresPerMetre;
        for (CameraPose* pose : {&at_start, &at_end}) pose->position *= kMillimetresPerMetre;
    }

    // The data set does not say which way its poses lead: the one that fills more of the image.
    // From elsewhere the cloud is far away, or out of view.
    Clouds clouds;
    clouds.start = seen_from(start, at_start);
    clouds.covered = shown(clouds.start, camera, size);
    std::vector<cv::Point3f> inverse = seen_from(start, at_start.inverse());
    const cv::Mat covered = shown(inverse, camera, size);
    const int count = cv::countNonZero(clouds.covered), of_inverse = cv::countNonZero(covered);
    if (count == 0 && of_inverse == 0)
        throw CliError(ExitCode::kInput, start_file.string() +
                                             ": the left camera sees none of these points from "
                                             "curated_camera_pose_start.txt.");
    const bool is_inverse = of_inverse > count;
    if (is_inverse) {
        clouds.start = std::move(inverse);
        clouds.covered = covered;
    }
    clouds.end = seen_from(end, is_inverse ? at_end.inverse() : at_end);
    return clouds;
}

std::vector<fs::path> images_in(const fs::path& folder) {
    std::vector<fs::path> images;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error))
        if (entry.path().extension() == ".png") images.push_back(entry.path());
    std::sort(images.begin(), images.end(), [](const fs::path& a, const fs::path& b) {
        return precedes_by_name(a.filename().string(), b.filename().string());
    });
    return images;
}

// Masks of the first and the last image: 255 at instruments, else 0. Without files all are 0.
struct Instruments {
    cv::Mat first, last;
};
Instruments read_instruments(const fs::path& clip, std::size_t images, const cv::Size& size) {
    const fs::path folder = clip / kMasks;
    std::error_code error;
    if (!fs::exists(folder, error))
        return {cv::Mat(size, CV_8U, cv::Scalar(0)), cv::Mat(size, CV_8U, cv::Scalar(0))};
    const std::vector<fs::path> masks = images_in(folder);
    if (masks.size() != images)
        throw CliError(ExitCode::kInput, folder.string() + ": a mask for each of " +
                                             std::to_string(images) +
                                             " left images was expected; there are " +
                                             std::to_string(masks.size()) + ".");
    const auto read = [&](const fs::path& path) {
        const cv::Mat mask = read_image(path, cv::IMREAD_GRAYSCALE);
        if (mask.size() != size)
            throw CliError(ExitCode::kInput,
                           path.string() + ": a mask of the images' size was expected.");
        return cv::Mat(mask > 0);
    };
    Instruments instruments{read(masks.front()), read(masks.back())};
    // Nothing says what is marked; instruments take less of the images than tissue.
    const int marked = cv::countNonZero(instruments.first) + cv::countNonZero(instruments.last);
    if (marked > size.area()) {
        cv::bitwise_not(instruments.first, instruments.first);
        cv::bitwise_not(instruments.last, instruments.last);
    }
    return instruments;
}

// Points of the first image that show tissue of the start's cloud.
std::vector<cv::Point2d> followed_points(const cv::Mat& covered, const cv::Mat& instruments) {
    constexpr std::size_t kFewest = 10;
    const double spacing = static_cast<double>(covered.cols) / kColumns;
    // A cloud has gaps between its points.
    const int reach = cvRound(spacing / 4);
    cv::Mat near_cloud;
    cv::dilate(covered, near_cloud,
               cv::getStructuringElement(cv::MORPH_RECT, {2 * reach + 1, 2 * reach + 1}));
    std::vector<cv::Point2d> points;
    for (double v = spacing / 2; v < covered.rows - 1; v += spacing) {
        for (double u = spacing / 2; u < covered.cols - 1; u += spacing) {
            const cv::Point pixel(cvRound(u), cvRound(v));
            if (near_cloud.at<std::uint8_t>(pixel) != 0 && instruments.at<std::uint8_t>(pixel) == 0)
                points.emplace_back(u, v);
        }
    }
    if (points.size() >= kFewest) return points;
    throw CliError(ExitCode::kInput, "the first left image shows the start's cloud at " +
                                         std::to_string(points.size()) +
                                         " of the points of a grid; at least " +
                                         std::to_string(kFewest) +
                                         " were expected: pose, cameras or cloud are of "
                                         "something else.");
}

class D4d : public DataSet {
  public:
    std::string name() const override { return "d4d"; }
    std::string summary() const override {
        return "D4D: the surface at a clip's end, against structured light";
    }
    std::string layout() const override {
        return "specimen_N/SESSION/{clips.json, camera_info/, pointcloud/, clips/Clip_N/}, in a "
               "clip left_images_rect/, right_images_rect/, curated_camera_pose_start.txt and "
               "curated_camera_pose_end.txt";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::is_directory(folder / kLeft, error);
    }

    std::vector<std::string> sample_columns() const override {
        return {"point", "visible", "start_mm", "end_mm"};
    }
    std::vector<Metric> metrics() const override {
        return {{"visible_mean_mm"},  {"visible_median_mm"},  {"visible_p95_mm"},
                {"occluded_mean_mm"}, {"occluded_median_mm"}, {"occluded_p95_mm"},
                {"lost_share"},       {"start_median_mm"}};
    }
    std::vector<double> summarise(const Samples& samples) const override {
        std::vector<double> visible, occluded, start;
        double lost = 0;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            if (!std::isnan(samples.at(i, kStartMm))) start.push_back(samples.at(i, kStartMm));
            const double error = samples.at(i, kEndMm);
            if (std::isnan(error))
                ++lost;
            else
                (samples.at(i, kVisible) != 0 ? visible : occluded).push_back(error);
        }
        std::vector<double> values;
        for (std::vector<double>* errors : {&visible, &occluded}) {
            std::sort(errors->begin(), errors->end());
            double sum = 0;
            for (const double error : *errors) sum += error;
            const auto count = static_cast<double>(errors->size());
            values.push_back(errors->empty() ? kNoPlace : sum / count);
            values.push_back(percentile(*errors, 0.5));
            values.push_back(percentile(*errors, 0.95));
        }
        std::sort(start.begin(), start.end());
        values.push_back(samples.size() > 0 ? lost / static_cast<double>(samples.size())
                                            : kNoPlace);
        values.push_back(percentile(start, 0.5));
        return values;
    }

    std::vector<fs::path> inputs_of(const fs::path& clip) const override {
        const fs::path session = session_of(clip);
        return {clip, session / kClips, session / "camera_info", session / "pointcloud"};
    }
    ClipScore run(const ClipTask& task) const override {
        const fs::path folder = fs::absolute(task.folder).lexically_normal();
        const fs::path session = session_of(folder);
        require_entries(folder, {{kLeft, "the rectified left images", true},
                                 {kRight, "the rectified right images", true},
                                 {"curated_camera_pose_start.txt", "the left camera's pose, 4x4"},
                                 {"curated_camera_pose_end.txt", "the left camera's pose, 4x4"}});
        require_entries(session, {{kClips, "name, start_geometry and end_geometry of each clip"}});
        PointClip clip;
        clip.source.left = (folder / kLeft).string();
        clip.source.right = (folder / kRight).string();
        clip.calibration = read_cameras(folder, session);
        cv::Size size;
        {
            const FrameSource source(clip.source);
            size = {source.width(), source.height()};
            fit_to_frames(clip.calibration, size.width, size.height);
        }
        Clouds clouds = read_clouds(folder, session, clip.calibration.left, size);
        const Instruments instruments =
            read_instruments(folder, images_in(folder / kLeft).size(), size);
        clip.points = followed_points(clouds.covered, instruments.first);

        const PointTracks tracks(task, clip);
        const PointCloud start(std::move(clouds.start)), end(std::move(clouds.end));
        ClipScore score{Samples(sample_columns()), 0, {}, {}, {}};
        std::vector<MarkedPoint> marks;
        for (std::size_t i = 0; i < clip.points.size(); ++i) {
            const FoundPoint &before = tracks.at(tracks.first(), i),
                             &after = tracks.at(tracks.last(), i);
            const bool is_visible =
                after.has_place() && is_inside(after.px, size) &&
                instruments.last.at<std::uint8_t>(cvRound(after.px.y), cvRound(after.px.x)) == 0;
            const double error = after.has_place() ? end.distance(after.mm) : kNoPlace;
            score.samples.add({static_cast<double>(i), is_visible ? 1.0 : 0.0,
                               before.has_place() ? start.distance(before.mm) : kNoPlace, error});
            if (!is_visible) continue;
            const bool is_near = error < kFarMm;
            marks.push_back({after.px.x, after.px.y, is_near ? after.px.x : kNoPlace,
                             is_near ? after.px.y : kNoPlace});
        }
        set_times(task.out, score);
        score.picture = picture_of(clip.source, tracks.last(), marks);
        score.remark = "frame " + std::to_string(tracks.last()) + ": mean " +
                       format_fixed(summarise(score.samples).front(), 2) + " mm; red: more than " +
                       format_fixed(kFarMm, 0) + " mm off";
        const std::string state = state_of(task.out, tracks.last());
        if (!state.empty()) score.remark += "; " + state;
        return score;
    }

  private:
    static constexpr double kFarMm = 3;  // marked in the picture
};

}  // namespace

std::unique_ptr<DataSet> make_d4d() { return std::make_unique<D4d>(); }

}  // namespace defrec::cli
