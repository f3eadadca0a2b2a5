// Numbers on the command line: what CLI11 takes for one without being it is refused.
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <sstream>
#include <string>

namespace defrec::cli {

// A number that is finite.
inline CLI::Validator any_number() {
    return CLI::Validator(
        [](std::string& text) {
            double value = 0;
            const bool is_finite = CLI::detail::lexical_cast(text, value) && std::isfinite(value);
            if (is_finite) return std::string();
            return "Value " + text + " is no number" +
                   (text.find(',') != std::string::npos ? "; decimals stand behind a point" : "");
        },
        "");
}

// As CLI::Range, which lets "nan" pass and writes 0.001 as 0.001000.
inline CLI::Validator number_in(double least, double most) {
    const CLI::Validator range = CLI::Range(least, most);
    CLI::Validator both = range;
    both.operation([range, least, most, finite = any_number()](std::string& text) {
        const std::string reason = finite(text);
        if (!reason.empty() || range(text).empty()) return reason;
        std::ostringstream message;
        message << "Value " << text << " is not from " << least << " to " << most;
        return message.str();
    });
    return both;
}

// Digits, of a number that 64 bits hold: neither a sign nor what would be cut off.
inline CLI::Validator seed_number() {
    return CLI::Validator(
        [](std::string& text) {
            std::uint64_t value = 0;
            const char* end = text.data() + text.size();
            const auto [rest, error] = std::from_chars(text.data(), end, value);
            return error == std::errc() && rest == end
                       ? std::string()
                       : "Value " + text + " is no whole number from 0 to " +
                             std::to_string(std::numeric_limits<std::uint64_t>::max());
        },
        "");
}

}  // namespace defrec::cli
