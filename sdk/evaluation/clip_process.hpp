// A clip's process: a crash, a hang or a leak in it costs that clip only.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace defrec::cli {

class ClipProcess {
  public:
    // Starts arguments[0], with its outputs in the file `log`. Throws CliError(kInternal). The
    // process ends with this one.
    ClipProcess(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                std::chrono::duration<double> time_limit);
    // Ends it, and what it has started.
    ~ClipProcess();
    ClipProcess(const ClipProcess&) = delete;
    ClipProcess& operator=(const ClipProcess&) = delete;

    // Nothing while it runs. Then why it failed, empty where it did not: its last message, the
    // signal, or the time limit, at which it is ended.
    std::optional<std::string> result();

  private:
    void end();

    pid_t child_ = -1;  // -1: has ended
    std::filesystem::path log_;
    std::chrono::duration<double> time_limit_;
    std::chrono::steady_clock::time_point start_;
};

}  // namespace defrec::cli
