// libdefrec for the program: handles that release themselves, and failures as CliError.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/contract/enumerations.hpp"
#include "sdk/input/frame_source.hpp"
#include "sdk/io/calibration.hpp"
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {

template <auto kRelease>
struct Releaser {
    template <typename T>
    void operator()(T* handle) const {
        kRelease(handle);
    }
};
using Context = std::unique_ptr<defrec_context_, Releaser<&defrec_context_destroy>>;
using Rig = std::unique_ptr<defrec_rig_, Releaser<&defrec_rig_destroy>>;
using Tracker = std::unique_ptr<defrec_tracker_, Releaser<&defrec_tracker_destroy>>;
using Job = std::unique_ptr<defrec_job_, Releaser<&defrec_job_release>>;
using Template = std::unique_ptr<defrec_template_, Releaser<&defrec_template_release>>;
using Targets = std::unique_ptr<defrec_targets_, Releaser<&defrec_targets_destroy>>;
using Registration = std::unique_ptr<defrec_registration_, Releaser<&defrec_registration_destroy>>;
using Plan = std::unique_ptr<defrec_plan_, Releaser<&defrec_plan_destroy>>;
using Predictor = std::unique_ptr<defrec_predictor_, Releaser<&defrec_predictor_destroy>>;
using HandEye = std::unique_ptr<defrec_hand_eye_, Releaser<&defrec_hand_eye_destroy>>;

template <typename T>
T initialised() {
    T value;
    DEFREC_INIT(&value);
    return value;
}

// Throws CliError with the library's own error message for a negative status. Statuses that speak
// of a device or a plugin end with kDevice, a lack of memory with kInternal, all others with
// `otherwise`.
void require(defrec_status status, ExitCode otherwise, const std::string& doing);

// What plugins said of themselves (DEFREC_LOG_INFO), by their names.
using PluginRemarks = std::map<std::string, std::string>;

// Remarks of the library itself on what it found and chose (DEFREC_LOG_INFO), and warnings and
// errors, also of plugins. Any thread.
class LibraryRemarks {
  public:
    // is_opening: while plugins are looked for.
    void add(std::int32_t level, std::string_view source, std::string_view text, bool is_opening);
    std::vector<std::string> all() const;
    // "warning: SOURCE: TEXT", each once, in the order of their first time; of many the first ones,
    // and how many more there were. Those of plugins and devices that were left out stand apart:
    // they matter to who misses one.
    std::vector<std::string> warnings() const;
    std::vector<std::string> warnings_of_opening() const;

  private:
    mutable std::mutex mutex_;
    std::vector<std::string> texts_, warnings_, opening_;
    std::size_t left_out_ = 0;  // of warnings
};

struct ContextOptions {
    unsigned threads = 0;                   // 0: one per core
    bool quiet = false;                     // no log on the standard error output
    std::vector<std::string> only_plugins;  // manifests; empty: the library's own search
    PluginRemarks* remarks = nullptr;       // kept instead of any log; outlives the context
    LibraryRemarks* library = nullptr;      // kept beside the log; outlives the context
    bool has_plugins = true;                // false: none is looked for
};
Context open_context(const ContextOptions& options);

struct Device {
    std::string id, name, driver;
    unsigned kind = 0, stages = 0;
    bool has_every_stage() const { return stages == kEveryStage; }
};
std::vector<Device> list_devices(const Context& context);

struct Plugin {
    std::string name, path, version, reason;
    bool is_loaded = false;
};
std::vector<Plugin> list_plugins(const Context& context);

// The part of its id before the colon: "cpu", "reference", "cuda".
std::string backend_of(const Device& device);
// backend: "auto", or a device's; device: a whole id, or empty. Throws CliError(kDevice) naming
// what there is and why plugins were refused.
Device choose_device(const Context& context, const std::string& backend, const std::string& device);

// Throws CliError(kCalibration) when the library refuses the calibration. Its size must be known.
Rig make_rig(const Context& context, const StereoCalibration& calibration);
defrec_rig_info rig_info(const Rig& rig);

// Throws CliError(kInput) with the path where it is no template's file.
Template load_template(const Context& context, const std::string& path);
defrec_template_info info_of(const Template& surface);

// The frame's time as the tracker is given it.
std::int64_t timestamp_ns_of(const StereoFrame& frame);

defrec_image image_of(const ImageView& view);
// Queues a frame. deadline_ns: 0: none. Throws CliError.
Job submit(const Tracker& tracker, const StereoFrame& frame, std::uint64_t deadline_ns = 0);
// Waits for the frame of that index, however long it takes. Throws CliError.
void wait_for(const Job& job, std::int64_t frame);
// The same, and reads the result, whose arrays live as long as the job.
defrec_result result_of(const Job& job, std::int64_t frame);
// The share of the surface that has live depth in the frame; 0 where nothing is followed.
double depth_share(const defrec_result& result);
// The library's image format for views of this many channels.
std::uint32_t format_of_channels(int channels);

const char* state_name(std::uint32_t state);
// Names of the reasons in the mask, joined by `separator`.
std::string reason_names(std::uint32_t reasons, const char* separator);

}  // namespace defrec::cli
