// The stage orb on a CPU: order of work, memory, and which corners are kept. The inner loops are in
// orb_pyramid, orb_fast and orb_describe.
#include <algorithm>
#include <cstring>

#include "backends/cpu/orb_kernels.hpp"
#include "backends/cpu/stages.hpp"

namespace defrec::cpu {
namespace {

using namespace defrec::orb;

constexpr uint32_t kFeaturesAtOnce = 32;

// One row of cells of one level, the unit of work.
struct Band {
    uint32_t level, row;
    size_t first_cell;  // in all levels
};

struct Place {
    int32_t x, y;
};

// A feature that is kept, before it is described.
struct Kept {
    uint16_t x, y;
    uint8_t level, score;
};

class Orb final : public Stage {
  public:
    Orb(const defrec_orb_params& params, const Host& host, const HostAllocator<uint8_t>& memory)
        : params_(params),
          host_(host),
          layout_(make_layout(params)),
          stride_((params.width + kOrbSlack + 63) / 64 * 64),
          pixels_(memory),
          masks_(memory),
          smoothed_(memory),
          scores_(memory),
          scratch_(memory),
          corners_(layout_.cells, memory),
          distances_(layout_.cells, memory),
          bands_(memory),
          kept_(params.capacity, memory),
          offsets_(DEFREC_ORB_ANGLE_BINS, memory) {
        size_t rows = 0;
        for (uint32_t l = 0; l < layout_.levels; ++l) {
            first_row_[l] = rows;
            rows += layout_.level[l].height;
            for (uint32_t row = 0; row < layout_.level[l].cells_y; ++row)
                bands_.push_back(
                    {l, row, layout_.level[l].first_cell + size_t(row) * layout_.level[l].cells_x});
        }
        pixels_.resize(rows * stride_);  // level 0 stays in the caller's image, and its part here untouched
        masks_.resize(rows * stride_);
        scores_.resize(rows * stride_);
        smoothed_.resize((rows + 1) * stride_);  // a gather reads a little past the last sample
        scratch_.resize(bands_.size() * stride_);
        for (uint32_t bin = 0; bin < DEFREC_ORB_ANGLE_BINS; ++bin)
            fill_offsets(turned_pattern(bin), offsets_[bin]);
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        expect_buffers("orb input", in, 1, 1);
        expect_buffers("orb output", out, 2, 5);
        gray_ = take<uint8_t>("orb gray", in[0], image_bytes(params_));
        mask_ = take_optional<uint8_t>("orb mask", in, 1, image_bytes(params_));
        uint32_t* count = take<uint32_t>("orb feature count", out[0], 1);
        defrec_feature* features = take<defrec_feature>("orb features", out[1], params_.capacity);

        for (uint32_t l = 1; l < layout_.levels; ++l) build_level(l);
        host_.parallel_for(bands_.size(), [&](size_t band) { examine(band); });
        host_.parallel_for(bands_.size(), [&](size_t band) { find_distances(bands_[band]); });
        *count = keep_corners();
        host_.parallel_for((*count + kFeaturesAtOnce - 1) / kFeaturesAtOnce, [&](size_t chunk) {
            const uint32_t first = uint32_t(chunk) * kFeaturesAtOnce;
            for (uint32_t i = first; i < std::min(first + kFeaturesAtOnce, *count); ++i)
                features[i] = describe(kept_[i]);
        });
        write_substages(out);
    }

  private:
    void fill_offsets(const Pattern& pattern, OrbOffsets& offsets) const {
        const auto offset = [&](const Offset& point) { return point.y * int32_t(stride_) + point.x; };
        for (size_t i = 0; i < kTests; ++i) {
            offsets.first[i] = offset(pattern[2 * i]);
            offsets.second[i] = offset(pattern[2 * i + 1]);
        }
    }

    template <class T>
    T* of_level(HostVector<T>& values, uint32_t l) const {
        return values.data() + first_row_[l] * stride_;
    }
    template <class T>
    const T* of_level(const HostVector<T>& values, uint32_t l) const {
        return values.data() + first_row_[l] * stride_;
    }
    OrbImage<const uint8_t> image(uint32_t l) const {
        return l == 0 ? OrbImage<const uint8_t>{gray_, params_.stride}
                      : OrbImage<const uint8_t>{of_level(pixels_, l), stride_};
    }
    OrbImage<const uint8_t> mask(uint32_t l) const {
        if (mask_ == nullptr) return {};
        return l == 0 ? OrbImage<const uint8_t>{mask_, params_.stride}
                      : OrbImage<const uint8_t>{of_level(masks_, l), stride_};
    }
    void build_level(uint32_t l) {
        constexpr uint32_t kRows = 32;
        const Level& level = layout_.level[l];
        host_.parallel_for((level.height + kRows - 1) / kRows, [&](size_t piece) {
            const uint32_t first = uint32_t(piece) * kRows, last = std::min(first + kRows, level.height);
            orb_shrink(image(l - 1), layout_.level[l - 1].width, {of_level(pixels_, l), stride_}, level.width,
                       first, last);
            if (mask_ != nullptr)
                orb_shrink_mask(mask(l - 1), {of_level(masks_, l), stride_}, level.width, first, last);
        });
    }

    // Corners of a band and the smoothed rows beside it, the first and last band those at the edges too.
    void examine(size_t index) {
        const Band& band = bands_[index];
        const Level& level = layout_.level[band.level];
        const uint32_t first = uint32_t(kBorder) + band.row * params_.cell;
        const uint32_t last = std::min(first + params_.cell, level.height - uint32_t(kBorder));
        orb_find_corners({image(band.level),
                          mask(band.level),
                          level.width,
                          first,
                          last,
                          params_.cell,
                          params_.threshold,
                          {of_level(scores_, band.level), stride_},
                          &corners_[band.first_cell]});
        orb_smooth(image(band.level), level.width, {of_level(smoothed_, band.level), stride_},
                   band.row == 0 ? uint32_t(kSmoothRadius) : first,
                   band.row + 1 == level.cells_y ? level.height - uint32_t(kSmoothRadius) : last,
                   &scratch_[index * stride_]);
    }

    Place place(uint32_t corner, uint32_t cell_x, uint32_t cell_y) const {
        return {kBorder + int32_t(cell_x * params_.cell + (corner & 255)),
                kBorder + int32_t(cell_y * params_.cell + (corner >> 8 & 255))};
    }

    void find_distances(const Band& band) {
        const Level& level = layout_.level[band.level];
        for (uint32_t x = 0; x < level.cells_x; ++x)
            distances_[band.first_cell + x] = nearest_stronger(level, x, band.row);
    }

    // Looks at rings of cells round the corner's own until no cell of the next ring can be nearer.
    uint8_t nearest_stronger(const Level& level, uint32_t cell_x, uint32_t cell_y) const {
        const uint32_t* corners = &corners_[level.first_cell];
        const uint32_t corner = corners[cell_y * level.cells_x + cell_x];
        if (corner == 0) return 0;
        const Place own = place(corner, cell_x, cell_y);
        const int32_t cell = int32_t(params_.cell), cx = int32_t(cell_x), cy = int32_t(cell_y);
        const int32_t columns = int32_t(level.cells_x), rows = int32_t(level.cells_y);
        int32_t nearest = int32_t(kFarthest);
        const auto look = [&](int32_t x, int32_t y) {
            const uint32_t other = corners[y * columns + x];
            if (other >> 16 < corner >> 16 || other == 0) return;
            const Place there = place(other, uint32_t(x), uint32_t(y));
            const bool first = there.y != own.y ? there.y < own.y : there.x < own.x;
            if (other >> 16 > corner >> 16 || first)
                nearest = std::min(nearest, std::max(std::abs(there.x - own.x), std::abs(there.y - own.y)));
        };
        for (int32_t ring = 1; (ring - 1) * cell + 1 < nearest; ++ring) {
            const int32_t left = std::max(cx - ring, 0), right = std::min(cx + ring, columns - 1);
            for (const int32_t y : {cy - ring, cy + ring})
                if (y >= 0 && y < rows)
                    for (int32_t x = left; x <= right; ++x) look(x, y);
            for (int32_t y = std::max(cy - ring + 1, 0); y <= std::min(cy + ring - 1, rows - 1); ++y) {
                if (cx - ring >= 0) look(cx - ring, y);
                if (cx + ring < columns) look(cx + ring, y);
            }
        }
        return uint8_t(nearest);
    }

    // docs/stages/orb.md, "selection"; returns how many are kept.
    uint32_t keep_corners() {
        uint32_t of_distance[kFarthest + 1] = {};
        for (size_t i = 0; i < layout_.cells; ++i) ++of_distance[distances_[i]];
        uint32_t distance = kFarthest + 1, count = 0;
        while (distance > params_.spacing && count + of_distance[distance - 1] <= params_.capacity)
            count += of_distance[--distance];
        uint32_t least_score = 256;
        if (distance > params_.spacing) {
            uint32_t of_score[256] = {};
            for (size_t i = 0; i < layout_.cells; ++i)
                if (distances_[i] + 1u == distance) ++of_score[corners_[i] >> 16];
            while (least_score > 1 && count + of_score[least_score - 1] <= params_.capacity)
                count += of_score[--least_score];
        }

        uint32_t kept = 0;
        for (const Band& band : bands_) {
            const uint32_t cells = layout_.level[band.level].cells_x;
            for (uint32_t x = 0; x < cells; ++x) {
                const uint32_t corner = corners_[band.first_cell + x], d = distances_[band.first_cell + x];
                if (d == 0 || !(d >= distance || (d + 1 == distance && corner >> 16 >= least_score)))
                    continue;
                const Place at = place(corner, x, band.row);
                kept_[kept++] = {uint16_t(at.x), uint16_t(at.y), uint8_t(band.level), uint8_t(corner >> 16)};
            }
        }
        return kept;
    }

    defrec_feature describe(const Kept& kept) const {
        const uint32_t bin = orb_orientation(image(kept.level), kept.x, kept.y);
        defrec_feature feature{to_image(kept.x, kept.level),
                               to_image(kept.y, kept.level),
                               kept.level,
                               uint16_t(bin),
                               kept.score,
                               {}};
        orb_describe(of_level(smoothed_, kept.level) + kept.y * stride_ + kept.x, offsets_[bin],
                     feature.descriptor);
        return feature;
    }

    template <class T, class Row>
    void write_levels(T* to, Row row) const {
        if (to == nullptr) return;
        for (uint32_t l = 0; l < layout_.levels; ++l)
            for (uint32_t y = 0; y < layout_.level[l].height; ++y)
                std::copy_n(row(l, y), layout_.level[l].width,
                            to + layout_.level[l].first_pixel + size_t(y) * layout_.level[l].width);
    }
    void write_substages(std::span<const OutBuffer> out) const {
        write_levels(take_optional<uint8_t>("orb pyramid", out, 2, layout_.pixels),
                     [&](uint32_t l, uint32_t y) { return image(l).row(y); });
        write_levels(take_optional<uint16_t>("orb smoothed", out, 3, layout_.pixels),
                     [&](uint32_t l, uint32_t y) { return of_level(smoothed_, l) + y * stride_; });
        write_levels(take_optional<uint8_t>("orb scores", out, 4, layout_.pixels),
                     [&](uint32_t l, uint32_t y) { return of_level(scores_, l) + y * stride_; });
        if (auto* to = take_optional<uint32_t>("orb corners", out, 5, layout_.cells))
            std::copy(corners_.begin(), corners_.end(), to);
        if (auto* to = take_optional<uint8_t>("orb distances", out, 6, layout_.cells))
            std::copy(distances_.begin(), distances_.end(), to);
    }

    defrec_orb_params params_;
    Host host_;
    Layout layout_;
    size_t stride_;                      // of everything below, elements
    size_t first_row_[kMaxLevels] = {};  // of each level
    HostVector<uint8_t> pixels_, masks_;
    HostVector<uint16_t> smoothed_;
    HostVector<uint8_t> scores_;
    HostVector<uint16_t> scratch_;  // a row for each band
    HostVector<uint32_t> corners_;  // packed, one for each cell
    HostVector<uint8_t> distances_;
    HostVector<Band> bands_;
    HostVector<Kept> kept_;
    HostVector<OrbOffsets> offsets_;  // of each orientation bin
    const uint8_t* gray_ = nullptr;   // of the run in progress
    const uint8_t* mask_ = nullptr;
};

}  // namespace

std::unique_ptr<Stage> make_orb(const defrec_orb_params& params, const Host& host) {
    check(params);
    return std::make_unique<Orb>(params, host, HostAllocator<uint8_t>(host));
}

}  // namespace defrec::cpu
