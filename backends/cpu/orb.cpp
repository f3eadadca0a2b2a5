// The stage orb on a CPU: order of work and memory. The inner loops are in orb_pyramid, orb_fast,
// orb_distance and orb_describe, the choice of features in orb_selection.
#include <hwy/cache_control.h>

#include <algorithm>

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
          stride_(padded(params.width)),
          pixels_(memory),
          masks_(memory),
          smoothed_(memory),
          scores_(host, params.cell * stride_, SIZE_MAX),
          scratch_(memory),
          selection_(params, layout_, memory),
          bands_(memory),
          kept_(params.capacity, memory),
          offsets_(DEFREC_ORB_ANGLE_BINS, memory) {
        const uint32_t at_once = (kRowsAtOnce + params.cell - 1) / params.cell;
        size_t rows = 0;
        for (uint32_t l = 0; l < layout_.levels; ++l) {
            const Level& level = layout_.level[l];
            first_row_[l] = rows;
            rows += level.height;
            for (uint32_t y = 0; y < level.cells_y; y += at_once)
                bands_.push_back({l, y, std::min(y + at_once, level.cells_y)});
        }
        pixels_.resize(rows * stride_);
        masks_.resize(rows * stride_);
        smoothed_.resize(rows * stride_);
        scratch_.resize(
            std::max<size_t>(bands_.size(), (params.height + kRowsAtOnce - 1) / kRowsAtOnce) *
            stride_);
        for (uint32_t bin = 0; bin < DEFREC_ORB_ANGLE_BINS; ++bin)
            fill_offsets(turned_pattern(bin), offsets_[bin]);
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        const OrbBuffers buffers = orb_buffers(params_, layout_, in, out);
        gray_ = buffers.gray;
        mask_ = buffers.mask;

        for (uint32_t l = 0; l < layout_.levels; ++l) build_level(l);
        if (buffers.scores != nullptr) std::fill_n(buffers.scores, layout_.pixels, uint8_t{0});
        host_.parallel_for(bands_.size(), [&](size_t band) {
            scores_.lend([&](uint8_t* scores) { examine(band, scores, buffers.scores); });
        });
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
    void fill_offsets(const Pattern& pattern, OrbOffsets& offsets) const {
        const auto offset = [&](const Offset& point) {
            return point.y * int32_t(stride_) + point.x;
        };
        for (size_t i = 0; i < kTests; ++i)
            offsets.test[i] = {offset(pattern[2 * i]), offset(pattern[2 * i + 1])};
    }

    template <class T>
    OrbImage<T> of_level(HostVector<T>& values, uint32_t l) const {
        return {values.data() + first_row_[l] * stride_, stride_};
    }
    template <class T>
    OrbImage<const T> of_level(const HostVector<T>& values, uint32_t l) const {
        return {values.data() + first_row_[l] * stride_, stride_};
    }
    OrbImage<const uint8_t> image(uint32_t l) const { return of_level(pixels_, l); }
    OrbImage<const uint8_t> mask(uint32_t l) const {
        return mask_ == nullptr ? OrbImage<const uint8_t>{} : of_level(masks_, l);
    }

    void build_level(uint32_t l) {
        const Level& level = layout_.level[l];
        host_.parallel_for((level.height + kRowsAtOnce - 1) / kRowsAtOnce, [&](size_t piece) {
            const uint32_t first = uint32_t(piece) * kRowsAtOnce,
                           last = std::min(first + kRowsAtOnce, level.height);
            if (l == 0) {
                orb_soften({gray_, params_.stride}, level.width, level.height, of_level(pixels_, 0),
                           first, last, &scratch_[piece * stride_]);
                for (uint32_t y = first; mask_ != nullptr && y < last; ++y)
                    std::copy_n(mask_ + size_t(y) * params_.stride, level.width,
                                of_level(masks_, 0).row(y));
                return;
            }
            orb_shrink(image(l - 1), of_level(pixels_, l), level.width, first, last);
            if (mask_ != nullptr)
                orb_shrink_mask(mask(l - 1), of_level(masks_, l), level.width, first, last);
        });
    }

    // Corners of a band and the smoothed rows beside it; the first and the last band of a level
    // have those at its edges too. scores: of a row of cells. all_scores: of all levels, or
    // nullptr.
    void examine(size_t index, uint8_t* scores, uint8_t* all_scores) {
        const Band& band = bands_[index];
        const Level& level = layout_.level[band.level];
        const auto top = [&](uint32_t row) {
            return std::min(uint32_t(kBorder) + row * params_.cell,
                            level.height - uint32_t(kBorder));
        };
        for (uint32_t y = band.first; y < band.last; ++y) {
            orb_find_corners({image(band.level),
                              mask(band.level),
                              level.width,
                              top(y),
                              top(y + 1),
                              params_.cell,
                              params_.threshold,
                              {scores, stride_},
                              selection_.row(band.level, y)});
            for (uint32_t v = top(y); all_scores != nullptr && v < top(y + 1); ++v)
                std::copy(scores + (v - top(y)) * stride_ + kBorder,
                          scores + (v - top(y)) * stride_ + level.width - kBorder,
                          all_scores + level.first_pixel + size_t(v) * level.width + kBorder);
            selection_.take_row(band.level, y);
        }
        orb_smooth(
            image(band.level), level.width, of_level(smoothed_, band.level),
            band.first == 0 ? uint32_t(kSmoothRadius) : top(band.first),
            band.last == level.cells_y ? level.height - uint32_t(kSmoothRadius) : top(band.last),
            &scratch_[index * stride_]);
    }

    // A patch is 31 cache misses; asked for one feature ahead they cost nothing.
    void fetch(const OrbKept& kept) const {
        for (uint32_t y = kept.y - uint32_t(kPatchRadius); y <= kept.y + uint32_t(kPatchRadius);
             ++y) {
            const uint16_t* smoothed = of_level(smoothed_, kept.level).row(y) + kept.x;
            hwy::Prefetch(smoothed - kPatchRadius);
            hwy::Prefetch(smoothed + kPatchRadius);
            hwy::Prefetch(image(kept.level).row(y) + kept.x - kPatchRadius);
        }
    }
    defrec_feature describe(const OrbKept& kept) const {
        const uint32_t bin = orb_orientation(image(kept.level), kept.x, kept.y);
        const Offset off = orb_refine(image(kept.level), kept.x, kept.y);
        defrec_feature feature{to_image(uint32_t(16 * kept.x + off.x), kept.level),
                               to_image(uint32_t(16 * kept.y + off.y), kept.level),
                               kept.level,
                               uint16_t(bin),
                               kept.score,
                               {}};
        orb_describe(of_level(smoothed_, kept.level).row(kept.y) + kept.x, offsets_[bin],
                     feature.descriptor);
        return feature;
    }

    template <class T>
    void write_levels(T* to, const HostVector<T>& from) const {
        if (to == nullptr) return;
        for (uint32_t l = 0; l < layout_.levels; ++l)
            for (uint32_t y = 0; y < layout_.level[l].height; ++y)
                std::copy_n(of_level(from, l).row(y), layout_.level[l].width,
                            to + layout_.level[l].first_pixel + size_t(y) * layout_.level[l].width);
    }
    void write_substages(const OrbBuffers& to) const {
        write_levels(to.pyramid, pixels_);
        write_levels(to.smoothed, smoothed_);
        if (to.corners != nullptr)
            std::copy(selection_.packed().begin(), selection_.packed().end(), to.corners);
        if (to.distances != nullptr)
            std::copy(selection_.distances().begin(), selection_.distances().end(), to.distances);
    }

    defrec_orb_params params_;
    Host host_;
    Layout layout_;
    size_t stride_;                         // of all images here, elements
    size_t first_row_[kOrbMaxLevels] = {};  // of each level
    HostVector<uint8_t> pixels_, masks_;
    HostVector<uint16_t> smoothed_;
    ScratchPool<uint8_t> scores_;
    HostVector<uint16_t> scratch_;  // a row for each piece of work
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
