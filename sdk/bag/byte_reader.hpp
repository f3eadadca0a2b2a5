// Numbers, bytes and texts of a record, taken from front to back, little-endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

namespace defrec::cli {

using ByteView = std::span<const unsigned char>;

// A value that is not there is 0 or empty, and has_failed() says so from then on.
class ByteReader {
  public:
    explicit ByteReader(ByteView left) : left_(left) {}

    bool has_failed() const { return has_failed_; }
    ByteView left() const { return left_; }

    template <class T>
    requires std::is_unsigned_v<T> T number() {
        T value = 0;
        int shift = 0;
        for (const unsigned char byte : bytes(sizeof(T))) {
            value = static_cast<T>(value | static_cast<T>(T{byte} << shift));
            shift += 8;
        }
        return value;
    }
    ByteView bytes(std::uint64_t count) {
        has_failed_ = has_failed_ || count > left_.size();
        if (has_failed_) return {};
        const ByteView taken = left_.first(static_cast<std::size_t>(count));
        left_ = left_.subspan(taken.size());
        return taken;
    }
    // With its length before it, in 32 bits.
    std::string_view text() {
        const ByteView taken = bytes(number<std::uint32_t>());
        return {reinterpret_cast<const char*>(taken.data()), taken.size()};
    }

  private:
    ByteView left_;
    bool has_failed_ = false;
};

}  // namespace defrec::cli
