// A timeline of `defrec track` in the Chrome trace event format, which Perfetto and
// chrome://tracing open: what the program's thread did, what the device did, and what was uploaded.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "include/defrec_c.h"
#include "sdk/base/os/atomic_file.hpp"

namespace defrec::cli {

class TraceFile {
  public:
    using Clock = std::chrono::steady_clock;

    // Times of events count from here on.
    TraceFile(const std::filesystem::path& path, const std::string& device);

    // What the program's thread did with a frame; slices lie in one another or apart.
    void add_host(const char* name, std::int64_t frame, Clock::time_point begin,
                  Clock::time_point end);
    // The frame on the device, and its stages within; uploads by themselves. The device had nothing
    // else to do: it began when the frame had been submitted, or so much earlier that it was done
    // when its result was.
    void add_device(std::int64_t frame, const defrec_result& result, Clock::time_point submitted,
                    Clock::time_point done);
    void commit();

  private:
    enum Thread : int { kProgram = 1, kDevice, kUploads };
    void name_thread(Thread thread, const std::string& name);
    void add(const char* category, const std::string& name, Thread thread, std::int64_t frame,
             std::int64_t begin_ns, std::int64_t end_ns);
    void write_event(const nlohmann::ordered_json& event);

    AtomicFile file_;
    std::int64_t start_ns_;
    bool is_empty_ = true;
};

}  // namespace defrec::cli
