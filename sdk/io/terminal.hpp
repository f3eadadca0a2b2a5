// What the program shows while and after it works.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace defrec::cli {

// A line on the standard error output that is drawn over; nothing at all unless that is a terminal.
class ProgressBar {
  public:
    explicit ProgressBar(bool quiet);
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    // total: unknown when empty. note: a few words at the end of the line.
    void update(std::int64_t done, std::optional<std::int64_t> total, const std::string& note);
    // Takes the line away.
    void clear();

  private:
    bool is_shown_;
    bool is_drawn_ = false;
    std::chrono::steady_clock::time_point start_, drawn_;
};

// Writes to the standard output at once; throws CliError(kInterrupted) when the reader is gone (a
// closed pipe).
void print(const std::string& text);
// "defrec: text" on the standard error output.
void print_notice(const std::string& text);

}  // namespace defrec::cli
