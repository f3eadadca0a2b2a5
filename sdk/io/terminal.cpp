// What the program shows while and after it works.
#include "sdk/io/terminal.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr std::chrono::milliseconds kRedraw(100);
constexpr int kBarWidth = 28;

}  // namespace

ProgressBar::ProgressBar(bool quiet)
    : is_shown_(!quiet && ::isatty(STDERR_FILENO) == 1),
      start_(std::chrono::steady_clock::now()),
      drawn_(start_) {}

ProgressBar::~ProgressBar() { clear(); }

void ProgressBar::update(std::int64_t done, std::optional<std::int64_t> total,
                         const std::string& note) {
    if (!is_shown_) return;
    const auto now = std::chrono::steady_clock::now();
    if (is_drawn_ && now - drawn_ < kRedraw && (!total || done < *total)) return;
    drawn_ = now;
    is_drawn_ = true;
    std::string line = "\r\x1b[K";
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    if (total && *total > 0) {
        const double share = std::min(1.0, static_cast<double>(done) / static_cast<double>(*total));
        const int filled = static_cast<int>(share * kBarWidth);
        line += '[';
        line.append(static_cast<std::size_t>(filled), '#')
            .append(static_cast<std::size_t>(kBarWidth - filled), '.');
        line.append("] ").append(std::to_string(done)).append("/").append(std::to_string(*total));
        if (done > 0) {
            line +=
                ", " +
                format_fixed(
                    elapsed / static_cast<double>(done) * static_cast<double>(*total - done), 0) +
                " s left";
        }
    } else {
        line += std::to_string(done) + " frames, " + format_fixed(elapsed, 0) + " s";
    }
    if (!note.empty()) line += ", " + note;
    std::fputs(line.c_str(), stderr);
    std::fflush(stderr);
}

void ProgressBar::clear() {
    if (!is_drawn_) return;
    is_drawn_ = false;
    std::fputs("\r\x1b[K", stderr);
    std::fflush(stderr);
}

void print(const std::string& text) {
    if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0)
        return;
    // Also a terminal that was closed.
    if (errno == EPIPE || interrupt_requested())
        throw CliError(ExitCode::kInterrupted, "the reader of the output is gone.");
    throw CliError(ExitCode::kOutput, "the standard output cannot be written.");
}

void print_notice(const std::string& text) {
    std::fputs(("defrec: " + printable(text) + "\n").c_str(), stderr);
}

}  // namespace defrec::cli
