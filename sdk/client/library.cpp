// libdefrec for the program.
#include "sdk/client/library.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace defrec::cli {
namespace {

// Why plugins were refused is told where a device is asked for (describe_choice).
thread_local bool is_opening_library = false;

void log_to_remarks(void* library, std::int32_t level, const char* source, const char* text) {
    if (library != nullptr)
        static_cast<LibraryRemarks*>(library)->add(level, source, text, is_opening_library);
}

void log_to_standard_error(void* library, std::int32_t level, const char* source,
                           const char* text) {
    log_to_remarks(library, level, source, text);
    const bool is_error = level >= DEFREC_LOG_ERROR;
    if (level == DEFREC_LOG_INFO || (is_opening_library && !is_error)) return;
    std::fprintf(stderr, "defrec: %s: %s: %s\n", is_error ? "error" : "warning", source, text);
}

void keep_remark(void* remarks, std::int32_t level, const char* source, const char* text) {
    if (level == DEFREC_LOG_INFO) (*static_cast<PluginRemarks*>(remarks))[source] = text;
}

defrec_intrinsics intrinsics_of(const CameraCalibration& camera) {
    defrec_intrinsics intrinsics{};
    intrinsics.fx = camera.fx;
    intrinsics.fy = camera.fy;
    intrinsics.cx = camera.cx;
    intrinsics.cy = camera.cy;
    std::copy(camera.distortion.begin(), camera.distortion.end(), intrinsics.distortion);
    intrinsics.distortion_count = static_cast<std::uint32_t>(camera.distortion.size());
    return intrinsics;
}

// What can be chosen, and why what cannot be chosen was refused.
std::string describe_choice(const Context& context) {
    std::string text = "available:";
    for (const Device& device : list_devices(context)) text += " " + device.id;
    if (list_devices(context).empty()) text += " nothing";
    for (const Plugin& plugin : list_plugins(context)) {
        if (!plugin.is_loaded)
            text += "; a plugin was refused: " + plugin.reason;
        else if (!plugin.reason.empty())
            text += "; " + plugin.reason;
    }
    return text;
}

// Where in the user's file the number stands that the library refuses.
const std::string& origin_of(const StereoCalibration& calibration, std::string_view message) {
    const bool is_right = message.starts_with("right.");
    const CameraCalibration& camera = is_right ? calibration.right : calibration.left;
    return message.starts_with(is_right ? "right.distortion" : "left.distortion")
               ? camera.distortion_origin
               : camera.matrix_origin;
}

}  // namespace

void require(defrec_status status, ExitCode otherwise, const std::string& doing) {
    if (status >= 0) return;
    const bool is_device = status == DEFREC_ERROR_DEVICE_LOST || status == DEFREC_ERROR_PLUGIN ||
                           status == DEFREC_ERROR_UNSUPPORTED;
    const bool lacks_memory = status == DEFREC_ERROR_OUT_OF_MEMORY;
    throw CliError(is_device      ? ExitCode::kDevice
                   : lacks_memory ? ExitCode::kInternal
                                  : otherwise,
                   doing + ": " + defrec_last_error());
}

void LibraryRemarks::add(std::int32_t level, std::string_view source, std::string_view text,
                         bool is_opening) {
    constexpr std::size_t kMostWarnings = 100;
    const std::lock_guard lock(mutex_);
    if (level == DEFREC_LOG_INFO) {
        if (source == "sdk") texts_.emplace_back(text);
        return;
    }
    std::string warning = level >= DEFREC_LOG_ERROR ? "error: " : "warning: ";
    warning.append(source).append(": ").append(text);
    std::vector<std::string>& kept = is_opening ? opening_ : warnings_;
    if (std::find(kept.begin(), kept.end(), warning) != kept.end()) return;
    if (kept.size() < kMostWarnings)
        kept.push_back(std::move(warning));
    else
        ++left_out_;
}

std::vector<std::string> LibraryRemarks::warnings() const {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> all = warnings_;
    if (left_out_ > 0) all.push_back("and " + std::to_string(left_out_) + " more");
    return all;
}

std::vector<std::string> LibraryRemarks::warnings_of_opening() const {
    const std::lock_guard lock(mutex_);
    return opening_;
}

std::vector<std::string> LibraryRemarks::all() const {
    const std::lock_guard lock(mutex_);
    return texts_;
}

Context open_context(const ContextOptions& options) {
    auto desc = initialised<defrec_context_desc>();
    std::vector<const char*> paths;
    for (const std::string& path : options.only_plugins) paths.push_back(path.c_str());
    desc.flags = paths.empty() && options.has_plugins ? DEFREC_CONTEXT_USE_ENVIRONMENT
                                                      : DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
    desc.plugin_paths = paths.data();
    desc.plugin_path_count = paths.size();
    desc.log = options.quiet ? nullptr : &log_to_standard_error;
    desc.log_level = DEFREC_LOG_WARNING;
    if (options.library != nullptr) {
        if (options.quiet) desc.log = &log_to_remarks;
        desc.log_user = options.library;
        desc.log_level = DEFREC_LOG_INFO;
    }
    if (options.remarks != nullptr) {
        desc.log = &keep_remark;
        desc.log_user = options.remarks;
        desc.log_level = DEFREC_LOG_INFO;
    }
    desc.threads = options.threads;
    defrec_context context = nullptr;
    is_opening_library = true;
    const defrec_status status = defrec_context_create(&desc, &context);
    is_opening_library = false;
    require(status, ExitCode::kInternal, "opening the library");
    return Context(context);
}

std::string backend_of(const Device& device) { return device.id.substr(0, device.id.find(':')); }

std::vector<Device> list_devices(const Context& context) {
    std::vector<Device> devices;
    for (std::size_t i = 0; i < defrec_device_count(context.get()); ++i) {
        auto info = initialised<defrec_device_info>();
        require(defrec_device_get(context.get(), i, &info), ExitCode::kInternal,
                "listing the devices");
        devices.push_back({info.id, info.name, info.driver != nullptr ? info.driver : "", info.kind,
                           info.stages});
    }
    return devices;
}

std::vector<Plugin> list_plugins(const Context& context) {
    const auto text = [](const char* string) {
        return std::string(string != nullptr ? string : "");
    };
    std::vector<Plugin> plugins;
    for (std::size_t i = 0; i < defrec_plugin_count(context.get()); ++i) {
        auto info = initialised<defrec_plugin_info>();
        require(defrec_plugin_get(context.get(), i, &info), ExitCode::kInternal,
                "listing the plugins");
        plugins.push_back({text(info.name), text(info.path), text(info.version), text(info.reason),
                           info.verdict == DEFREC_OK});
    }
    return plugins;
}

Device choose_device(const Context& context, const std::string& backend,
                     const std::string& device) {
    for (const Device& candidate : list_devices(context)) {
        if (!device.empty() && candidate.id != device) continue;
        if (backend != "auto" && backend_of(candidate) != backend) continue;
        if (candidate.has_every_stage()) return candidate;
        if (!device.empty() || backend != "auto") {
            throw CliError(ExitCode::kDevice,
                           "the device '" + candidate.id +
                               "' does not offer every stage that tracking needs; " +
                               describe_choice(context) + ".");
        }
    }
    const std::string asked = !device.empty()     ? "--device " + device
                              : backend != "auto" ? "--backend " + backend
                                                  : std::string("tracking");
    throw CliError(ExitCode::kDevice,
                   "there is no device for " + asked + "; " + describe_choice(context) + ".");
}

Rig make_rig(const Context& context, const StereoCalibration& calibration) {
    auto desc = initialised<defrec_rig_desc>();
    desc.width = static_cast<std::uint32_t>(calibration.width);
    desc.height = static_cast<std::uint32_t>(calibration.height);
    desc.left = intrinsics_of(calibration.left);
    desc.right = intrinsics_of(calibration.right);
    std::copy(calibration.rotation.begin(), calibration.rotation.end(), desc.rotation);
    std::copy(calibration.translation.begin(), calibration.translation.end(), desc.translation);
    defrec_rig rig = nullptr;
    const defrec_status status = defrec_rig_create(context.get(), &desc, &rig);
    require(status, ExitCode::kCalibration, origin_of(calibration, defrec_last_error()));
    return Rig(rig);
}

defrec_rig_info rig_info(const Rig& rig) {
    auto info = initialised<defrec_rig_info>();
    require(defrec_rig_get(rig.get(), &info), ExitCode::kInternal,
            "asking for the rectified camera");
    return info;
}

double depth_share(const defrec_result& result) {
    if (result.vertex_count == 0 || result.state == DEFREC_LOST) return 0;
    const auto count = std::count_if(
        result.vertex_evidence, result.vertex_evidence + result.vertex_count,
        [](std::uint8_t evidence) { return (evidence & DEFREC_EVIDENCE_DEPTH) != 0; });
    return static_cast<double>(count) / static_cast<double>(result.vertex_count);
}

std::uint32_t format_of_channels(int channels) {
    return channels == 1 ? DEFREC_FORMAT_GRAY8 : DEFREC_FORMAT_BGR8;
}

Template load_template(const Context& context, const std::string& path) {
    defrec_template handle = nullptr;
    const defrec_status status = defrec_template_load(context.get(), path.c_str(), &handle);
    if (status < 0 && std::string_view(defrec_last_error()).ends_with("does not begin as one"))
        throw CliError(ExitCode::kInput,
                       path + ": this is no template; `defrec track --save-template` writes one.");
    require(status, ExitCode::kInput, "reading the template");
    return Template(handle);
}

defrec_template_info info_of(const Template& surface) {
    auto info = initialised<defrec_template_info>();
    require(defrec_template_get(surface.get(), &info), ExitCode::kInternal, "reading the template");
    return info;
}

defrec_image image_of(const ImageView& view) {
    auto image = initialised<defrec_image>();
    image.format = format_of_channels(view.channels);
    image.width = static_cast<std::uint32_t>(view.width);
    image.height = static_cast<std::uint32_t>(view.height);
    image.stride = view.stride;
    image.pixels = view.pixels;
    return image;
}

std::int64_t timestamp_ns_of(const StereoFrame& frame) {
    constexpr double kNanosecondsPerMillisecond = 1e6;
    return std::llround(frame.timestamp_ms * kNanosecondsPerMillisecond);
}

Job submit(const Tracker& tracker, const StereoFrame& frame, std::uint64_t deadline_ns) {
    const defrec_image left = image_of(frame.left), right = image_of(frame.right);
    auto desc = initialised<defrec_frame>();
    desc.timestamp_ns = timestamp_ns_of(frame);
    desc.left = &left;
    desc.right = &right;
    desc.deadline_ns = deadline_ns;
    desc.field = frame.field;
    auto disparity = initialised<defrec_disparity>();
    if (frame.disparity != nullptr) {
        disparity.width = left.width;
        disparity.height = left.height;
        disparity.disparity = frame.disparity->data();
        disparity.sigma_px = frame.disparity_sigma_px;
        desc.disparity = &disparity;
    }
    defrec_job job = nullptr;
    require(defrec_tracker_submit(tracker.get(), &desc, &job), ExitCode::kInternal,
            "frame " + std::to_string(frame.index));
    return Job(job);
}

void wait_for(const Job& job, std::int64_t frame) {
    require(defrec_job_wait(job.get(), UINT64_MAX), ExitCode::kInternal,
            "frame " + std::to_string(frame));
}

defrec_result result_of(const Job& job, std::int64_t frame) {
    wait_for(job, frame);
    auto result = initialised<defrec_result>();
    require(defrec_job_result(job.get(), &result), ExitCode::kInternal, "reading the result");
    return result;
}

const char* state_name(std::uint32_t state) {
    for (const EnumeratorName& known : kStateNames)
        if (known.value == state) return known.name;
    return "lost";
}

std::string reason_names(std::uint32_t reasons, const char* separator) {
    std::string text;
    for (const EnumeratorName& known : kReasonNames) {
        if ((reasons & known.value) == 0) continue;
        if (!text.empty()) text += separator;
        text += known.name;
    }
    return text;
}

}  // namespace defrec::cli
