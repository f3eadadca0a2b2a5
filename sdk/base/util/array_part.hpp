// A part of an array that is cut into several, which are about equal.
#pragma once
#include <cstddef>

namespace defrec {

struct ArrayPart {
    size_t index = 0, count = 1;
    size_t begin(size_t size) const { return size * index / count; }
    size_t end(size_t size) const { return size * (index + 1) / count; }
};

}  // namespace defrec
