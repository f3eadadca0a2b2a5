// The stage orb as plain code: docs/stages/orb.md, one function for each of its sections.
#include <algorithm>
#include <array>

#include "backends/definition/orb_definition.hpp"
#include "backends/reference/stages.hpp"

namespace defrec::reference {
namespace {

using namespace defrec::orb;

// An image inside a larger array.
template <class T>
struct View {
    T* data;
    size_t stride;
    T& at(int32_t x, int32_t y) const { return data[size_t(y) * stride + size_t(x)]; }
};

struct Corner {  // of one cell; score 0: none
    int32_t x, y;
    uint32_t score;
};

// Section "pyramid": pixels of the image, and of its mask, halved so often.
int32_t halved(View<const uint8_t> image, uint32_t halvings, int32_t x, int32_t y) {
    if (halvings == 0) return image.at(x, y);
    const auto at = [&](int32_t dx, int32_t dy) {
        return halved(image, halvings - 1, 2 * x + dx, 2 * y + dy);
    };
    return (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) >> 2;
}
bool halved_usable(View<const uint8_t> mask, uint32_t halvings, int32_t x, int32_t y) {
    if (halvings == 0) return mask.at(x, y) != 0;
    const auto at = [&](int32_t dx, int32_t dy) {
        return halved_usable(mask, halvings - 1, 2 * x + dx, 2 * y + dy);
    };
    return at(0, 0) && at(1, 0) && at(0, 1) && at(1, 1);
}

// Level 0: the mean under a binomial window of 3 x 3, the image continued by its edge.
void soften(const Level& level, View<const uint8_t> image, View<uint8_t> result) {
    constexpr int32_t kWeight[3] = {1, 2, 1};
    const int32_t width = int32_t(level.width), height = int32_t(level.height);
    for (int32_t y = 0; y < height; ++y)
        for (int32_t x = 0; x < width; ++x) {
            int32_t sum = 8;
            for (int32_t dy = -1; dy <= 1; ++dy)
                for (int32_t dx = -1; dx <= 1; ++dx)
                    sum += kWeight[dy + 1] * kWeight[dx + 1] *
                           image.at(std::clamp(x + dx, 0, width - 1),
                                    std::clamp(y + dy, 0, height - 1));
            result.at(x, y) = uint8_t(sum >> 4);
        }
}

// The other levels: 5 pixels become 4, with weights in eighths.
struct Resampled {
    int32_t source;         // the left or upper of the two pixels
    int32_t first, second;  // their weights
};
Resampled resample(uint32_t x) {
    const int32_t phase = int32_t(x % 4);
    return {int32_t(x / 4) * 5 + phase, 7 - 2 * phase, 1 + 2 * phase};
}

void shrink(const Level& level, View<const uint8_t> source, View<uint8_t> result) {
    for (uint32_t y = 0; y < level.height; ++y)
        for (uint32_t x = 0; x < level.width; ++x) {
            const Resampled h = resample(x), v = resample(y);
            const auto row = [&](int32_t sy) {
                return h.first * source.at(h.source, sy) + h.second * source.at(h.source + 1, sy);
            };
            result.at(int32_t(x), int32_t(y)) =
                uint8_t((v.first * row(v.source) + v.second * row(v.source + 1) + 32) >> 6);
        }
}

void shrink_mask(const Level& level, View<const uint8_t> source, View<uint8_t> result) {
    for (uint32_t y = 0; y < level.height; ++y)
        for (uint32_t x = 0; x < level.width; ++x) {
            const int32_t sx = resample(x).source, sy = resample(y).source;
            const bool usable = source.at(sx, sy) && source.at(sx + 1, sy) &&
                                source.at(sx, sy + 1) && source.at(sx + 1, sy + 1);
            result.at(int32_t(x), int32_t(y)) = usable ? 255 : 0;
        }
}

// Section "smoothing": 256 times the mean under a binomial window of 5 x 5.
void smooth(const Level& level, View<const uint8_t> image, View<uint16_t> result) {
    constexpr int32_t kWeight[5] = {1, 4, 6, 4, 1};
    const int32_t r = kSmoothRadius;
    for (int32_t y = 0; y < int32_t(level.height); ++y)
        for (int32_t x = 0; x < int32_t(level.width); ++x) {
            int32_t sum = 0;
            if (level.cells_x > 0 && x >= r && y >= r && x < int32_t(level.width) - r &&
                y < int32_t(level.height) - r)
                for (int32_t dy = -r; dy <= r; ++dy)
                    for (int32_t dx = -r; dx <= r; ++dx)
                        sum += kWeight[dy + r] * kWeight[dx + r] * image.at(x + dx, y + dy);
            result.at(x, y) = uint16_t(sum);
        }
}

// Section "corner score": the largest t for which 9 pixels of the circle in a row are all brighter
// than the centre by t or all darker by t.
uint32_t corner_score(View<const uint8_t> image, int32_t x, int32_t y) {
    int32_t difference[16];
    for (size_t i = 0; i < 16; ++i)
        difference[i] = image.at(x + kCircle[i].x, y + kCircle[i].y) - image.at(x, y);
    int32_t best = 0;
    for (size_t start = 0; start < 16; ++start) {
        int32_t brighter = 255, darker = 255;
        for (size_t i = start; i < start + 9; ++i) {
            brighter = std::min(brighter, difference[i % 16]);
            darker = std::min(darker, -difference[i % 16]);
        }
        best = std::max({best, brighter, darker});
    }
    return uint32_t(best);
}

bool usable_around(View<const uint8_t> mask, int32_t x, int32_t y) {
    for (int32_t dy = -kCircleRadius; dy <= kCircleRadius; ++dy)
        for (int32_t dx = -kCircleRadius; dx <= kCircleRadius; ++dx)
            if (mask.at(x + dx, y + dy) == 0) return false;
    return true;
}

void score(const Level& level, View<const uint8_t> image, View<const uint8_t> mask,
           uint32_t threshold, View<uint8_t> result) {
    for (int32_t y = 0; y < int32_t(level.height); ++y)
        for (int32_t x = 0; x < int32_t(level.width); ++x) {
            uint32_t s = 0;
            if (x >= kBorder && y >= kBorder && x < int32_t(level.width) - kBorder &&
                y < int32_t(level.height) - kBorder &&
                (mask.data == nullptr || usable_around(mask, x, y)))
                s = corner_score(image, x, y);
            result.at(x, y) = uint8_t(s > threshold ? s : 0);
        }
}

// Section "cells": the strongest corner of each cell.
void find_corners(const Level& level, uint32_t cell, View<const uint8_t> scores, Corner* corners) {
    for (uint32_t cy = 0; cy < level.cells_y; ++cy)
        for (uint32_t cx = 0; cx < level.cells_x; ++cx) {
            Corner best{0, 0, 0};
            const int32_t x0 = kBorder + int32_t(cx * cell), y0 = kBorder + int32_t(cy * cell);
            for (int32_t y = y0; y < std::min(y0 + int32_t(cell), int32_t(level.height) - kBorder);
                 ++y)
                for (int32_t x = x0;
                     x < std::min(x0 + int32_t(cell), int32_t(level.width) - kBorder); ++x)
                    if (scores.at(x, y) > best.score) best = {x, y, scores.at(x, y)};
            corners[cy * level.cells_x + cx] = best;
        }
}

// Section "distance": Chebyshev distance of each corner to the nearest stronger one, at most
// kFarthest; 0 without a corner.
void find_distances(const Level& level, uint32_t cell, const Corner* corners, uint8_t* distances) {
    const auto columns = int32_t(level.cells_x), rows = int32_t(level.cells_y);
    for (int32_t i = 0; i < columns * rows; ++i) {
        const Corner& own = corners[i];
        const int32_t cx = i % columns, cy = i / columns;
        int32_t nearest = own.score > 0 ? int32_t(kFarthest) : 0;
        const auto look_at = [&](int32_t x, int32_t y) {
            const int32_t k = y * columns + x;
            const Corner& other = corners[k];
            if (other.score > own.score || (other.score == own.score && k < i))
                nearest = std::min(nearest,
                                   std::max(std::abs(other.x - own.x), std::abs(other.y - own.y)));
        };
        // Corners lie within their cells, so one `ring` cells away is farther than ring - 1 times
        // a cell.
        for (int32_t ring = 0; (ring - 1) * int32_t(cell) < nearest; ++ring)
            for (int32_t y = std::max(cy - ring, 0); y <= std::min(cy + ring, rows - 1); ++y) {
                const bool whole = std::abs(y - cy) == ring;
                for (int32_t x = cx - ring; x <= cx + ring; x += whole ? 1 : 2 * ring)
                    if (x >= 0 && x < columns) look_at(x, y);
            }
        distances[i] = uint8_t(nearest);
    }
}

// Section "selection": corners at least `distance` from any stronger one are kept, and of those
// exactly one nearer the ones with at least `score`.
struct Limits {
    uint32_t distance, score;
    bool keeps(uint32_t d, uint32_t s) const {
        return d >= distance || (d + 1 == distance && s >= score);
    }
};
Limits choose_limits(const defrec_orb_params& params, size_t cells, const Corner* corners,
                     const uint8_t* distances) {
    const auto kept = [&](const Limits& limits) {
        size_t count = 0;
        for (size_t i = 0; i < cells; ++i)
            count += distances[i] > 0 && limits.keeps(distances[i], corners[i].score) ? 1 : 0;
        return count;
    };
    Limits limits{params.spacing, 256};
    while (kept(limits) > params.capacity) ++limits.distance;
    if (limits.distance > params.spacing)
        while (limits.score > 1 && kept({limits.distance, limits.score - 1}) <= params.capacity)
            --limits.score;
    return limits;
}

// Section "position", 1/16 px.
Offset refinement(View<const uint8_t> image, const Corner& corner) {
    const auto at = [&](int32_t dx, int32_t dy) {
        return int32_t(corner_score(image, corner.x + dx, corner.y + dy));
    };
    return {peak(at(-1, 0), at(0, 0), at(1, 0)), peak(at(0, -1), at(0, 0), at(0, 1))};
}

// Section "orientation".
uint32_t orientation(View<const uint8_t> image, int32_t x, int32_t y) {
    int32_t mx = 0, my = 0;
    for (int32_t dy = -kPatchRadius; dy <= kPatchRadius; ++dy) {
        const int32_t half = kDiscHalfWidth[size_t(std::abs(dy))];
        for (int32_t dx = -half; dx <= half; ++dx) {
            mx += dx * image.at(x + dx, y + dy);
            my += dy * image.at(x + dx, y + dy);
        }
    }
    return angle_bin(mx, my);
}

// Section "descriptor".
void describe(View<const uint16_t> smoothed, int32_t x, int32_t y, const Pattern& pattern,
              uint32_t* descriptor) {
    std::fill_n(descriptor, 8, 0u);
    for (size_t i = 0; i < kTests; ++i) {
        const Offset a = pattern[2 * i], b = pattern[2 * i + 1];
        if (smoothed.at(x + a.x, y + a.y) < smoothed.at(x + b.x, y + b.y))
            descriptor[i / 32] |= 1u << (i % 32);
    }
}

class Orb final : public Stage {
  public:
    Orb(const defrec_orb_params& params, const HostAllocator<uint8_t>& memory)
        : params_(params),
          layout_(make_layout(params)),
          halved_(size_t(layout_.level[0].width) * layout_.level[0].height, memory),
          pyramid_(layout_.pixels, memory),
          masks_(layout_.pixels, memory),
          smoothed_(layout_.pixels, memory),
          scores_(layout_.pixels, memory),
          corners_(layout_.cells, memory),
          distances_(layout_.cells, memory),
          patterns_(DEFREC_ORB_ANGLE_BINS, memory) {
        for (uint32_t bin = 0; bin < DEFREC_ORB_ANGLE_BINS; ++bin)
            patterns_[bin] = turned_pattern(bin);
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        const OrbBuffers buffers = orb_buffers(params_, layout_, in, out);
        const uint8_t* mask = buffers.mask;

        build_pyramid(buffers.gray, mask);
        for (uint32_t l = 0; l < layout_.levels; ++l) {
            const Level& level = layout_.level[l];
            smooth(level, image(l), of_level(smoothed_, l));
            score(level, image(l),
                  mask ? View<const uint8_t>(constant(of_level(masks_, l))) : View<const uint8_t>{},
                  params_.threshold, of_level(scores_, l));
            find_corners(level, params_.cell, constant(of_level(scores_, l)),
                         corners_.data() + level.first_cell);
            find_distances(level, params_.cell, corners_.data() + level.first_cell,
                           distances_.data() + level.first_cell);
        }
        const Limits limits =
            choose_limits(params_, layout_.cells, corners_.data(), distances_.data());
        *buffers.count = write_features(limits, buffers.features);
        write_substages(buffers);
    }

  private:
    template <class T>
    static View<const T> constant(View<T> view) {
        return {view.data, view.stride};
    }
    template <class Vector>
    View<typename Vector::value_type> of_level(Vector& values, uint32_t l) const {
        return {values.data() + layout_.level[l].first_pixel, layout_.level[l].width};
    }
    View<const uint8_t> image(uint32_t l) { return constant(of_level(pyramid_, l)); }

    void build_pyramid(const uint8_t* gray, const uint8_t* mask) {
        const Level& finest = layout_.level[0];
        const View<uint8_t> small{halved_.data(), finest.width}, usable = of_level(masks_, 0);
        for (int32_t y = 0; y < int32_t(finest.height); ++y)
            for (int32_t x = 0; x < int32_t(finest.width); ++x) {
                small.at(x, y) = uint8_t(halved({gray, params_.stride}, params_.halvings, x, y));
                if (mask != nullptr)
                    usable.at(x, y) =
                        halved_usable({mask, params_.stride}, params_.halvings, x, y) ? 255 : 0;
            }
        soften(finest, constant(small), of_level(pyramid_, 0));
        for (uint32_t l = 1; l < layout_.levels; ++l) {
            shrink(layout_.level[l], image(l - 1), of_level(pyramid_, l));
            if (mask)
                shrink_mask(layout_.level[l], constant(of_level(masks_, l - 1)),
                            of_level(masks_, l));
        }
    }

    uint32_t write_features(const Limits& limits, defrec_feature* features) {
        uint32_t count = 0;
        for (uint32_t l = 0; l < layout_.levels; ++l) {
            const Level& level = layout_.level[l];
            for (size_t i = level.first_cell;
                 i < level.first_cell + size_t(level.cells_x) * level.cells_y; ++i) {
                const Corner& corner = corners_[i];
                if (distances_[i] == 0 || !limits.keeps(distances_[i], corner.score)) continue;
                defrec_feature& feature = features[count++];
                const uint32_t bin = orientation(image(l), corner.x, corner.y);
                const Offset off = refinement(image(l), corner);
                feature = {to_image(uint32_t(16 * corner.x + off.x), l, params_.halvings),
                           to_image(uint32_t(16 * corner.y + off.y), l, params_.halvings),
                           uint16_t(l),
                           uint16_t(bin),
                           corner.score,
                           {}};
                describe(constant(of_level(smoothed_, l)), corner.x, corner.y, patterns_[bin],
                         feature.descriptor);
            }
        }
        return count;
    }

    void write_substages(const OrbBuffers& to) const {
        if (to.pyramid != nullptr) std::copy(pyramid_.begin(), pyramid_.end(), to.pyramid);
        if (to.smoothed != nullptr) std::copy(smoothed_.begin(), smoothed_.end(), to.smoothed);
        if (to.scores != nullptr) std::copy(scores_.begin(), scores_.end(), to.scores);
        for (size_t i = 0; to.corners != nullptr && i < layout_.cells; ++i)
            to.corners[i] = packed(corners_[i]);
        if (to.distances != nullptr) std::copy(distances_.begin(), distances_.end(), to.distances);
    }
    uint32_t packed(const Corner& corner) const {
        if (corner.score == 0) return 0;
        const uint32_t in_cell_x = uint32_t(corner.x - kBorder) % params_.cell,
                       in_cell_y = uint32_t(corner.y - kBorder) % params_.cell;
        return corner.score << 16 | in_cell_y << 8 | in_cell_x;
    }

    defrec_orb_params params_;
    Layout layout_;
    HostVector<uint8_t> halved_;  // the image before it is softened
    HostVector<uint8_t> pyramid_, masks_;
    HostVector<uint16_t> smoothed_;
    HostVector<uint8_t> scores_;
    HostVector<Corner> corners_;
    HostVector<uint8_t> distances_;
    HostVector<Pattern> patterns_;
};

}  // namespace

std::unique_ptr<Stage> make_orb(const defrec_orb_params& params, const Host& host) {
    check_params(params);
    return std::make_unique<Orb>(params, HostAllocator<uint8_t>(host));
}

}  // namespace defrec::reference
