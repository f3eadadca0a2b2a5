// SCARED: depth of the left image, of keyframes and of the sequences that begin with them.
#include <cmath>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "sdk/evaluation/data_sets/depth_clip.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr char kCalibration[] = "endoscope_calibration.yaml";
// Frames whose truth covers less of the image are not counted.
constexpr double kMinTruthShare = 0.1;

enum Column { kFrame, kTruthShare, kFoundShare, kMeanAbs, kMedianAbs };

bool is_sequence(const fs::path& clip) {
    std::error_code error;
    return clip.filename() == "data" && fs::exists(clip.parent_path() / kCalibration, error);
}

// Depth of the first `size.height` rows of an image of x, y, z in mm. OpenCV gives a colour image's
// channels in reverse.
cv::Mat read_truth(const fs::path& path, cv::Size size, bool is_stacked) {
    const cv::Mat points = read_image(path, cv::IMREAD_UNCHANGED);
    const int rows = is_stacked ? 2 * size.height : size.height;
    if (points.type() != CV_32FC3 || points.cols != size.width || points.rows != rows) {
        throw CliError(ExitCode::kInput,
                       path.string() + ": an image of three floats for each pixel, " +
                           std::to_string(size.width) + "x" + std::to_string(rows) +
                           ", was expected; it is " + std::to_string(points.cols) + "x" +
                           std::to_string(points.rows) + ", with " +
                           std::to_string(points.channels()) + " channels of " +
                           std::to_string(8 * points.elemSize1()) + " bits.");
    }
    cv::Mat depth;
    cv::extractChannel(points.rowRange(0, size.height), depth, 0);
    return depth;
}

// The truth of each frame, by the digits in its file's name.
std::map<std::int64_t, fs::path> truth_files(const fs::path& folder) {
    std::map<std::int64_t, fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string extension = entry.path().extension().string();
        if (extension != ".tiff" && extension != ".tif") continue;
        std::string digits;
        for (const char c : entry.path().stem().string())
            if (c >= '0' && c <= '9') digits += c;
        const auto frame = parse_integer(digits);
        if (!frame || !files.emplace(*frame, entry.path()).second) {
            throw CliError(ExitCode::kInput,
                           entry.path().string() +
                               ": a name with the number of a frame of its own was expected, "
                               "scene_points000000.tiff.");
        }
    }
    if (files.empty()) {
        throw CliError(ExitCode::kInput,
                       folder.string() + ": files scene_points000000.tiff were expected here.");
    }
    return files;
}

StereoCalibration read_calibration(const fs::path& file, LengthUnit units, cv::Size size) {
    StereoCalibration calibration = load_calibration(file.string(), units);
    fit_to_frames(calibration, size.width, size.height);
    return calibration;
}

void add_frame(DepthClip& clip, const StereoFrame& frame, const cv::Mat& truth) {
    const cv::Mat depth = clip.measure(frame);
    if (truth.empty()) return;
    clip.write(frame.index, depth);
    const DepthErrors errors = errors_of(truth, depth);
    clip.samples().add({static_cast<double>(frame.index), errors.truth_share, errors.found_share,
                        errors.mean_abs_mm, errors.median_abs_mm});
    if (errors.truth_share < kMinTruthShare) return;
    clip.consider(errors.mean_abs_mm, frame, truth, depth,
                  "frame " + std::to_string(frame.index) + ": mean error " +
                      format_fixed(errors.mean_abs_mm, 2) + " mm, depth found in " +
                      format_fixed(100 * errors.found_share, 0) + " % of the truth");
}

class Scared : public DataSet {
  public:
    std::string name() const override { return "scared"; }
    bool has_units() const override { return true; }
    std::string summary() const override { return "SCARED: depth of the left image"; }
    std::string layout() const override {
        return "dataset_D/keyframe_K/ with endoscope_calibration.yaml, Left_Image.png, "
               "Right_Image.png and left_depth_map.tiff; for sequences also data/rgb.mp4 and, "
               "unpacked, data/scene_points/";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::exists(folder / kCalibration, error) ||
               (is_sequence(folder) && fs::exists(folder / "rgb.mp4", error));
    }

    std::vector<std::string> sample_columns() const override {
        return {"frame", "truth_share", "found_share", "mean_abs_mm", "median_abs_mm"};
    }
    std::vector<Metric> metrics() const override {
        return {
            {"mean_abs_mm"}, {"median_abs_mm"}, {"found_share", true}, {"frames_counted", true}};
    }
    std::vector<double> summarise(const Samples& samples) const override {
        double mean = 0, median = 0, found = 0, with_depth = 0, counted = 0;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            if (samples.at(i, kTruthShare) < kMinTruthShare) continue;
            ++counted;
            found += samples.at(i, kFoundShare);
            if (std::isnan(samples.at(i, kMeanAbs))) continue;
            ++with_depth;
            mean += samples.at(i, kMeanAbs);
            median += samples.at(i, kMedianAbs);
        }
        const auto mean_of = [](double sum, double count) {
            return count > 0 ? sum / count : kNone;
        };
        return {mean_of(mean, with_depth), mean_of(median, with_depth), mean_of(found, counted),
                counted};
    }

    std::vector<fs::path> inputs_of(const fs::path& clip) const override {
        if (!is_sequence(clip)) return {clip};
        return {clip, clip.parent_path() / kCalibration};
    }
    ClipScore run(const ClipTask& task) const override {
        DepthClip clip(task, *this);
        if (is_sequence(task.folder))
            run_sequence(task, clip);
        else
            run_keyframe(task, clip);
        return clip.finish();
    }

  private:
    static void run_keyframe(const ClipTask& task, DepthClip& clip) {
        const fs::path& folder = task.folder;
        require_entries(folder, {{kCalibration, "OpenCV stereo YAML, M1 D1 M2 D2 R T in mm"},
                                 {"Left_Image.png", "the left image"},
                                 {"Right_Image.png", "the right image"},
                                 {"left_depth_map.tiff", "x, y, z in mm of each left pixel"}});
        const cv::Mat left = read_image(folder / "Left_Image.png", cv::IMREAD_COLOR);
        const cv::Mat right = read_image(folder / "Right_Image.png", cv::IMREAD_COLOR);
        if (left.size() != right.size()) {
            throw CliError(ExitCode::kInput, (folder / "Right_Image.png").string() +
                                                 ": the right image has not the left one's size.");
        }
        clip.begin(read_calibration(folder / kCalibration, task.settings.units, left.size()),
                   left.channels());
        add_frame(clip, frame_of(left, right, 0),
                  read_truth(folder / "left_depth_map.tiff", left.size(), false));
    }

    static void run_sequence(const ClipTask& task, DepthClip& clip) {
        const fs::path& folder = task.folder;
        require_entries(folder,
                        {{"rgb.mp4", "video of both views, the left one on top"},
                         {"scene_points", "what scene_points.tar.gz holds, unpacked", true}});
        const std::map<std::int64_t, fs::path> files = truth_files(folder / "scene_points");
        SourceOptions options;
        options.stereo = (folder / "rgb.mp4").string();
        options.layout = Layout::kTopBottom;
        FrameSource source(options);
        const cv::Size size(source.width(), source.height());
        clip.begin(read_calibration(folder.parent_path() / kCalibration, task.settings.units, size),
                   source.channels());
        StereoFrame frame;
        while (source.next(frame)) {
            const auto file = files.find(frame.index);
            add_frame(clip, frame,
                      file == files.end() ? cv::Mat() : read_truth(file->second, size, true));
        }
        if (!source.fault().empty()) throw CliError(ExitCode::kInput, source.fault());
    }
};

}  // namespace

std::unique_ptr<DataSet> make_scared() { return std::make_unique<Scared>(); }

}  // namespace defrec::cli
