// What every host-memory backend's rectify checks and how it reads its buffers;
// docs/stages/rectify.md.
#pragma once
#include "backends/shared/stage.hpp"
#include "sdk/contract/stage_params.hpp"

namespace defrec {

constexpr int32_t kMapOne = 128;  // a map's unit: 1 px

struct RectifyBuffers {
    const uint8_t* source;
    const int32_t* map;     // nullptr: none
    const uint8_t* ignore;  // nullptr: none
    uint8_t* gray;
    uint8_t* mask;
};

inline RectifyBuffers rectify_buffers(const defrec_rectify_params& p, std::span<const InBuffer> in,
                                      std::span<const OutBuffer> out) {
    expect_buffers("rectify in", in, 1, 2);
    expect_buffers("rectify out", out, 2);
    const size_t source_bytes = size_t{p.source_stride} * (p.source_height - 1) +
                                size_t{p.source_width} * bytes_per_pixel(p.format);
    const size_t result_bytes = size_t{p.stride} * (p.height - 1) + p.width;
    RectifyBuffers buffers;
    buffers.source = take<uint8_t>("rectify source", in[0], source_bytes);
    buffers.map = take_optional<int32_t>("rectify map", in, 1, size_t{2} * p.width * p.height);
    buffers.ignore =
        take_optional<uint8_t>("rectify ignore", in, 2, size_t{p.source_width} * p.source_height);
    buffers.gray = take<uint8_t>("rectify gray", out[0], result_bytes);
    buffers.mask = take<uint8_t>("rectify mask", out[1], result_bytes);
    if (buffers.map == nullptr && (p.width != p.source_width || p.height != p.source_height))
        throw StageError(DEFREC_ERROR_ARGUMENT,
                         "rectify: without a map the result must have the source's size");
    return buffers;
}

}  // namespace defrec
