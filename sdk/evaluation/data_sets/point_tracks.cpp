// Points of a clip that are tracked.
#include "sdk/evaluation/data_sets/point_tracks.hpp"

#include <algorithm>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/client/library.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

std::string matrix_text(const char* name, int rows, int cols, const std::vector<double>& values) {
    std::string text = std::string(name) + ": {rows: " + std::to_string(rows) +
                       ", cols: " + std::to_string(cols) + ", dt: d, data: [";
    for (std::size_t i = 0; i < values.size(); ++i)
        text.append(i > 0 ? ", " : "").append(exact(values[i]));
    return text + "]}\n";
}

// x_left = result * x_rectified.
cv::Matx33d from_rectified(StereoCalibration calibration, const SourceOptions& source) {
    const FrameSource reader(source);
    fit_to_frames(calibration, reader.width(), reader.height());
    const Context context = open_context({1, true, {}});
    const Rig rig = make_rig(context, calibration);
    return cv::Matx33d(rig_info(rig).rotation).t();
}

}  // namespace

void write_calibration(const fs::path& path, const StereoCalibration& calibration) {
    std::string text;
    const auto add_camera = [&](const char* matrix, const char* distortion,
                                const CameraCalibration& camera) {
        text +=
            matrix_text(matrix, 3, 3, {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1});
        if (!camera.distortion.empty()) {
            text += matrix_text(distortion, 1, static_cast<int>(camera.distortion.size()),
                                camera.distortion);
        }
    };
    add_camera("M1", "D1", calibration.left);
    add_camera("M2", "D2", calibration.right);
    const auto& r = calibration.rotation;
    const auto& t = calibration.translation;
    text += matrix_text("R", 3, 3, {r.begin(), r.end()});
    text += matrix_text("T", 3, 1, {t.begin(), t.end()});
    write_atomically(path, text);
}

PointTracks::PointTracks(const ClipTask& task, const PointClip& clip)
    : first_(clip.source.range.first) {
    const fs::path calibration = task.out / "calibration.yaml", points = task.out / "followed.csv";
    write_calibration(calibration, clip.calibration);
    std::string text = "id,u,v\n";
    for (std::size_t i = 0; i < clip.points.size(); ++i) {
        text.append(std::to_string(i)).append(",");
        text.append(exact(clip.points[i].x)).append(",").append(exact(clip.points[i].y));
        text += '\n';
    }
    write_atomically(points, text);
    TrackOptions options;
    options.source = clip.source;
    options.calibration = calibration.string();
    options.units = LengthUnit::kMillimetre;
    options.points = points.string();
    track_clip(task, options);

    frames_.assign(frame_times_in(task.out).size(), std::vector<FoundPoint>(clip.points.size()));
    const cv::Matx33d rotation = from_rectified(clip.calibration, clip.source);
    CsvReader rows(task.out / "points.csv", {"frame", "id", "x", "y", "z", "u", "v", "status"});
    while (rows.next()) {
        if (rows.is_empty(2)) continue;
        FoundPoint& point = frames_.at(static_cast<std::size_t>(rows.integer(0) - first_))
                                .at(static_cast<std::size_t>(rows.integer(1)));
        point.mm = rotation * cv::Point3d(rows.number(2), rows.number(3), rows.number(4));
        if (!rows.is_empty(5)) point.px = {rows.number(5), rows.number(6)};
        point.is_tracked = rows.field(7) == name_of(PointStatus::kTracked);
    }
}

FoundPoint PointTracks::last_known(std::int64_t frame, std::size_t point) const {
    for (std::int64_t i = frame; i >= first_; --i)
        if (at(i, point).has_place()) return at(i, point);
    return {};
}

std::string json_of(const cv::Point2d& point) {
    return std::string("[").append(exact(point.x)).append(",").append(exact(point.y)).append("]");
}

std::string json_of(const cv::Point3d& point) {
    std::string text("[");
    text.append(exact(point.x)).append(",").append(exact(point.y)).append(",");
    return text.append(exact(point.z)).append("]");
}

}  // namespace defrec::cli
