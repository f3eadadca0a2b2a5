// SERV-CT: disparity and depth of rectified images, against CT.
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "sdk/evaluation/data_sets/depth_clip.hpp"
#include "sdk/evaluation/data_sets/json_file.hpp"
#include "sdk/evaluation/data_sets/serv_ct_errors.hpp"
#include "sdk/evaluation/score/percentile.hpp"
#include "sdk/input/image_stream.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
// 16-bit images hold 256 times the value; 0 is unknown.
constexpr double kScale = 256;

StereoCalibration read_calibration(const fs::path& path, cv::Size size) {
    const nlohmann::json json = read_json_object(path, "P1 and P2", ExitCode::kCalibration);
    constexpr char kShape[] = "a 3x4 matrix of numbers";
    const auto left = matrix_of(path, json, "P1", {12}, kShape);
    const auto right = matrix_of(path, json, "P2", {12}, kShape);
    StereoCalibration calibration;
    const auto camera_of = [](const std::vector<double>& p, const std::string& origin) {
        CameraCalibration camera{p[0], p[5], p[2], p[6], {}, {}, {}};
        camera.matrix_origin = camera.distortion_origin = origin;
        return camera;
    };
    calibration.left = camera_of(left, path.string() + ": P1");
    calibration.right = camera_of(right, path.string() + ": P2");
    calibration.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    calibration.translation = {right[0] != 0 ? right[3] / right[0] : 0, 0, 0};
    calibration.rotation_origin = calibration.translation_origin = path.string() + ": P2";
    detail::check_and_normalise(calibration, LengthUnit::kGuarded, LengthUnit::kMillimetre);
    fit_to_frames(calibration, size.width, size.height);
    return calibration;
}

cv::Mat read_values(const fs::path& path, cv::Size size) {
    const cv::Mat image = read_image(path, cv::IMREAD_UNCHANGED);
    if (image.type() != CV_16UC1 || image.size() != size) {
        throw CliError(ExitCode::kInput, path.string() + ": a gray image of 16 bits and " +
                                             std::to_string(size.width) + "x" +
                                             std::to_string(size.height) +
                                             " was expected, 256 times the value.");
    }
    cv::Mat values;
    image.convertTo(values, CV_32F, 1 / kScale);
    return values;
}

const std::vector<Needed>& needed_folders() {
    static const std::vector<Needed> folders{
        {"Left_rectified", "rectified left images 001.png, ...", true},
        {"Right_rectified", "rectified right images of the same names", true},
        {"Rectified_calibration", "001.json, ... with P1, P2 and Q", true},
        {"Ground_truth_CT/DepthL", "depth of the left images, 16 bits, 256 x mm", true},
        {"Ground_truth_CT/Disparity", "disparity of the left images, 16 bits, 256 x px", true},
        {"Ground_truth_CT/OcclusionL", "colours of what is occluded", true}};
    return folders;
}

class ServCt : public DataSet {
  public:
    std::string name() const override { return "serv-ct"; }
    std::string summary() const override {
        return "SERV-CT: disparity and depth of rectified images, against CT";
    }
    std::string layout() const override {
        return "Experiment_E/ with Left_rectified/, Right_rectified/, Rectified_calibration/ and "
               "Ground_truth_CT/{DepthL, Disparity, OcclusionL}/";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::is_directory(folder / "Left_rectified", error);
    }

    std::vector<std::string> sample_columns() const override {
        std::vector<std::string> columns{"image"};
        for (const Metric& metric : metrics()) columns.push_back(metric.name);
        return columns;
    }
    std::vector<Metric> metrics() const override {
        std::vector<Metric> metrics;
        for (const char* part : {"", "_visible"}) {
            for (const char* name :
                 {"epe_px", "rms_px", "bad3_share", "mae_mm", "rms_mm", "median_mm"})
                metrics.push_back({std::string(name) + part});
            metrics.push_back({std::string("found_share") + part, true});
        }
        return metrics;
    }
    // Means over images.
    std::vector<double> summarise(const Samples& samples) const override {
        return means_of(samples);
    }

    ClipScore run(const ClipTask& task) const override {
        require_entries(task.folder, needed_folders());
        DepthClip clip(task, *this);
        const auto images = ImageStream::open((task.folder / "Left_rectified").string());
        for (const fs::path& file : images->files()) add_image(task.folder, file.stem(), clip);
        return clip.finish();
    }

  private:
    static void add_image(const fs::path& folder, const fs::path& stem, DepthClip& clip) {
        const std::string png = stem.string() + ".png";
        const fs::path truth = folder / "Ground_truth_CT";
        require_entries(folder,
                        {{"Right_rectified/" + png, "the right image of this number"},
                         {"Rectified_calibration/" + stem.string() + ".json", "P1, P2 and Q"},
                         {"Ground_truth_CT/DepthL/" + png, "depth, 16 bits, 256 x mm"},
                         {"Ground_truth_CT/Disparity/" + png, "disparity, 16 bits, 256 x px"},
                         {"Ground_truth_CT/OcclusionL/" + png, "colours of what is occluded"}});
        const auto number = parse_integer(stem.string().substr(
            std::min(stem.string().find_first_not_of('0'), stem.string().size() - 1)));
        if (!number) {
            throw CliError(ExitCode::kInput, (folder / "Left_rectified" / png).string() +
                                                 ": a number was expected as its name, 001.png.");
        }
        const cv::Mat left = read_image(folder / "Left_rectified" / png, cv::IMREAD_COLOR);
        const cv::Mat right = read_image(folder / "Right_rectified" / png, cv::IMREAD_COLOR);
        if (left.size() != right.size()) {
            throw CliError(ExitCode::kInput, (folder / "Right_rectified" / png).string() +
                                                 ": the right image has not the left one's size.");
        }
        const StereoCalibration calibration = read_calibration(
            folder / "Rectified_calibration" / (stem.string() + ".json"), left.size());
        ServCtImage image;
        image.true_depth = read_values(truth / "DepthL" / png, left.size());
        image.true_disparity = read_values(truth / "Disparity" / png, left.size());
        image.occlusion = read_image(truth / "OcclusionL" / png, cv::IMREAD_COLOR);
        if (image.occlusion.size() != left.size()) {
            throw CliError(ExitCode::kInput, (truth / "OcclusionL" / png).string() +
                                                 ": it has not the left image's size.");
        }
        const StereoFrame frame = frame_of(left, right, *number);
        clip.begin(calibration, left.channels());
        image.depth = clip.measure(frame);
        image.focal_baseline = calibration.left.fx * -calibration.translation[0];
        image.disparity_offset = calibration.left.cx - calibration.right.cx;
        clip.write(*number, image.depth);
        std::vector<double> row{static_cast<double>(*number)};
        const ServCtErrors all = errors_of(image, false), visible = errors_of(image, true);
        for (const ServCtErrors& errors : {all, visible}) {
            row.insert(row.end(), {errors.epe_px, errors.rms_px, errors.bad3_share, errors.mae_mm,
                                   errors.rms_mm, errors.median_mm, errors.found_share});
        }
        clip.samples().add(row);
        clip.consider(all.mae_mm, frame, image.true_depth, image.depth,
                      "image " + stem.string() + ": mean error " + format_fixed(all.mae_mm, 2) +
                          " mm, " + format_fixed(all.epe_px, 2) + " px, depth found in " +
                          format_fixed(100 * all.found_share, 0) + " % of the truth");
    }
};

}  // namespace

ServCtErrors errors_of(const ServCtImage& image, bool only_visible) {
    std::vector<double> depth_errors;
    double known = 0, px = 0, px_squares = 0, bad = 0, mm = 0, mm_squares = 0;
    for (int v = 0; v < image.depth.rows; ++v) {
        for (int u = 0; u < image.depth.cols; ++u) {
            // Blue, green, red. Blue: no truth; yellow, red and green: seen by one view only, or
            // outside of the other.
            const auto colour = image.occlusion.at<cv::Vec3b>(v, u);
            constexpr int kHigh = 128;
            const bool blue = colour[0] >= kHigh, green = colour[1] >= kHigh,
                       red = colour[2] >= kHigh;
            if (blue && !green && !red) continue;
            if (only_visible && !blue && (green || red)) continue;
            const double true_depth = image.true_depth.at<float>(v, u);
            const double true_disparity = image.true_disparity.at<float>(v, u);
            if (!(true_depth > 0) || !(true_disparity > 0)) continue;
            ++known;
            const double depth = image.depth.at<float>(v, u);
            if (!(depth > 0)) continue;
            const double disparity = image.focal_baseline / depth + image.disparity_offset;
            const double error_px = std::abs(disparity - true_disparity);
            const double error_mm = std::abs(depth - true_depth);
            px += error_px;
            px_squares += error_px * error_px;
            bad += error_px > 3 ? 1 : 0;
            mm += error_mm;
            mm_squares += error_mm * error_mm;
            depth_errors.push_back(error_mm);
        }
    }
    const auto count = static_cast<double>(depth_errors.size());
    const double found_share = known > 0 ? count / known : kNone;
    if (depth_errors.empty()) return {kNone, kNone, kNone, kNone, kNone, kNone, found_share};
    std::sort(depth_errors.begin(), depth_errors.end());
    return {px / count, std::sqrt(px_squares / count), bad / count,
            mm / count, std::sqrt(mm_squares / count), percentile(depth_errors, 0.5),
            found_share};
}

std::unique_ptr<DataSet> make_serv_ct() { return std::make_unique<ServCt>(); }

}  // namespace defrec::cli
