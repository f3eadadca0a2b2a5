// How a range of the public headers is checked, and the error message: field, value, range. What is
// generated beside this file calls it once for each field.
#pragma once
#include <charconv>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>

namespace defrec {

inline constexpr int64_t kNoMin = std::numeric_limits<int64_t>::min();
inline constexpr int64_t kNoMax = std::numeric_limits<int64_t>::max();

// Keeps the error message of the first check that fails.
class RangeCheck {
  public:
    // prefix: of the message, which begins with the field's name.
    explicit RangeCheck(const char* prefix) : prefix_(prefix) {}

    template <class Integer>
    void integer(const char* field, Integer value, int64_t low, int64_t high) {
        if (std::cmp_less(value, low) || std::cmp_greater(value, high))
            refuse(field, value, expected(low, high));
    }
    // low_is_open: low itself is out of range.
    template <class Real, class Low, class High>
    void real(const char* field, Real value, Low low, High high, bool low_is_open) {
        const Real least = bound<Real>(low), most = bound<Real>(high);
        if (!std::isfinite(value)) return refuse(field, value, "a finite number");
        if (value < least || value > most || (low_is_open && value == least))
            refuse(field, value,
                   (low_is_open ? "above " : "") + expected(least, most, low_is_open));
    }
    template <class Real>
    void finite(const char* field, Real value) {
        if (!std::isfinite(value)) refuse(field, value, "a finite number");
    }
    // names: of the values, for the message.
    void known(const char* field, int64_t value, std::initializer_list<int64_t> values,
               const char* names) {
        for (const int64_t each : values)
            if (value == each) return;
        refuse(field, value, std::string("one of ") + names);
    }

    // Empty where nothing failed.
    const std::string& error() const { return error_; }

  private:
    template <class Real, class End>
    static Real bound(End end) {
        if constexpr (std::is_same_v<End, int64_t>) {
            if (end == kNoMin) return -std::numeric_limits<Real>::infinity();
            if (end == kNoMax) return std::numeric_limits<Real>::infinity();
        }
        return Real(end);
    }
    // Shortest form that reads back as the same number, in the C locale whatever the process's
    // locale.
    template <class Number>
    static std::string text(Number number) {
        char digits[64];
        return {digits, std::to_chars(digits, digits + sizeof digits, number).ptr};
    }
    static std::string expected(int64_t low, int64_t high) {
        if (high == kNoMax) return "at least " + text(low);
        return low == kNoMin ? "at most " + text(high) : text(low) + " to " + text(high);
    }
    template <class Real>
    static std::string expected(Real low, Real high, bool low_is_open) {
        if (std::isinf(high)) return (low_is_open ? "" : "at least ") + text(low);
        return std::isinf(low) ? "at most " + text(high) : text(low) + " to " + text(high);
    }
    template <class Number>
    void refuse(const char* field, Number value, const std::string& range) {
        if (error_.empty())
            error_ = prefix_ + field + " is " + text(value) + ", " + range + " expected";
    }

    std::string prefix_, error_;
};

}  // namespace defrec
