// Rectified Hamlyn sequences as EDaM has them: depth, against that of a stereo matcher.
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "sdk/evaluation/data_sets/depth_clip.hpp"
#include "sdk/evaluation/data_sets/hamlyn_errors.hpp"
#include "sdk/input/image_stream.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr char kIntrinsics[] = "intrinsics.txt", kExtrinsics[] = "extrinsics.txt";
constexpr double kNearest = 1, kFarthest = 300;  // mm; other depths are unknown

std::vector<double> read_numbers(const fs::path& path, const std::vector<std::size_t>& counts,
                                 const std::string& shape) {
    constexpr std::size_t kLargestFile = 100'000;
    std::string text = read_text_file(path, kLargestFile, ExitCode::kCalibration);
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '\n' || c == '\t' || c == ','; }, ' ');
    std::vector<double> numbers;
    for (const std::string_view field : split(text, ' '))
        if (!field.empty()) numbers.push_back(parse_double(field).value_or(kNone));
    const bool is_matrix =
        std::find(counts.begin(), counts.end(), numbers.size()) != counts.end() &&
        std::all_of(numbers.begin(), numbers.end(),
                    [](double number) { return std::isfinite(number); });
    if (is_matrix) return numbers;
    throw CliError(ExitCode::kCalibration, path.string() + ": " + shape + " was expected.");
}

StereoCalibration read_calibration(const fs::path& folder, cv::Size size) {
    const auto k = read_numbers(folder / kIntrinsics, {9, 12, 16}, "a 3x3, 3x4 or 4x4 matrix");
    const auto pose = read_numbers(folder / kExtrinsics, {12, 16},
                                   "a 3x4 or 4x4 matrix, x_right = R x_left + T in mm,");
    const std::size_t columns = k.size() == 9 ? 3 : 4;
    StereoCalibration rig;
    rig.left = {k[0], k[columns + 1], k[2], k[columns + 2], {}, {}, {}};
    rig.left.matrix_origin = rig.left.distortion_origin = (folder / kIntrinsics).string();
    rig.right = rig.left;
    for (std::size_t row = 0; row < 3; ++row) {
        std::copy_n(pose.begin() + static_cast<std::ptrdiff_t>(4 * row), 3,
                    rig.rotation.begin() + static_cast<std::ptrdiff_t>(3 * row));
        rig.translation[row] = pose[4 * row + 3];
    }
    rig.rotation_origin = rig.translation_origin = (folder / kExtrinsics).string();
    detail::check_and_normalise(rig, LengthUnit::kGuarded, LengthUnit::kMillimetre);
    fit_to_frames(rig, size.width, size.height);
    return rig;
}

cv::Mat read_depth(const fs::path& path, cv::Size size) {
    const cv::Mat image = read_image(path, cv::IMREAD_UNCHANGED);
    if (image.type() != CV_16UC1 || image.size() != size) {
        throw CliError(ExitCode::kInput, path.string() + ": a gray image of 16 bits and " +
                                             std::to_string(size.width) + "x" +
                                             std::to_string(size.height) + " was expected, mm.");
    }
    cv::Mat depth;
    image.convertTo(depth, CV_32F);
    depth.setTo(0, (depth < kNearest) | (depth > kFarthest));
    return depth;
}

// Folder of the sequence's images, or of the variant that has the images in a folder of its own
// name.
fs::path images_in(const fs::path& clip, const std::vector<std::string>& names,
                   const std::string& what) {
    std::error_code error;
    std::string tried;
    for (const std::string& name : names) {
        for (const fs::path& folder : {clip / name, clip / clip.filename() / name})
            if (fs::is_directory(folder, error)) return folder;
        tried.append(tried.empty() ? "" : " or ").append(name);
    }
    throw CliError(ExitCode::kInput,
                   clip.string() + ": " + tried + ", " + what + ", was expected here.");
}

class Hamlyn : public DataSet {
  public:
    std::string name() const override { return "hamlyn"; }
    std::string summary() const override {
        return "rectified Hamlyn (EDaM): depth, against that of a stereo matcher";
    }
    std::string layout() const override {
        return "rectifiedNN/ with color/ or image01/, image02/, depth/, intrinsics.txt and "
               "extrinsics.txt";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::exists(folder / kIntrinsics, error);
    }

    std::vector<std::string> sample_columns() const override {
        std::vector<std::string> columns{"frame"};
        for (const Metric& metric : metrics()) columns.push_back(metric.name);
        return columns;
    }
    std::vector<Metric> metrics() const override {
        return {{"pseudo_mean_abs_mm"},
                {"pseudo_rms_mm"},
                {"pseudo_abs_rel"},
                {"pseudo_within_1.25_share", true},
                {"pseudo_found_share", true}};
    }
    // Means over frames.
    std::vector<double> summarise(const Samples& samples) const override {
        return means_of(samples);
    }

    ClipScore run(const ClipTask& task) const override {
        const fs::path folder = fs::absolute(task.folder).lexically_normal();
        require_entries(folder, {{kIntrinsics, "3x3, or 3x4, matrix of both cameras"},
                                 {kExtrinsics, "3x4, or 4x4, pose of the right camera, mm"}});
        SourceOptions options;
        options.left = images_in(folder, {"color", "image01"}, "the left images").string();
        options.right = images_in(folder, {"image02"}, "the right images").string();
        const auto truth = ImageStream::open(images_in(folder, {"depth"}, "the depth").string());
        FrameSource source(options);
        const cv::Size size(source.width(), source.height());
        const std::vector<fs::path>& files = truth->files();
        if (source.expected() != static_cast<std::int64_t>(files.size())) {
            throw CliError(ExitCode::kInput, truth->source() + ": as many images as in " +
                                                 options.left + " were expected; there are " +
                                                 std::to_string(files.size()) + ".");
        }
        DepthClip clip(task, *this);
        clip.begin(read_calibration(folder, size), source.channels());
        StereoFrame frame;
        while (source.next(frame)) {
            const cv::Mat is = read_depth(files.at(static_cast<std::size_t>(frame.index)), size);
            const cv::Mat depth = clip.measure(frame);
            clip.write(frame.index, depth);
            const HamlynErrors errors = hamlyn_errors(is, depth);
            clip.samples().add({static_cast<double>(frame.index), errors.mean_abs_mm, errors.rms_mm,
                                errors.abs_rel, errors.within_share, errors.found_share});
            clip.consider(errors.mean_abs_mm, frame, is, depth,
                          "frame " + std::to_string(frame.index) + ": mean difference " +
                              format_fixed(errors.mean_abs_mm, 2) + " mm from the other matcher");
        }
        if (!source.fault().empty()) throw CliError(ExitCode::kInput, source.fault());
        return clip.finish();
    }
};

}  // namespace

HamlynErrors hamlyn_errors(const cv::Mat& truth, const cv::Mat& depth) {
    constexpr double kRatio = 1.25;
    double known = 0, count = 0, sum = 0, squares = 0, relative = 0, within = 0;
    for (int v = 0; v < truth.rows; ++v) {
        for (int u = 0; u < truth.cols; ++u) {
            const double is = truth.at<float>(v, u), found = depth.at<float>(v, u);
            if (!(is > 0)) continue;
            ++known;
            if (!(found > 0)) continue;
            ++count;
            const double error = std::abs(found - is);
            sum += error;
            squares += error * error;
            relative += error / is;
            within += std::max(found / is, is / found) < kRatio ? 1 : 0;
        }
    }
    const double found_share = known > 0 ? count / known : kNone;
    if (count == 0) return {kNone, kNone, kNone, kNone, found_share};
    return {sum / count, std::sqrt(squares / count), relative / count, within / count, found_share};
}

std::unique_ptr<DataSet> make_hamlyn() { return std::make_unique<Hamlyn>(); }

}  // namespace defrec::cli
