// Numbers, names and text files, read and written the same under every locale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/io/exit_code.hpp"

namespace defrec::cli {

// The whole of `text` as a number, decimal point '.', whatever the locale; also YAML's .nan and
// .inf. Empty when any character is left over.
std::optional<double> parse_double(std::string_view text);
std::optional<std::int64_t> parse_integer(std::string_view text);

// `value` with exactly `decimals` digits after the point; never "-0.00". Not finite: "nan", "inf",
// "-inf".
std::string format_fixed(double value, int decimals);
// "960x540"
std::string size_text(int width, int height);
void append_fixed(std::string& out, double value, int decimals);
void append_integer(std::string& out, std::int64_t value);

std::vector<std::string_view> split(std::string_view text, char separator);
std::string_view trim(std::string_view text);

// With what a terminal would take for a command, or for the end of a line, written as \xNN.
std::string printable(std::string_view text);
// A word in quotes, printable, as far as the longest name of a topic goes.
std::string in_quotes(std::string_view word);

// The candidate that a mistyped `name` most likely meant; empty when none is near.
std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

// True when `a` comes before `b` in name order: as people count, so that frame_9 precedes frame_10.
bool precedes_by_name(const std::string& a, const std::string& b);

// The bytes of a regular file of at most `limit` bytes. Throws CliError(code) for a missing,
// unreadable or oversized file.
std::string read_file(const std::filesystem::path& path, std::size_t limit, ExitCode code);
// Those of a text file, without a UTF-8 byte order mark and with CR LF turned into LF. Throws for a
// UTF-16 or binary file, too.
std::string read_text_file(const std::filesystem::path& path, std::size_t limit, ExitCode code);

// Throws CliError(code) unless `text`, read from `path`, is free of the bytes that only binary
// files have.
void require_text(std::string_view text, const std::string& path, ExitCode code);

}  // namespace defrec::cli
