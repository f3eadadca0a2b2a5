// The data sets that `defrec evaluate` reads: where clips lie, how one is run, and how what was
// measured becomes the data set's metrics.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/evaluation/data_sets/samples.hpp"
#include "sdk/io/calibration.hpp"

namespace defrec::cli {

struct Metric {
    std::string name;  // with its unit: median_mm
    bool larger_is_better = false;
};

// How clips are run.
enum class Method { kDefrec, kOpenCv, kStill };

struct RunSettings {
    Method method = Method::kDefrec;
    std::string config;  // of the tracker; empty: the library's defaults
    std::string backend = "auto", device;
    unsigned threads = 0;  // 0: one per core
    std::uint64_t seed = 0;
    LengthUnit units = LengthUnit::kGuarded;  // of the calibrations, where has_units()
    std::string video;  // its name in a clip, where the data set leaves it open; empty: the usual
};

struct ClipTask {
    std::filesystem::path folder;  // of the clip
    std::filesystem::path out;     // which exists, for whatever the clip leaves
    RunSettings settings;
};

// Median and 95th percentile of the time of a frame in ms; NaN: not known.
struct FrameTimes {
    double median = std::numeric_limits<double>::quiet_NaN();
    double p95 = std::numeric_limits<double>::quiet_NaN();
};
FrameTimes frame_times_of(std::vector<double> milliseconds);

struct ClipScore {
    Samples samples;
    std::int64_t frames = 0;
    FrameTimes frame_ms;
    std::string picture;  // JPEG; empty: none
    std::string remark;   // what the picture shows
    std::string doubt{};  // by which the truth is of something else; empty: none
    std::string notes{};  // what else of the truth does not fit
};

// Metrics of the targets of one depth, or of a range of depths.
struct DepthValues {
    std::string depth;           // as DepthScore names it
    std::vector<double> values;  // NaN: there is none
};

class DataSet {
  public:
    virtual ~DataSet() = default;

    virtual std::string name() const = 0;
    virtual std::string summary() const = 0;  // one line
    // What is expected under the root, for messages.
    virtual std::string layout() const = 0;
    // Whether a folder under the root is a clip. What it lacks shows when it is run.
    virtual bool is_clip(const std::filesystem::path& folder) const = 0;
    // Whether its clips have calibrations whose unit --units may tell.
    virtual bool has_units() const { return false; }
    // Files and folders that the clip's result depends on, also those that are not there.
    virtual std::vector<std::filesystem::path> inputs_of(const std::filesystem::path& clip) const {
        return {clip};
    }
    // Throws CliError; files that are missing or wrong are named with what was expected.
    virtual ClipScore run(const ClipTask& task) const = 0;

    virtual std::vector<std::string> sample_columns() const = 0;
    // The first one ranks the clips.
    virtual std::vector<Metric> metrics() const = 0;
    // Values of one clip or of many, in the order of metrics(); NaN: there is none.
    virtual std::vector<double> summarise(const Samples& samples) const = 0;

    // Targets beneath the surface, by their depth: what is measured of them, and the numbers of one
    // clip or of many. A data set without any has none.
    virtual std::vector<Metric> depth_metrics() const { return {}; }
    virtual std::vector<DepthValues> by_depth(const Samples& /*samples*/) const { return {}; }

    // Predictions that a clip leaves in the data set's own format, in its folder: JSON objects with
    // a member for the clip. Merging joins those of all clips.
    virtual std::vector<std::string> prediction_files() const { return {}; }
};

// In the order in which they are listed.
const std::vector<std::unique_ptr<DataSet>>& data_sets();
// Throws CliError(kUsage) naming those there are.
const DataSet& data_set_of(const std::string& name);

// Names of the clips under the root in name order: their folders relative to it, "." for the root
// itself. Throws CliError(kInput) when there is none.
std::vector<std::string> clips_of(const DataSet& data_set, const std::filesystem::path& root);

// A file or folder that a clip needs.
struct Needed {
    std::string path;  // relative to the clip
    std::string what;
    bool is_folder = false;
};
// Throws CliError(kInput) naming the first that is absent.
void require_entries(const std::filesystem::path& folder, const std::vector<Needed>& needed);

std::unique_ptr<DataSet> make_defrec_sequences();
std::unique_ptr<DataSet> make_d4d();
std::unique_ptr<DataSet> make_hamlyn();
std::unique_ptr<DataSet> make_heart_phantom();
std::unique_ptr<DataSet> make_scared();
std::unique_ptr<DataSet> make_serv_ct();
std::unique_ptr<DataSet> make_stereomis();
std::unique_ptr<DataSet> make_stir();
std::unique_ptr<DataSet> make_stir_2026();
std::unique_ptr<DataSet> make_super();
std::unique_ptr<DataSet> make_surgt();

}  // namespace defrec::cli
