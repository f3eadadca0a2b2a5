// Every call that depends on the operating system, behind plain functions: platform_posix.cpp and
// platform_windows.cpp. Paths are UTF-8.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "sdk/base/os/descriptor.hpp"

namespace defrec::platform {

// Identifies this process among its ancestors; a child after fork has another, also where process
// numbers repeat.
uint64_t process_id() noexcept;

// Starts a thread of the library: it receives none of the application's signals (but real-time
// ones, SIGPWR and SIGXCPU, by which runtimes stop threads), cannot be cancelled, and computes in
// the default floating point mode, whatever the mode of the starting thread, whose priority it
// takes over. Throws Error(DEFREC_ERROR_OUT_OF_MEMORY).
std::thread start_thread(std::function<void()> body);

// This thread gets less of a core that others want, whatever priority it took over.
void lower_priority() noexcept;

// For a scope: default rounding, no flushing of denormals; the thread's own mode is back
// afterwards.
class DefaultFloatingPoint {
  public:
    DefaultFloatingPoint() noexcept;
    ~DefaultFloatingPoint();
    DefaultFloatingPoint(const DefaultFloatingPoint&) = delete;
    DefaultFloatingPoint& operator=(const DefaultFloatingPoint&) = delete;

  private:
    alignas(16) unsigned char saved_[64];
};

// For a scope: a request to cancel this thread (pthread_cancel) waits for its end.
class NoCancellation {
  public:
    NoCancellation() noexcept;
    ~NoCancellation();
    NoCancellation(const NoCancellation&) = delete;
    NoCancellation& operator=(const NoCancellation&) = delete;

  private:
    int before_;
};

// Runs body, in which a write beyond the process's limit on the size of files fails with EFBIG and
// raises no SIGXFSZ, which ends a process that does not expect it. The signal's disposition stays.
void without_file_size_signal(const std::function<void()>& body);

// The processor's hint that this is a spin loop.
void spin_pause() noexcept;

// By how much a thread that sleeps may wake late, where a core is free for it.
std::chrono::microseconds sleep_error() noexcept;

// ---- files ------------------------------------------------------------------

// Where the name of what a path leads to begins: behind the last separator.
size_t name_start(std::string_view path) noexcept;
// Between the paths of a list in an environment variable.
char list_separator() noexcept;

enum class PathKind { kMissing, kFile, kFolder, kOther };
PathKind path_kind(const std::string& path) noexcept;
// Who but the system's and this program's owners may change what lies at a path, or what is found
// there: "<path>: <who> may write ...", of the path as it is given, of that which it leads to by
// links, or of one of the folders above; empty where nobody may.
std::string who_may_change(const std::string& path);
bool is_absolute(std::string_view path) noexcept;
// Without links and dots; empty where there is no such path.
std::string canonical_path(const std::string& path);
// Names in a folder, sorted by byte. Throws Error(DEFREC_ERROR_IO) where it cannot be read.
std::vector<std::string> list_folder(const std::string& path);
// A regular file, opened once.
struct OpenedFile {
    Descriptor descriptor;
    std::vector<unsigned char> bytes;  // the whole of it
};
// Never waits (a FIFO is refused). Throws Error(DEFREC_ERROR_IO), or Error(DEFREC_ERROR_PLUGIN) for
// what is no regular file or larger than cap.
OpenedFile read_regular_file(const std::string& path, uint64_t cap);

// ---- libraries --------------------------------------------------------------

// The value of an environment variable; nothing where it is unset or the process runs with
// privileges of its own.
std::optional<std::string> trusted_environment(const char* name);
// The folder of the file that holds this code; empty if unknown.
std::string own_folder();
// Loads the very file that was opened, for ever, all symbols bound, none given to others. path: its
// name in messages. Throws Error(DEFREC_ERROR_PLUGIN).
void* open_library(const Descriptor& file, const std::string& path);
// nullptr where it is missing.
void* find_symbol(void* library, const char* name) noexcept;

}  // namespace defrec::platform
