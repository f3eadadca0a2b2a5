// The stage orb on a CPU: order of work and memory. The inner loops are in halving, orb_pyramid,
// orb_fast, orb_distance and orb_describe, the choice of features in orb_selection.
#include <hwy/cache_control.h>

#include <algorithm>
#include <utility>

#include "backends/cpu/halving.hpp"
#include "backends/cpu/orb_kernels.hpp"
#include "backends/cpu/orb_selection.hpp"
#include "backends/cpu/scratch_pool.hpp"
#include "backends/cpu/stages.hpp"

namespace defrec::cpu {
namespace {

using namespace defrec::orb;

constexpr uint32_t kRowsAtOnce = 32;
constexpr uint32_t kFeaturesAtOnce = 32;

// An odd number of cache lines, so that pixels above each other do not compete for the same one.
size_t padded(uint32_t width) { return ((width + kOrbSlack + 63) / 64 | 1) * 64; }

// Row y, `width` pixels, of an image (halve_gray) or mask (halve_mask) halved so often, at least
// once. scratch: row_scratch(width, halvings) elements.
size_t row_scratch(uint32_t width, uint32_t halvings) {
    return halvings > 1 ? 2 * padded(2 * width) + row_scratch(2 * width, halvings - 1) : 0;
}
void halve_row(decltype(halve_gray)& halve, OrbImage<const uint8_t> image, uint32_t halvings,
               uint32_t width, uint32_t y, uint8_t* result, uint8_t* scratch) {
    OrbImage<const uint8_t> from{image.row(2 * y), image.stride};
    if (halvings > 1) {
        const OrbImage<uint8_t> pair{scratch, padded(2 * width)};
        for (uint32_t i = 0; i < 2; ++i)
            halve_row(halve, image, halvings - 1, 2 * width, 2 * y + i, pair.row(i), pair.row(2));
        from = {pair.data, pair.stride};
    }
    halve(from.data, from.stride, result, 0, int32_t(width), 0, 1);
}

// Some rows of cells of one level, the unit of work.
struct Band {
    uint32_t level, first, last;
};

class Orb final : public Stage {
  public:
    Orb(const defrec_orb_params& params, const Host& host, const HostAllocator<uint8_t>& memory)
        : params_(params),
          host_(host),
          layout_(make_layout(params)),
          pixels_(memory),
          masks_{HostVector<uint8_t>(memory), HostVector<uint8_t>(memory)},
          scores_(host, params.cell * padded(layout_.level[0].width), SIZE_MAX),
          scratch_(host, padded(layout_.level[0].width), SIZE_MAX),
          halved_(host, params.halvings > 0 ? halved_size() : 0, SIZE_MAX),
          selection_(params, layout_, memory),
          bands_(memory),
          kept_(params.capacity, memory),
          offsets_(DEFREC_ORB_ANGLE_BINS, memory) {
        const uint32_t at_once = (kRowsAtOnce + params.cell - 1) / params.cell;
        size_t pixels = 0;
        for (uint32_t l = 0; l < layout_.levels; ++l) {
            const Level& level = layout_.level[l];
            stride_[l] = padded(level.width);
            first_pixel_[l] = pixels;
            first_band_[l] = bands_.size();
            pixels += level.height * stride_[l];
            if (l < 2) masks_[l].resize(level.height * stride_[l]);
            for (uint32_t y = 0; y < level.cells_y; y += at_once)
                bands_.push_back({l, y, std::min(y + at_once, level.cells_y)});
        }
        first_band_[layout_.levels] = bands_.size();
        pixels_.resize(pixels);
        for (uint32_t bin = 0; bin < DEFREC_ORB_ANGLE_BINS; ++bin)
            fill_offsets(turned_pattern(bin), offsets_[bin]);
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        const OrbBuffers buffers = orb_buffers(params_, layout_, in, out);
        gray_ = buffers.gray;
        mask_ = buffers.mask;

        if (buffers.scores != nullptr) std::fill_n(buffers.scores, layout_.pixels, uint8_t{0});
        // A level is examined while the next is built from it.
        for (uint32_t l = 0; l <= layout_.levels; ++l) {
            const size_t pieces = l < layout_.levels ? pieces_of(layout_.level[l]) : 0,
                         first_band = l > 0 ? first_band_[l - 1] : 0,
                         bands = l > 0 ? first_band_[l] - first_band : 0;
            host_.parallel_for(pieces + bands, [&](size_t task) {
                if (task < pieces)
                    build(l, uint32_t(task) * kRowsAtOnce);
                else
                    examine(bands_[first_band + task - pieces], buffers.scores);
            });
        }
        host_.parallel_for(bands_.size(), [&](size_t index) {
            const Band& band = bands_[index];
            for (uint32_t y = band.first; y < band.last; ++y)
                selection_.find_distances(band.level, y);
        });
        const uint32_t count = *buffers.count = selection_.choose(kept_);
        host_.parallel_for((count + kFeaturesAtOnce - 1) / kFeaturesAtOnce, [&](size_t chunk) {
            const uint32_t first = uint32_t(chunk) * kFeaturesAtOnce;
            const uint32_t last = std::min(first + kFeaturesAtOnce, count);
            for (uint32_t i = first; i < last; ++i) {
                if (i + 1 < last) fetch(kept_[i + 1]);
                buffers.features[i] = describe(kept_[i]);
            }
        });
        write_substages(buffers);
    }

  private:
    static void fill_offsets(const Pattern& pattern, OrbOffsets& offsets) {
        const auto offset = [](const Offset& point) {
            return (point.y + kPatchRadius) * kOrbPatchSide + point.x + kPatchRadius;
        };
        for (size_t i = 0; i < kTests; ++i)
            offsets.test[i] = {offset(pattern[2 * i]), offset(pattern[2 * i + 1])};
    }

    // Size of a piece of level 0 before it is softened: its rows and those above and below.
    size_t halved_size() const {
        const uint32_t width = layout_.level[0].width;
        return (kRowsAtOnce + 2) * padded(width) + row_scratch(width, params_.halvings);
    }

    OrbImage<uint8_t> image(uint32_t l) { return {&pixels_[first_pixel_[l]], stride_[l]}; }
    OrbImage<const uint8_t> image(uint32_t l) const {
        return {&pixels_[first_pixel_[l]], stride_[l]};
    }
    OrbImage<uint8_t> mask(uint32_t l) { return {masks_[l % 2].data(), stride_[l]}; }

    static size_t pieces_of(const Level& level) {
        return (level.height + kRowsAtOnce - 1) / kRowsAtOnce;
    }
    void build(uint32_t l, uint32_t first) {
        const Level& level = layout_.level[l];
        const uint32_t last = std::min(first + kRowsAtOnce, level.height);
        if (l == 0) return params_.halvings > 0 ? halve(first, last) : take(first, last);
        orb_shrink(std::as_const(*this).image(l - 1), image(l), level.width, first, last);
        const OrbImage<uint8_t> below = mask(l - 1);
        if (mask_ != nullptr)
            orb_shrink_mask({below.data, below.stride}, mask(l), level.width, first, last);
    }
    // Level 0 from the image as it is.
    void take(uint32_t first, uint32_t last) {
        const Level& level = layout_.level[0];
        scratch_.lend([&](uint16_t* scratch) {
            orb_soften({gray_, params_.stride}, level.width, level.height, image(0), first, last,
                       scratch);
        });
        for (uint32_t y = first; mask_ != nullptr && y < last; ++y)
            std::copy_n(mask_ + size_t(y) * params_.stride, level.width, mask(0).row(y));
    }
    // Level 0 from the halved image, of which there are only the rows that it takes.
    void halve(uint32_t first, uint32_t last) {
        const Level& level = layout_.level[0];
        const uint32_t above = first - std::min(first, 1u), end = std::min(last + 1, level.height);
        halved_.lend([&](uint8_t* memory) {
            const OrbImage<uint8_t> halved{memory, stride_[0]};
            uint8_t* const rest = halved.row(kRowsAtOnce + 2);
            for (uint32_t y = above; y < end; ++y)
                halve_row(halve_gray, {gray_, params_.stride}, params_.halvings, level.width, y,
                          halved.row(y - above), rest);
            scratch_.lend([&](uint16_t* scratch) {
                orb_soften({halved.data, halved.stride}, level.width, end - above,
                           {image(0).row(above), stride_[0]}, first - above, last - above, scratch);
            });
            for (uint32_t y = first; mask_ != nullptr && y < last; ++y)
                halve_row(halve_mask, {mask_, params_.stride}, params_.halvings, level.width, y,
                          mask(0).row(y), rest);
        });
    }

    // Corners of a band. all_scores: of all levels, or nullptr.
    void examine(const Band& band, uint8_t* all_scores) {
        const Level& level = layout_.level[band.level];
        const size_t stride = stride_[band.level];
        const OrbImage<uint8_t> usable = mask(band.level);
        const auto top = [&](uint32_t row) {
            return std::min(uint32_t(kBorder) + row * params_.cell,
                            level.height - uint32_t(kBorder));
        };
        scores_.lend([&](uint8_t* scores) {
            for (uint32_t y = band.first; y < band.last; ++y) {
                orb_find_corners({std::as_const(*this).image(band.level),
                                  {mask_ != nullptr ? usable.data : nullptr, stride},
                                  level.width,
                                  top(y),
                                  top(y + 1),
                                  params_.cell,
                                  params_.threshold,
                                  {scores, stride},
                                  selection_.row(band.level, y)});
                for (uint32_t v = top(y); all_scores != nullptr && v < top(y + 1); ++v)
                    std::copy(scores + (v - top(y)) * stride + kBorder,
                              scores + (v - top(y)) * stride + level.width - kBorder,
                              all_scores + level.first_pixel + size_t(v) * level.width + kBorder);
                selection_.take_row(band.level, y);
            }
        });
    }

    // A patch is 35 cache misses; asked for one feature ahead they cost nothing.
    void fetch(const OrbKept& kept) const {
        const OrbImage<const uint8_t> level = image(kept.level);
        constexpr uint32_t kReach = uint32_t(kPatchRadius + kSmoothRadius);
        for (uint32_t y = kept.y - kReach; y <= kept.y + kReach; ++y) {
            hwy::Prefetch(level.row(y) + kept.x - kReach);
            hwy::Prefetch(level.row(y) + kept.x + kReach);
        }
    }
    defrec_feature describe(const OrbKept& kept) const {
        const uint32_t bin = orb_orientation(image(kept.level), kept.x, kept.y);
        const Offset off = orb_refine(image(kept.level), kept.x, kept.y);
        defrec_feature feature{
            to_image(uint32_t(16 * kept.x + off.x), kept.level, params_.halvings),
            to_image(uint32_t(16 * kept.y + off.y), kept.level, params_.halvings),
            kept.level,
            uint16_t(bin),
            kept.score,
            {}};
        alignas(64) uint16_t smoothed[kOrbPatchSide * kOrbPatchSide];
        orb_smooth_patch(image(kept.level), kept.x, kept.y, smoothed);
        orb_describe(smoothed, offsets_[bin], feature.descriptor);
        return feature;
    }

    void write_pyramid(uint8_t* to) const {
        for (uint32_t l = 0; l < layout_.levels; ++l)
            for (uint32_t y = 0; y < layout_.level[l].height; ++y)
                std::copy_n(image(l).row(y), layout_.level[l].width,
                            to + layout_.level[l].first_pixel + size_t(y) * layout_.level[l].width);
    }
    void write_smoothed(uint16_t* to) {
        std::fill_n(to, layout_.pixels, uint16_t{0});
        scratch_.lend([&](uint16_t* scratch) {
            for (uint32_t l = 0; l < layout_.levels; ++l) {
                const Level& level = layout_.level[l];
                if (level.cells_y == 0) continue;
                orb_smooth(std::as_const(*this).image(l), level.width,
                           {to + level.first_pixel, level.width}, uint32_t(kSmoothRadius),
                           level.height - uint32_t(kSmoothRadius), scratch);
            }
        });
    }
    void write_substages(const OrbBuffers& to) {
        if (to.pyramid != nullptr) write_pyramid(to.pyramid);
        if (to.smoothed != nullptr) write_smoothed(to.smoothed);
        if (to.corners != nullptr)
            std::copy(selection_.packed().begin(), selection_.packed().end(), to.corners);
        if (to.distances != nullptr)
            std::copy(selection_.distances().begin(), selection_.distances().end(), to.distances);
    }

    defrec_orb_params params_;
    Host host_;
    Layout layout_;
    // One entry per level; strides in elements.
    size_t stride_[kOrbMaxLevels] = {}, first_pixel_[kOrbMaxLevels] = {};
    size_t first_band_[kOrbMaxLevels + 1] = {};
    HostVector<uint8_t> pixels_;
    HostVector<uint8_t> masks_[2];  // of the even levels, and of the odd ones, one at a time
    ScratchPool<uint8_t> scores_;
    ScratchPool<uint16_t> scratch_;
    ScratchPool<uint8_t> halved_;  // halved_size()
    OrbSelection selection_;
    HostVector<Band> bands_;
    HostVector<OrbKept> kept_;
    HostVector<OrbOffsets> offsets_;  // of each orientation bin
    const uint8_t* gray_ = nullptr;   // of the run in progress
    const uint8_t* mask_ = nullptr;
};

}  // namespace

std::unique_ptr<Stage> make_orb(const defrec_orb_params& params, const Host& host) {
    check_params(params);
    return std::make_unique<Orb>(params, host, HostAllocator<uint8_t>(host));
}

}  // namespace defrec::cpu
