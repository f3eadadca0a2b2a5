// FNV-1a over words of eight bytes: to compare pictures.
#pragma once
#include <cstdint>
#include <cstring>

#include "sdk/base/util/fnv1a.hpp"

namespace defrec {

class WordHash {
  public:
    // The eight bytes from here on.
    void add(const uint8_t* bytes) {
        uint64_t word;
        std::memcpy(&word, bytes, sizeof word);
        add(word);
    }
    void add(uint64_t word) { value_ = fnv1a(value_, word); }
    uint64_t value() const { return value_; }

  private:
    uint64_t value_ = kFnvBasis;
};

}  // namespace defrec
