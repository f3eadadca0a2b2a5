// How the inside of the library reports a failure: an exception with a status and one error
// message. call.hpp turns it into the status and the last error of a C call; it never leaves
// the library.
#pragma once
#include <charconv>
#include <concepts>
#include <stdexcept>
#include <string>
#include <string_view>

#include "include/defrec_c.h"

namespace defrec {

class Error : public std::runtime_error {
  public:
    Error(defrec_status status, const std::string& text)
        : std::runtime_error(text), status_(status) {}
    defrec_status status() const { return status_; }

  private:
    defrec_status status_;
};

namespace detail {
inline void append(std::string& text, std::string_view piece) { text += piece; }
// Shortest form that reads back as the same number, in the C locale whatever the process's locale.
template <class Number>
requires(std::integral<Number> || std::floating_point<Number>) &&
    (!std::same_as<Number, bool>)void append(std::string& text, Number number) {
    char digits[64];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}
}  // namespace detail

// Strings and numbers one after the other, independent of the locale.
template <class... Pieces>
std::string concat(const Pieces&... pieces) {
    std::string text;
    (detail::append(text, pieces), ...);
    return text;
}

// Throws Error(status, concat(pieces...)).
template <class... Pieces>
[[noreturn]] void fail(defrec_status status, const Pieces&... pieces) {
    throw Error(status, concat(pieces...));
}

}  // namespace defrec
