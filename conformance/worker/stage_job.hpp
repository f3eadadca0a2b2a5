// One run of one stage: its parameters, inputs and outputs, in host memory; and how it is run on a
// device so that writes where none belong, results of what lay in memory and results of the run
// before all show.
#pragma once
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "conformance/worker/case.hpp"
#include "sdk/device/stage_params.hpp"

namespace defrec::conformance {

using Bytes = std::vector<std::byte>;

struct Input {
    Bytes bytes;
    bool given = true;
    // An image: nobody may look at what lies between its rows and behind it, so that is something
    // else in each run. In bytes.
    uint64_t row = 0, stride = 0;
    // Records: their size, and where in them floats lie (offset in bytes, number).
    uint32_t record = 0;
    std::vector<std::pair<uint32_t, uint32_t>> floats;
};

struct Output {
    std::string name;      // "disparity"
    uint64_t size = 0;     // bytes that the definition asks for
    uint32_t element = 1;  // bytes
    // An image; stride in elements. width 0: records.
    uint32_t width = 0, height = 0, stride = 0;
    bool given = true;
};

struct StageJob {
    StageJob(uint32_t stage, const void* given_params) : params(stage, given_params) {}
    uint32_t stage() const { return params.stage(); }

    StageParams params;  // complete
    std::vector<Input> prepare, in;
    std::vector<Output> out;
    bool prepared = true;          // false: prepare is left out
    size_t optional_left_out = 0;  // optional buffers at the end of prepare that are not given
};

template <class T>
std::vector<std::pair<uint32_t, uint32_t>> floats_in() {
    if constexpr (std::is_same_v<T, float>) return {{0, 1}};
    if constexpr (std::is_same_v<T, defrec_motion>) return {{0, 8}};
    if constexpr (std::is_same_v<T, defrec_landmark>) return {{offsetof(T, position), 3}};
    if constexpr (std::is_same_v<T, defrec_match>) return {{offsetof(T, position), 4}};
    if constexpr (std::is_same_v<T, defrec_surface_point>)
        return {{0, 6}, {offsetof(T, weight), 4}};
    if constexpr (std::is_same_v<T, defrec_patch>)
        return {{offsetof(T, position), 9}, {offsetof(T, weight), 4}};
    if constexpr (std::is_same_v<T, defrec_patch_slope>) return {{0, 8}};
    if constexpr (std::is_same_v<T, defrec_patch_observation>)
        return {{offsetof(T, information), 3}};
    if constexpr (std::is_same_v<T, defrec_edge>) return {{offsetof(T, weight), 1}};
    return {};
}
template <class T>
Input records(std::span<const T> values) {
    Input input;
    input.record = sizeof(T);
    input.floats = floats_in<T>();
    input.bytes.resize(values.size_bytes());
    if (!values.empty()) std::memcpy(input.bytes.data(), values.data(), values.size_bytes());
    return input;
}
template <class T>
Input records(const std::vector<T>& values) {
    return records(std::span<const T>(values));
}
inline Input not_given() {
    Input input;
    input.given = false;
    return input;
}
// Rows of width elements that begin stride elements apart; pixels: width * height, without gaps.
template <class T>
Input image_input(const std::vector<T>& pixels, uint32_t width, uint32_t height, uint32_t stride) {
    Input input;
    input.row = width * sizeof(T);
    input.stride = stride * sizeof(T);
    input.bytes.resize(input.stride * (height - 1) + input.row);
    for (uint32_t y = 0; y < height; ++y)
        std::memcpy(input.bytes.data() + y * input.stride, pixels.data() + size_t(y) * width,
                    input.row);
    return input;
}
template <class T>
Output image_output(std::string name, uint32_t width, uint32_t height, uint32_t stride) {
    return {std::move(name),
            (uint64_t(stride) * (height - 1) + width) * sizeof(T),
            sizeof(T),
            width,
            height,
            stride,
            true};
}
template <class T>
Output record_output(std::string name, uint64_t count) {
    return {std::move(name), count * sizeof(T), sizeof(T), 0, 0, 0, true};
}
inline Output left_out(Output output) {
    output.given = false;
    return output;
}
template <class T>
std::vector<T> as(const Bytes& bytes) {
    std::vector<T> values(bytes.size() / sizeof(T));
    if (!values.empty())
        std::memcpy(static_cast<void*>(values.data()), bytes.data(), values.size() * sizeof(T));
    return values;
}

// What a job gives according to the reference: the outputs, and which of their bytes are written at
// all.
struct Expected {
    std::vector<Bytes> outputs;
    std::vector<std::vector<bool>> written;
};
Expected run_reference(Session& reference, const StageJob& job);

// The job alone on a new stage: its outputs, without any check but of the statuses.
std::vector<Bytes> run_plainly(Session& session, const StageJob& job);

// Runs the job, then the other one (of the same parameters and sizes), then the job again, on one
// stage without waiting in between, with outputs that are larger than need be and filled with
// something else each time. Throws CaseFailure if an input was changed, or if bytes were written
// that do not belong to the result or bytes of the result were not. Returns the results of the two
// runs.
struct Found {
    std::vector<Bytes> first, second;
};
Found run_strictly(Session& session, const StageJob& job, const StageJob& other,
                   const Expected& expected);

}  // namespace defrec::conformance
