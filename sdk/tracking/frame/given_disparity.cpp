// See given_disparity.hpp.
#include "sdk/tracking/frame/given_disparity.hpp"

#include <algorithm>
#include <cmath>

#include "include/defrec_c.h"
#include "sdk/base/util/error.hpp"
#include "sdk/rig/rig.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/tracking/decisions/disparity.hpp"
#include "sdk/tracking/frame/frame_input.hpp"

namespace defrec {
namespace {

using Limits = decisions::GivenDisparity;

const float* row_of(const float* values, uint64_t stride, uint32_t y) {
    return reinterpret_cast<const float*>(reinterpret_cast<const char*>(values) + y * stride);
}

// NaN is none.
bool is_disparity(float value) { return value >= 0 && value <= Limits::kMax; }
bool is_sigma(float value) {
    return value >= Limits::kMinSigma && value <= decisions::TemplateSurface::kMaxSigma;
}

// A look without a branch at a whole row finds whether there is something.
template <class IsWrong>
std::string first_fault(const char* name, const float* values, uint64_t stride, uint32_t width,
                        uint32_t height, const char* expected, const IsWrong& is_wrong) {
    for (uint32_t y = 0; y < height; ++y) {
        const float* row = row_of(values, stride, y);
        bool found = false;
        for (uint32_t x = 0; x < width; ++x) found |= is_wrong(row[x], x, y);
        if (!found) continue;
        const float* wrong = row;
        while (!is_wrong(*wrong, static_cast<uint32_t>(wrong - row), y)) ++wrong;
        return concat(name, " of pixel (", wrong - row, ", ", y, ") is ", *wrong, "; ", expected);
    }
    return {};
}

// The pixels of the raw image that stage rectify makes a pixel of, as docs/stages/rectify.md has
// it.
bool is_ignored(const FrameImage& ignore, const int32_t* map, uint32_t x, uint32_t y,
                uint32_t width, uint32_t height) {
    const auto at = [&](uint32_t column, uint32_t row) {
        return ignore.pixels[std::min(row, height - 1) * ignore.stride +
                             std::min(column, width - 1)] != 0;
    };
    if (map == nullptr) return at(x, y);
    constexpr int kShift = 7;  // 1/128 px
    const int32_t *raw = map + 2 * (size_t{y} * width + x), u = raw[0], v = raw[1];
    if (u < 0 || v < 0) return false;  // outside of the raw image
    const auto column = static_cast<uint32_t>(u >> kShift),
               row = static_cast<uint32_t>(v >> kShift);
    return at(column, row) || at(column + 1, row) || at(column, row + 1) || at(column + 1, row + 1);
}

int16_t rounded(float value) {
    if (!is_disparity(value) || value == 0) return DEFREC_DISPARITY_NONE;
    return static_cast<int16_t>(std::lround(value * float{DEFREC_DISPARITY_ONE}));
}

}  // namespace

std::string fault_of(const GivenDisparity& given, uint32_t width, uint32_t height) {
    std::string fault = first_fault(
        "disparity", given.values, given.stride, width, height,
        "0 for a pixel without disparity, else up to 2000 px expected, x in the left image less x "
        "in the right one",
        [](float value, uint32_t, uint32_t) { return !is_disparity(value); });
    if (!fault.empty()) return fault;
    constexpr const char* kExpected =
        "the standard deviation of its error expected, 0.001 to 100 px";
    if (given.sigma == nullptr)
        return is_sigma(given.sigma_px) ? std::string()
                                        : concat("sigma_px is ", given.sigma_px, "; ", kExpected);
    if (given.sigma_px != 0)
        return concat("sigma_px is ", given.sigma_px, ", and sigma is given; one of both expected");
    return first_fault("sigma", given.sigma, given.stride, width, height, kExpected,
                       [&](float value, uint32_t x, uint32_t y) {
                           return row_of(given.values, given.stride, y)[x] != 0 && !is_sigma(value);
                       });
}

KeptDisparity keep_disparity(const GivenDisparity& given, const Rig& rig, const FrameImage& ignore,
                             std::span<int16_t> values, std::span<float> sigma) {
    const uint32_t width = rig.width(), height = rig.height();
    double squares = 0;
    size_t count = 0;
    for (uint32_t y = 0; y < height; ++y) {
        const float* row = row_of(given.values, given.stride, y);
        const std::span<int16_t> kept = values.subspan(size_t{y} * width, width);
        std::transform(row, row + width, kept.begin(), rounded);
        if (ignore.pixels != nullptr)
            for (uint32_t x = 0; x < width; ++x)
                if (is_ignored(ignore, rig.map(0), x, y, width, height))
                    kept[x] = DEFREC_DISPARITY_NONE;
        if (given.sigma == nullptr) continue;
        const float* deviations = row_of(given.sigma, given.stride, y);
        for (uint32_t x = 0; x < width; ++x) {
            const bool is_known = kept[x] != DEFREC_DISPARITY_NONE && is_sigma(deviations[x]);
            sigma[size_t{y} * width + x] = is_known ? deviations[x] : 0;
            if (!is_known) continue;
            squares += double{deviations[x]} * deviations[x];
            ++count;
        }
    }
    const bool is_empty = std::all_of(values.begin(), values.end(),
                                      [](int16_t each) { return each == DEFREC_DISPARITY_NONE; });
    if (given.sigma == nullptr) return {values.data(), nullptr, given.sigma_px, is_empty};
    const double mean = count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0;
    return {values.data(), sigma.data(), std::max(static_cast<float>(mean), Limits::kMinSigma),
            is_empty};
}

}  // namespace defrec
