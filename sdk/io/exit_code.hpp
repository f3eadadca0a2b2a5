// How the program ends: its exit codes, and the one exception that carries them to main.
#pragma once

#include <stdexcept>
#include <string>

namespace defrec::cli {

enum class ExitCode : int {
    kOk = 0,
    kInternal = 1,
    kUsage = 2,
    kInput = 3,
    kCalibration = 4,
    kDevice = 5,
    kBelowThreshold = 6,
    kOutput = 7,
    kNothingTracked = 8,
    kFound = 9,
    kInterrupted = 130,
};

// Ends the program with `code`; what() is one error message that says what was given, what was
// expected and, where there is one, what to do about it.
class CliError : public std::runtime_error {
  public:
    CliError(ExitCode code, const std::string& message)
        : std::runtime_error(message), code_(code) {}
    ExitCode code() const noexcept { return code_; }

  private:
    ExitCode code_;
};

}  // namespace defrec::cli
