// See frame_input.hpp.
#include "sdk/tracking/frame/frame_input.hpp"

#include <algorithm>

#include "include/defrec_c.h"
#include "sdk/base/os/services.hpp"
#include "sdk/base/os/shared_loop.hpp"
#include "sdk/base/util/array_part.hpp"
#include "sdk/contract/pixel_format.hpp"
#include "sdk/tracking/frame/field_copy.hpp"
#include "sdk/tracking/frame/gray_copy.hpp"

namespace defrec {
namespace {
constexpr uint64_t kBand = 64 * 1024;    // bytes that a thread copies at a time
constexpr uint64_t kShare = 512 * 1024;  // bytes: what one thread copies while another wakes up

uint64_t row_bytes(const KeptImage& kept) { return kept.row_pixels * bytes_per_pixel(kept.format); }

// Rows from first up to the one before last.
void copy_whole(const KeptImage& kept, size_t first, size_t last, bool streams) {
    const uint64_t bytes = row_bytes(kept);
    const bool tight = kept.image.stride == bytes;
    const size_t rows = tight ? last - first : 1,
                 ahead =
                     tight ? kFetchAhead : (kFetchAhead + bytes - 1) / bytes * kept.image.stride;
    for (size_t y = first; y < last; y += rows)
        copy_gray(kept.format, kept.image.pixels + y * kept.image.stride, rows * kept.row_pixels,
                  &kept.copy[y * kept.row_pixels], streams, ahead);
}

}  // namespace

void keep_pixels(std::span<const KeptImage> images, uint32_t height, SharedLoop& loop,
                 const Services* helpers, bool is_idle) {
    uint64_t largest = 0;
    for (const KeptImage& kept : images)
        if (kept.image.pixels != nullptr) largest = std::max(largest, row_bytes(kept) * height);
    const size_t bands = std::max<uint64_t>(1, (largest + kBand - 1) / kBand);
    const auto copy_band = [&](size_t index) {
        const KeptImage& kept = images[index / bands];
        if (kept.image.pixels == nullptr) return;
        const ArrayPart band{index % bands, bands};
        const size_t first = band.begin(height), last = band.end(height);
        const RawImage image{kept.format, kept.image.pixels, kept.image.stride, kept.row_pixels,
                             height};
        if (kept.field == DEFREC_FIELD_NONE)
            copy_whole(kept, first, last, helpers != nullptr);
        else
            copy_field(image, kept.field == DEFREC_FIELD_BOTTOM, {first, last},
                       &kept.copy[first * kept.row_pixels], helpers != nullptr);
        if (kept.colours != nullptr) kept.colours->read_rows(image, kept.field, {first, last});
    };
    const size_t shares = helpers != nullptr && largest > kShare
                              ? images.size() * ((largest + kShare - 1) / kShare)
                              : 0,
                 awake = helpers != nullptr && is_idle && largest > kBand ? helpers->awake() : 0,
                 called =
                     std::max(shares, awake > 0 ? std::min(awake + 1, images.size() * bands) : 0);
    Services::forget_parallel_failure();
    loop.run(static_cast<uint32_t>(images.size() * bands), copy_band, [&] {
        if (called > 0) helpers->parallel_for(called, [&loop](size_t) { loop.help(); });
    });
    Services::expect_parallel_success("copying the pixels");
    for (const KeptImage& kept : images) {
        if (kept.image.pixels == nullptr) continue;
        kept.image.pixels = kept.copy.data();
        kept.image.stride = kept.row_pixels;
        kept.image.pixels_in_device = kept.copy_in_device;
    }
}

}  // namespace defrec
