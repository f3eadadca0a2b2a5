// Contract of stage rectify: constants, buffers and checks, once for all backends.
// docs/stages/rectify.md. Shaders include this file as well, for the part outside __cplusplus.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/rectify_constants.h"
#ifdef __cplusplus
#include <algorithm>

#include "backends/stages/contract.hpp"

namespace defrec {
#endif

// What follows from the parameters. Sizes in px, strides in bytes.
struct RectifyConstants {
    int width, height, stride;
    int source_width, source_height, source_stride;
    int saturation, highlight_radius;
};

#ifdef __cplusplus
constexpr RectifyConstants constants_of(const defrec_rectify_params& p) {
    return {.width = int(p.width),
            .height = int(p.height),
            .stride = int(p.stride),
            .source_width = int(p.source_width),
            .source_height = int(p.source_height),
            .source_stride = int(p.source_stride),
            .saturation = int(std::min(p.saturation, 256u)),  // from 256 on no pixel is saturated
            .highlight_radius = int(p.highlight_radius)};
}

struct RectifyBuffers {
    static constexpr const char* kName = "rectify";
    const uint8_t* source;
    const int32_t* map;     // nullptr: none
    const uint8_t* ignore;  // nullptr: none
    uint8_t* gray;
    uint8_t* mask;

    template <class List>
    void list(List& list, const defrec_rectify_params& p) {
        const uint64_t result = image_elements(p.width, p.height, p.stride);
        list.input("source", source,
                   image_elements(uint64_t{p.source_width} * bytes_per_pixel(p.format),
                                  p.source_height, p.source_stride));
        list.optional_input("map", map, uint64_t{2} * p.width * p.height);
        list.optional_input("ignore", ignore, uint64_t{p.source_width} * p.source_height);
        list.output("gray", gray, result);
        list.output("mask", mask, result);
    }
};
inline RectifyBuffers rectify_buffers(const defrec_rectify_params& p, std::span<const InBuffer> in,
                                      std::span<const OutBuffer> out) {
    const auto buffers = view_buffers<RectifyBuffers>(p, in, out);
    if (buffers.map == nullptr && (p.width != p.source_width || p.height != p.source_height))
        throw StageError(DEFREC_ERROR_ARGUMENT,
                         "rectify: without a map the result must have the source's size");
    return buffers;
}
inline BufferTable buffer_table(const defrec_rectify_params& params) {
    return table_of<RectifyBuffers>(params);
}

}  // namespace defrec
#endif
