// The bytes of an input as the numbers and choices of a program, taken from front to back; zeros
// where they have run out.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace defrec::fuzz {

class Input {
  public:
    Input(const uint8_t* data, size_t size) : left_(data, size) {}

    bool is_empty() const { return left_.empty(); }

    bool flag() { return (number<uint8_t>() & 1) != 0; }
    // Any.
    template <class T>
    requires std::is_integral_v<T> T number() {
        T value{};
        const size_t count = std::min(left_.size(), sizeof value);
        if (count > 0) std::memcpy(&value, left_.data(), count);
        left_ = left_.subspan(count);
        return value;
    }
    // min .. max, from as few bytes as the range has.
    template <class T>
    requires std::is_unsigned_v<T> T number(T min, T max) {
        const uint64_t range = uint64_t{max} - min;
        uint64_t value = number<uint8_t>();
        for (int bits = 8; bits < 64 && range >> bits != 0; bits += 8)
            value |= uint64_t{number<uint8_t>()} << bits;
        return static_cast<T>(min + (range == UINT64_MAX ? value : value % (range + 1)));
    }
    double real(double min, double max) {
        return min + (max - min) * (number<uint32_t>() / static_cast<double>(UINT32_MAX));
    }
    // At most `count`.
    std::vector<uint8_t> bytes(size_t count) {
        const auto taken = left_.first(std::min(count, left_.size()));
        left_ = left_.subspan(taken.size());
        return {taken.begin(), taken.end()};
    }
    template <class T, size_t kCount>
    const T& one_of(const T (&choices)[kCount]) {
        return choices[number<size_t>(0, kCount - 1)];
    }

  private:
    std::span<const uint8_t> left_;
};

}  // namespace defrec::fuzz
