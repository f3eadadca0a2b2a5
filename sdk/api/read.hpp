// Arguments that several exported functions read in the same way.
#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "sdk/base/util/check_ranges.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/base/util/struct_size.hpp"

namespace defrec {

template <class Pointer>
void expect_given(const char* name, Pointer* pointer) {
    if (pointer == nullptr) fail(DEFREC_ERROR_ARGUMENT, name, " is NULL");
}

// what: of the list's elements, in the plural.
inline void check_index(size_t index, size_t count, const char* what) {
    if (index >= count)
        fail(DEFREC_ERROR_ARGUMENT, "index is ", index, ", there are ", count, " ", what);
}

inline void check_count(size_t count) {
    if (count > std::numeric_limits<size_t>::max() / 64)
        fail(DEFREC_ERROR_ARGUMENT, "count is ", count);
}

// A struct that a caller fills in, within its ranges, its defaults filled in.
template <class Desc>
Desc read_complete(const Desc* given) {
    auto desc = read_struct<Desc>("desc", given);
    check_ranges(desc);
    fill_defaults(desc);
    return desc;
}

// An array that may not be NULL.
template <class Value>
std::span<const Value> read_array(const char* name, const Value* values, uint64_t count,
                                  size_t components) {
    if (count != 0) expect_given(name, values);
    return {values, static_cast<size_t>(count) * components};
}
// One that may: then it is empty.
template <class Value>
std::span<const Value> read_optional(const Value* values, uint64_t count, size_t components) {
    if (values == nullptr) return {};
    return {values, static_cast<size_t>(count) * components};
}

// values: 3x4 row-major. Whether it is a rigid motion is not looked at.
inline Eigen::Isometry3d affine_of(const double* values) {
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
            motion.matrix()(row, column) = values[4 * row + column];
    return motion;
}
template <class Rotation, class Translation>
void write_motion(const Rotation& rotation, const Translation& translation, double* values) {
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) values[4 * row + column] = rotation(row, column);
        values[4 * row + 3] = translation[row];
    }
}
// Row-major.
template <class Matrix>
void write_matrix(const Matrix& matrix, double* values) {
    for (Eigen::Index row = 0; row < matrix.rows(); ++row)
        for (Eigen::Index column = 0; column < matrix.cols(); ++column)
            *values++ = matrix(row, column);
}

}  // namespace defrec
