// Every call that depends on the operating system, behind plain functions. platform_posix.cpp implements them.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace defrec::platform {

// Identifies this process; a child after fork has another.
uint64_t process_id() noexcept;

// Starts a thread of the library: it receives none of the application's signals and computes in the default floating
// point mode, whatever the mode of the starting thread. Throws Error(DEFREC_ERROR_OUT_OF_MEMORY).
std::thread start_thread(std::function<void()> body);

// For a scope: default rounding, no flushing of denormals; the thread's own mode is back afterwards.
class DefaultFloatingPoint {
  public:
    DefaultFloatingPoint() noexcept;
    ~DefaultFloatingPoint();
    DefaultFloatingPoint(const DefaultFloatingPoint&) = delete;
    DefaultFloatingPoint& operator=(const DefaultFloatingPoint&) = delete;

  private:
    alignas(16) unsigned char saved_[64];
};

// The processor's hint that this is a spin loop.
void spin_pause() noexcept;

}  // namespace defrec::platform
