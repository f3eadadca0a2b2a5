// What the suite asks the operating system: system_posix.cpp, system_windows.cpp.
#pragma once
#include <cstddef>
#include <memory>
#include <string>

namespace defrec::conformance {

// Number of threads of this process.
size_t thread_count();
// The system's name and version, and its processor architecture.
std::string system_text();
// Where libdefrec lies, with a separator at its end. Throws Error(DEFREC_ERROR_INTERNAL).
std::string library_folder();

// How the caller's thread handles signals, or what the system has in their place.
class SignalState {
  public:
    SignalState();  // as it is now
    ~SignalState();
    // What is otherwise in a later state: "the handler of signal 11"; empty: nothing.
    std::string difference(const SignalState& later) const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace defrec::conformance
