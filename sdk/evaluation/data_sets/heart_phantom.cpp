// The silicone heart phantom of the Hamlyn data set: depth, against a CT scan's at each of 20 times
// of a beat.
#include "sdk/evaluation/data_sets/heart_phantom.hpp"

#include <algorithm>
#include <vector>

#include "sdk/evaluation/data_sets/depth_clip.hpp"
#include "sdk/evaluation/data_sets/hamlyn_errors.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kCalibration[] = "calibration.yaml", kPhase[] = "phase.txt";
constexpr std::size_t kLargestFile = 100'000'000;

fs::path map_path(const fs::path& folder, int map) {
    return folder / ("heartDepthMap_" + std::to_string(map) + ".txt");
}

// The video of a view: the only file whose name ends so, whatever comes before.
fs::path video_in(const fs::path& folder, const std::string& ending) {
    std::vector<fs::path> found;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        const std::string stem = entry.path().stem().string(),
                          extension = entry.path().extension().string();
        const bool is_video = extension == ".avi" || extension == ".mp4";
        if (is_video && stem.size() >= ending.size() &&
            stem.compare(stem.size() - ending.size(), ending.size(), ending) == 0)
            found.push_back(entry.path());
    }
    if (found.size() == 1) return found.front();
    throw CliError(ExitCode::kInput, folder.string() + ": one video *" + ending + ".avi or *" +
                                         ending + ".mp4 was expected here; there are " +
                                         std::to_string(found.size()) + ".");
}

// z of each line "x y z", row after row of the left image; 0: unknown.
cv::Mat read_map(const fs::path& path, cv::Size size) {
    const std::string text = read_text_file(path, kLargestFile, ExitCode::kInput);
    cv::Mat depth(size, CV_32F, cv::Scalar(0));
    int line = 0;
    for (const std::string_view row : split(text, '\n')) {
        std::vector<std::string_view> fields;
        for (const std::string_view field : split(row, ' '))
            if (!field.empty() && field != "\r") fields.push_back(field);
        if (fields.empty()) continue;
        const auto z = fields.size() == 3 ? parse_double(fields[2]) : std::nullopt;
        if (!z || line >= size.area())
            throw CliError(ExitCode::kInput, path.string() + ":" + std::to_string(line + 1) +
                                                 ": a line \"x y z\" for each of " +
                                                 std::to_string(size.area()) +
                                                 " pixels was expected, mm.");
        depth.at<float>(line / size.width, line % size.width) = static_cast<float>(*z);
        ++line;
    }
    if (line == size.area()) return depth;
    throw CliError(ExitCode::kInput, path.string() + ": " + std::to_string(size.area()) +
                                         " lines were expected, one for each pixel; there are " +
                                         std::to_string(line) + ".");
}

// The phase that the clip says; else that of f7.
double read_phase(const fs::path& folder) {
    std::error_code error;
    if (!fs::exists(folder / kPhase, error)) return kHeartPhantomPhase;
    std::string text = read_text_file(folder / kPhase, 1000, ExitCode::kInput);
    text.erase(std::remove_if(text.begin(), text.end(),
                              [](char c) { return c == '\n' || c == '\r' || c == ' '; }),
               text.end());
    const auto phase = parse_double(text);
    if (phase && *phase >= 0 && *phase < 10) return *phase;
    throw CliError(ExitCode::kInput, (folder / kPhase).string() +
                                         ": seconds from the first depth map to the first frame "
                                         "were expected, 0 or more.");
}

class HeartPhantom : public DataSet {
  public:
    std::string name() const override { return "heart-phantom"; }
    bool has_units() const override { return true; }
    std::string summary() const override {
        return "Hamlyn heart phantom: depth, against a CT scan's";
    }
    std::string layout() const override {
        return "a folder with *L.avi, *R.avi, heartDepthMap_0.txt to heartDepthMap_19.txt and "
               "calibration.yaml";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::exists(map_path(folder, 0), error);
    }

    std::vector<std::string> sample_columns() const override {
        std::vector<std::string> columns{"frame"};
        for (const Metric& metric : metrics()) columns.push_back(metric.name);
        return columns;
    }
    std::vector<Metric> metrics() const override {
        return {{"mean_abs_mm"}, {"rms_mm"}, {"found_share", true}};
    }
    // Means over frames.
    std::vector<double> summarise(const Samples& samples) const override {
        return means_of(samples);
    }

    ClipScore run(const ClipTask& task) const override {
        const fs::path folder = fs::absolute(task.folder).lexically_normal();
        require_entries(folder, {{kCalibration, "OpenCV stereo YAML of these videos, mm"}});
        SourceOptions options;
        options.left = video_in(folder, "L").string();
        options.right = video_in(folder, "R").string();
        FrameSource source(options);
        const cv::Size size(source.width(), source.height());
        std::vector<cv::Mat> maps;
        for (int map = 0; map < kHeartPhantomMaps; ++map)
            maps.push_back(read_map(map_path(folder, map), size));
        const double phase = read_phase(folder);
        StereoCalibration rig =
            load_calibration((folder / kCalibration).string(), task.settings.units);
        fit_to_frames(rig, size.width, size.height);
        DepthClip clip(task, *this);
        clip.begin(rig, source.channels());
        StereoFrame frame;
        while (source.next(frame)) {
            const cv::Mat& truth =
                maps[static_cast<std::size_t>(heart_phantom_map(frame.index, phase))];
            const cv::Mat depth = clip.measure(frame);
            clip.write(frame.index, depth);
            const HamlynErrors errors = hamlyn_errors(truth, depth);
            clip.samples().add({static_cast<double>(frame.index), errors.mean_abs_mm, errors.rms_mm,
                                errors.found_share});
            clip.consider(errors.mean_abs_mm, frame, truth, depth,
                          "frame " + std::to_string(frame.index) + ": mean error " +
                              format_fixed(errors.mean_abs_mm, 2) + " mm");
        }
        if (!source.fault().empty()) throw CliError(ExitCode::kInput, source.fault());
        return clip.finish();
    }
};

}  // namespace

std::unique_ptr<DataSet> make_heart_phantom() { return std::make_unique<HeartPhantom>(); }

}  // namespace defrec::cli
