// `defrec devices --verify`.
#include "sdk/cli/devices/probe.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <utility>

#include "sdk/base/descriptor.hpp"
#include "sdk/cli/devices/probe_reply.hpp"
#include "sdk/cli/io/terminal.hpp"
#include "sdk/cli/io/text.hpp"
#include "sdk/cli/program/library.hpp"

extern char** environ;  // NOLINT: POSIX asks the program to declare it

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kProbeWidth = 192, kProbeHeight = 128;
constexpr std::uint64_t kProbeLimitNs = 10'000'000'000;

std::vector<std::string> manifests_in(const fs::path& folder) {
    std::vector<std::string> manifests;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        if (name.starts_with("defrec_plugin_") && name.ends_with(".json"))
            manifests.push_back(entry->path().string());
    }
    std::sort(manifests.begin(), manifests.end());
    return manifests;
}

// One frame of noise, shifted by a few pixels between the views: enough to run every stage that a
// frame begins with.
void track_noise(const Context& context, const Device& device) {
    StereoCalibration calibration;
    calibration.width = kProbeWidth;
    calibration.height = kProbeHeight;
    calibration.left = {200, 200, kProbeWidth / 2.0, kProbeHeight / 2.0, {}, "the probe's camera",
                        {}};
    calibration.right = calibration.left;
    calibration.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    calibration.translation = {-5, 0, 0};
    const Rig rig = make_rig(context, calibration);

    constexpr int kShift = 12;
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(kProbeHeight) *
                                     (kProbeWidth + kShift));
    std::uint32_t state = 1;
    for (std::uint8_t& pixel : pixels) {
        state = state * 1664525u + 1013904223u;
        pixel = static_cast<std::uint8_t>(40 + (state >> 24) % 160);
    }
    StereoFrame frame;
    frame.left = {pixels.data(), kProbeWidth, kProbeHeight, 1, kProbeWidth + kShift};
    frame.right = frame.left;
    frame.right.pixels += kShift;

    auto desc = initialised<defrec_tracker_desc>();
    desc.device_id = device.id.c_str();
    desc.format = DEFREC_FORMAT_GRAY8;
    defrec_tracker handle = nullptr;
    require(defrec_tracker_create(context.get(), rig.get(), &desc, &handle), ExitCode::kDevice,
            device.id);
    const Tracker tracker(handle);
    const Job job = submit(tracker, frame);
    const defrec_status status = defrec_job_wait(job.get(), kProbeLimitNs);
    require(status, ExitCode::kDevice, device.id);
    if (status == DEFREC_TIMEOUT)
        throw CliError(ExitCode::kDevice, device.id + ": one small frame took over 10 s.");
}

struct ChildOutput {
    std::string text;
    int status = 0;  // as waitpid gives it
    bool timed_out = false;
};

int wait_until(pid_t child, Clock::time_point deadline, bool& timed_out) {
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
        if (Clock::now() >= deadline) {
            timed_out = true;
            ::kill(child, SIGKILL);
            ::waitpid(child, &status, 0);
            return status;
        }
        ::usleep(2000);
    }
    return status;
}

void read_until(int end, Clock::time_point deadline, std::string& text) {
    constexpr std::size_t kMaxRead = 1 << 20;
    char buffer[4096];
    while (text.size() < kMaxRead) {
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
        pollfd waited{end, POLLIN, 0};
        if (left <= 0 || ::poll(&waited, 1, static_cast<int>(left)) <= 0) return;
        const ssize_t got = ::read(end, buffer, sizeof buffer);
        if (got <= 0) return;
        text.append(buffer, static_cast<std::size_t>(got));
    }
}

ChildOutput run_child(const std::vector<std::string>& arguments, std::chrono::milliseconds limit) {
    std::vector<char*> argv;
    for (const std::string& argument : arguments)
        argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    Pipe pipe;
    if (!pipe.open()) throw CliError(ExitCode::kInternal, "no pipe can be opened.");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, pipe.write_end.get(), STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t child = 0;
    const int failed = ::posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0)
        throw CliError(ExitCode::kInternal,
                       arguments[0] + ": cannot be started again for the probe.");

    pipe.write_end.close();
    const Clock::time_point deadline = Clock::now() + limit;
    ChildOutput output;
    read_until(pipe.read_end.get(), deadline, output.text);
    output.status = wait_until(child, deadline, output.timed_out);
    return output;
}

}  // namespace

std::vector<std::string> find_manifests() {
    std::vector<fs::path> folders;
    if (const char* path = ::secure_getenv("DEFREC_PLUGIN_PATH")) {
        for (const std::string_view folder : split(path, ':')) {
            if (!folder.empty() && folder.front() == '/') folders.emplace_back(folder);
        }
    }
    Dl_info info{};
    if (::dladdr(reinterpret_cast<const void*>(&defrec_version), &info) != 0 &&
        info.dli_fname != nullptr) {
        std::error_code error;
        folders.push_back(fs::canonical(info.dli_fname, error).parent_path());
    }
    std::vector<std::string> manifests;
    for (const fs::path& folder : folders) {
        for (const std::string& manifest : manifests_in(folder)) {
            if (std::find(manifests.begin(), manifests.end(), manifest) == manifests.end()) {
                manifests.push_back(manifest);
            }
        }
    }
    return manifests;
}

ProbeResult probe_in_child(const std::string& program, const std::string& manifest,
                           std::chrono::milliseconds limit) {
    ProbeResult result;
    result.manifest = manifest;
    const ChildOutput output = run_child({program, "devices", "--probe", manifest}, limit);
    if (output.timed_out) {
        result.message = "it did not answer within " + std::to_string(limit.count() / 1000) +
                         " s and was ended.";
    } else if (WIFSIGNALED(output.status)) {
        result.message = std::string("it crashed the process that opened it (") +
                         ::strsignal(WTERMSIG(output.status)) + ").";
    } else {
        std::optional<ProbeReply> reply = read_probe_reply(output.text);
        if (!reply) {
            result.message = "it ended the process that opened it, with exit code " +
                             std::to_string(WEXITSTATUS(output.status)) + ".";
            return result;
        }
        result.is_good = reply->is_good;
        result.message = std::move(reply->message);
        result.devices = std::move(reply->devices);
    }
    return result;
}

int run_probe(const std::string& manifest) {
    ProbeReply reply;
    reply.is_good = true;
    try {
        const Context context = open_context({1, true, {manifest}});
        for (const Plugin& plugin : list_plugins(context)) {
            if (plugin.is_loaded && plugin.reason.empty()) continue;
            reply.is_good = false;
            reply.message = plugin.reason;
        }
        for (const Device& device : list_devices(context)) {
            reply.devices.push_back(device.id);
            if (device.has_every_stage()) track_noise(context, device);
        }
        if (reply.is_good)
            reply.message = reply.devices.empty() ? "it loads and has no device here."
                                                  : "it loads and tracks a frame.";
    } catch (const CliError& error) {
        reply.is_good = false;
        reply.message = error.what();
    }
    print(write_probe_reply(reply) + "\n");
    return static_cast<int>(ExitCode::kOk);
}

}  // namespace defrec::cli
