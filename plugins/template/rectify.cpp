// See rectify.hpp.
#include "rectify.hpp"

#include <algorithm>

namespace example {
namespace {

constexpr int32_t kMapOne = 128;  // a map's unit: 1 px
constexpr uint32_t kMaxRadius = 16, kMaxStride = 1048576;
enum : uint8_t {
    kCovered = 1,
    kSaturated = 2,
    kNearSaturated = 4
};  // what is known of a result pixel

uint32_t bytes_per_pixel(uint32_t format) {
    switch (format) {
        case DEFREC_FORMAT_GRAY8:
            return 1;
        case DEFREC_FORMAT_BGR8:
        case DEFREC_FORMAT_RGB8:
            return 3;
        case DEFREC_FORMAT_BGRA8:
            return 4;
        default:
            return 0;
    }
}

struct Work {
    const defrec_rectify_params& p;
    const RectifyImages& images;
    uint8_t* state;  // of each result pixel, without gaps

    // Section 1.
    int32_t gray(int32_t x, int32_t y) const {
        const uint8_t* pixel =
            images.source + size_t(y) * p.source_stride + size_t(x) * bytes_per_pixel(p.format);
        if (p.format == DEFREC_FORMAT_GRAY8) return pixel[0];
        const bool rgb = p.format == DEFREC_FORMAT_RGB8;
        const int32_t red = rgb ? pixel[0] : pixel[2], blue = rgb ? pixel[2] : pixel[0];
        return (77 * red + 150 * pixel[1] + 29 * blue + 128) >> 8;
    }
    bool ignored(int32_t x, int32_t y) const {
        return images.ignore[size_t(y) * p.source_width + size_t(x)] != 0;
    }

    // Section 2: gray of one result pixel into `result`; gives its state.
    uint8_t sample(size_t x, size_t y, uint8_t& result) const {
        const int32_t last_x = int32_t(p.source_width) - 1, last_y = int32_t(p.source_height) - 1;
        const int32_t* from = images.map == nullptr ? nullptr : images.map + 2 * (y * p.width + x);
        const int32_t mx = from ? from[0] : int32_t(x) * kMapOne,
                      my = from ? from[1] : int32_t(y) * kMapOne;
        if (mx < 0 || my < 0 || mx > last_x * kMapOne || my > last_y * kMapOne) {
            result = 0;
            return 0;
        }
        // Neighbours beyond the edge have the weight 0, and are not read.
        const int32_t i = mx / kMapOne, a = mx % kMapOne, i1 = std::min(i + 1, last_x);
        const int32_t j = my / kMapOne, b = my % kMapOne, j1 = std::min(j + 1, last_y);
        const int32_t upper = (128 - a) * gray(i, j) + a * gray(i1, j);
        const int32_t lower = (128 - a) * gray(i, j1) + a * gray(i1, j1);
        result = uint8_t(((128 - b) * upper + b * lower + 8192) >> 14);
        uint8_t found = result >= p.saturation ? kSaturated : 0;
        // Without a map only the pixel itself counts: its neighbours take no part.
        const bool hidden =
            images.ignore != nullptr &&
            (ignored(i, j) || (from && (ignored(i1, j) || ignored(i, j1) || ignored(i1, j1))));
        if (!hidden) found |= kCovered;
        return found;
    }

    // Section 2, and of section 3 what lies in one row: pixels with a saturated one within the
    // radius.
    void sample_row(size_t y) const {
        uint8_t* row = state + y * p.width;
        for (size_t x = 0; x < p.width; ++x) row[x] = sample(x, y, images.gray[y * p.stride + x]);
        for (size_t x = 0; x < p.width; ++x) {
            if (!(row[x] & kSaturated)) continue;
            const size_t end = std::min<size_t>(p.width, x + p.highlight_radius + 1);
            for (size_t u = x - std::min<size_t>(x, p.highlight_radius); u < end; ++u)
                row[u] |= kNearSaturated;
        }
    }

    // Section 3, after all rows are sampled.
    void mask_row(size_t y) const {
        const size_t first = y - std::min<size_t>(y, p.highlight_radius);
        const size_t end = std::min<size_t>(p.height, y + p.highlight_radius + 1);
        for (size_t x = 0; x < p.width; ++x) {
            bool usable = (state[y * p.width + x] & kCovered) != 0;
            for (size_t v = first; v < end && usable; ++v)
                usable = (state[v * p.width + x] & kNearSaturated) == 0;
            images.mask[y * p.stride + x] = usable ? 255 : 0;
        }
    }
};

}  // namespace

Verdict check_rectify(const defrec_rectify_params& p) {
    const auto side = [](uint32_t length) { return length >= 1 && length <= DEFREC_MAX_SIDE; };
    if (bytes_per_pixel(p.format) == 0)
        return {DEFREC_ERROR_ARGUMENT, "rectify: unknown pixel format"};
    if (!side(p.source_width) || !side(p.source_height) || !side(p.width) || !side(p.height))
        return {DEFREC_ERROR_ARGUMENT, "rectify: images of 1 x 1 to 8192 x 8192 px expected"};
    if (p.source_stride < p.source_width * bytes_per_pixel(p.format) || p.stride < p.width)
        return {DEFREC_ERROR_ARGUMENT, "rectify: a stride is shorter than its row"};
    if (p.source_stride > kMaxStride || p.stride > kMaxStride)
        return {DEFREC_ERROR_ARGUMENT, "rectify: a stride is at most 1048576 bytes"};
    if (p.saturation < 1) return {DEFREC_ERROR_ARGUMENT, "rectify: saturation must be at least 1"};
    if (p.highlight_radius < 1 || p.highlight_radius > kMaxRadius)
        return {DEFREC_ERROR_ARGUMENT, "rectify: a highlight_radius of 1 to 16 expected"};
    return {DEFREC_OK, ""};
}

uint64_t rectify_source_bytes(const defrec_rectify_params& p) {
    return uint64_t(p.source_stride) * (p.source_height - 1) +
           uint64_t(p.source_width) * bytes_per_pixel(p.format);
}
uint64_t rectify_map_bytes(const defrec_rectify_params& p) {
    return uint64_t(p.width) * p.height * 2 * sizeof(int32_t);
}
uint64_t rectify_ignore_bytes(const defrec_rectify_params& p) {
    return uint64_t(p.source_width) * p.source_height;
}
uint64_t rectify_result_bytes(const defrec_rectify_params& p) {
    return uint64_t(p.stride) * (p.height - 1) + p.width;
}
uint64_t rectify_scratch_bytes(const defrec_rectify_params& p) {
    return uint64_t(p.width) * p.height;
}

void rectify(const defrec_rectify_params& params, const defrec_host& host,
             const RectifyImages& images, uint8_t* scratch) {
    Work work{params, images, scratch};
    host.parallel_for(
        host.self, params.height,
        [](void* arg, size_t y) { static_cast<const Work*>(arg)->sample_row(y); }, &work);
    host.parallel_for(
        host.self, params.height,
        [](void* arg, size_t y) { static_cast<const Work*>(arg)->mask_row(y); }, &work);
}

}  // namespace example
