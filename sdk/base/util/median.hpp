#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace defrec {

// The upper one of two in the middle. Reorders the values, of which there is at least one.
template <class T>
T median_in_place(std::vector<T>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Likewise; 0 for none.
inline double median(std::vector<double> values) {
    return values.empty() ? 0 : median_in_place(values);
}

}  // namespace defrec
