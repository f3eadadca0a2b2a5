// See trace_file.hpp.
#include "sdk/session/trace_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "sdk/io/json_text.hpp"

namespace defrec::cli {
namespace {

constexpr int kProcess = 1;
constexpr std::string_view kUpload = "upload";

std::int64_t nanoseconds(TraceFile::Clock::time_point time) {
    return std::chrono::nanoseconds(time.time_since_epoch()).count();
}
double microseconds(std::int64_t ns) { return static_cast<double>(ns) / 1000; }

}  // namespace

TraceFile::TraceFile(const std::filesystem::path& path, const std::string& device)
    : file_(path), start_ns_(nanoseconds(Clock::now())) {
    file_.write("{\"displayTimeUnit\": \"ms\", \"traceEvents\": [\n");
    write_event({{"ph", "M"},
                 {"name", "process_name"},
                 {"pid", kProcess},
                 {"args", {{"name", "defrec track"}}}});
    name_thread(kProgram, "program");
    name_thread(kDevice, "device " + device);
    name_thread(kUploads, "uploads");
}

void TraceFile::add_host(const char* name, std::int64_t frame, Clock::time_point begin,
                         Clock::time_point end) {
    add("host", name, kProgram, frame, nanoseconds(begin), nanoseconds(end));
}

void TraceFile::add_device(std::int64_t frame, const defrec_result& result,
                           Clock::time_point submitted, Clock::time_point done) {
    const std::uint32_t count = std::min<std::uint32_t>(result.time_count, DEFREC_MAX_TIMED_STAGES);
    std::array<std::int64_t, DEFREC_MAX_TIMED_STAGES + 1> offset{};
    for (std::uint32_t i = 0; i < count; ++i)
        offset[i + 1] = offset[i] + std::llround(result.times[i].milliseconds * 1e6);
    const std::int64_t begin = std::min(nanoseconds(submitted), nanoseconds(done) - offset[count]);
    std::uint32_t uploads = 0;  // they come first
    while (uploads < count && result.times[uploads].name == kUpload) ++uploads;
    if (uploads < count)
        add("frame", "frame", kDevice, frame, begin + offset[uploads], begin + offset[count]);
    for (std::uint32_t i = 0; i < count; ++i)
        add(i < uploads ? "upload" : "stage", result.times[i].name,
            i < uploads ? kUploads : kDevice, frame, begin + offset[i], begin + offset[i + 1]);
}

void TraceFile::commit() {
    file_.write("\n]}\n");
    file_.commit();
}

void TraceFile::name_thread(Thread thread, const std::string& name) {
    write_event({{"ph", "M"},
                 {"name", "thread_name"},
                 {"pid", kProcess},
                 {"tid", int{thread}},
                 {"args", {{"name", name}}}});
    write_event({{"ph", "M"},
                 {"name", "thread_sort_index"},
                 {"pid", kProcess},
                 {"tid", int{thread}},
                 {"args", {{"sort_index", int{thread}}}}});
}

void TraceFile::add(const char* category, const std::string& name, Thread thread,
                    std::int64_t frame, std::int64_t begin_ns, std::int64_t end_ns) {
    write_event({{"ph", "X"},
                 {"cat", category},
                 {"name", name},
                 {"pid", kProcess},
                 {"tid", int{thread}},
                 {"ts", microseconds(begin_ns - start_ns_)},
                 {"dur", microseconds(end_ns - begin_ns)},
                 {"args", {{"frame", frame}}}});
}

void TraceFile::write_event(const nlohmann::ordered_json& event) {
    const std::string json = json_text(event);
    file_.write(is_empty_ ? json : ",\n" + json);
    is_empty_ = false;
}

}  // namespace defrec::cli
