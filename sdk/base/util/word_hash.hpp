// FNV-1a over words of eight bytes: to compare pictures, not against anybody who forges them.
#pragma once
#include <cstdint>
#include <cstring>

namespace defrec {

class WordHash {
  public:
    // The eight bytes from here on.
    void add(const uint8_t* bytes) {
        uint64_t word;
        std::memcpy(&word, bytes, sizeof word);
        add(word);
    }
    void add(uint64_t word) { value_ = (value_ ^ word) * 1099511628211u; }
    uint64_t value() const { return value_; }

  private:
    uint64_t value_ = 1469598103934665603u;
};

}  // namespace defrec
