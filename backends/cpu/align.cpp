// Guided patch search, fast: patches are shared out to the host's threads, a patch is SIMD
// throughout. Definition: docs/stages/align.md.
#include "backends/stages/align.hpp"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cmath>

#include "backends/cpu/align_kernels.hpp"
#include "backends/cpu/halving.hpp"
#include "backends/cpu/stages.hpp"
#include "backends/shared/align_view.hpp"

namespace defrec::cpu {
namespace {

constexpr size_t kPatchesPerTask = 16;
constexpr int32_t kRowsPerTask = 64;

class Align final : public Stage {
  public:
    Align(const defrec_align_params& params, const Host& host)
        : params_(checked(params)), host_(host), places_(params, host) {
        // The tables reach to the largest patch there may be: lanes beyond the search window look
        // up any entry.
        for (int32_t n = 1; n <= kAlignRows * kAlignRows; ++n) {
            inverse_.push_back(1.0f / float(n));
            root_.push_back(std::sqrt(float(n)));
        }
        gray_.resize(pyramid_size());
        mask_.resize(pyramid_size());
        patches_.reserve(params.patches);
        slopes_.reserve(params.patches);
        centres_.reserve(params.patches);
    }

    void prepare(std::span<const InBuffer> in) override {
        const AlignTemplate given = read_template(params_, in);
        patches_.assign(given.patches.begin(), given.patches.end());
        slopes_.assign(given.slopes.begin(), given.slopes.end());
        centres_.clear();
        for (const defrec_patch& patch : patches_)
            centres_.push_back(align::centre_of(patch, params_.level));
        const int32_t width = int32_t(params_.width >> params_.level),
                      height = int32_t(params_.height >> params_.level);
        const size_t doubled = size_t(4) * size_t(width) * size_t(height);
        view_pixels_.assign(doubled * params_.views + kAlignViewSlack, 0);
        views_.clear();
        for (uint32_t i = 0; i < params_.views; ++i) {
            const AlignLevel level = pyramid(given.views + view_offset(params_, i), nullptr);
            uint8_t* out = view_pixels_.data() + i * doubled;
            align::double_size(level.gray, width, height, level.stride, out);
            views_.push_back({out, 2 * width, 2 * height});
        }
        prepared_ = true;
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!prepared_) throw StageError(DEFREC_ERROR_STATE, "align: run before prepare");
        const AlignBuffers buffers = align_buffers(params_, patches_.size(), in, out);
        const AlignRun run{&params_,      pyramid(buffers.gray, buffers.mask),
                           views_.data(), inverse_.data(),
                           root_.data(),  &places_};
        host_.parallel_for(
            (patches_.size() + kPatchesPerTask - 1) / kPatchesPerTask, [&](size_t task) {
                AlignScratch scratch;
                const size_t last = std::min(patches_.size(), (task + 1) * kPatchesPerTask);
                for (size_t i = task * kPatchesPerTask; i < last; ++i) {
                    if (i + 1 < last) prefetch_view(centres_[i + 1]);
                    const defrec_patch_prediction prediction =
                        buffers.given != nullptr ? buffers.given[i]
                                                 : align::predict<float>(patches_[i], slopes_[i],
                                                                         buffers.motions, params_);
                    AlignPeak peak;
                    defrec_patch_observation observation{};
                    if (align_search(run, centres_[i], prediction, scratch, peak))
                        align_refine(run, scratch, peak, observation);
                    if (observation.valid == 0 && params_.keep_predicted != 0)
                        observation = align::predicted_observation(
                            prediction, align_predicted_score(run, prediction, scratch), params_);
                    buffers.observations[i] = observation;
                    if (buffers.predictions != nullptr) buffers.predictions[i] = prediction;
                }
            });
    }

  private:
    static defrec_align_params checked(const defrec_align_params& params) {
        check_params(params);
        return bounded(params);
    }
    // The part of its view that a patch is sampled from, unless it is strongly enlarged. Views are
    // too large for the inner caches, and every row of a patch is in another page.
    [[gnu::always_inline]] void prefetch_view(const AlignCentre& centre) const {
        if (!centre.valid) return;
        const AlignView& view = views_[centre.view];
        const int32_t reach = 2 * int32_t(params_.patch_radius) + 4;
        const int32_t x = 2 * (centre.x >> 8), y = 2 * (centre.y >> 8);
        const int32_t first = std::max(0, y - reach), last = std::min(view.height - 1, y + reach),
                      left = std::max(0, x - reach), right = std::min(view.width - 1, x + reach);
        for (int32_t row = first; row <= last; ++row) {
            const uint8_t* line = view.pixels + size_t(row) * size_t(view.width);
            hwy::Prefetch(line + left);
            hwy::Prefetch(line + right);
        }
    }

    size_t pyramid_stride(uint32_t level) const {
        return ((params_.width >> level) + 63) / 64 * 64;
    }
    size_t pyramid_size() const {
        size_t size = 0;
        for (uint32_t l = 1; l <= params_.level; ++l)
            size += pyramid_stride(l) * (params_.height >> l);
        return size;
    }

    // The image at the level searched; in the stage's own memory unless that is level 0.
    AlignLevel pyramid(const uint8_t* gray, const uint8_t* mask) {
        AlignLevel level{gray,
                         mask,
                         int32_t(params_.width),
                         int32_t(params_.height),
                         params_.stride,
                         gray_bytes(params_)};
        size_t offset = 0;
        for (uint32_t l = 1; l <= params_.level; ++l) {
            const AlignLevel below = level;
            uint8_t *to = gray_.data() + offset, *mask_to = mask_.data() + offset;
            level = {to,
                     mask != nullptr ? mask_to : nullptr,
                     below.width / 2,
                     below.height / 2,
                     pyramid_stride(l),
                     0};
            level.size = level.stride * size_t(level.height);
            host_.parallel_for(
                size_t(level.height + kRowsPerTask - 1) / kRowsPerTask, [&](size_t task) {
                    const int32_t first = int32_t(task) * kRowsPerTask,
                                  last = std::min(level.height, first + kRowsPerTask);
                    halve_gray(below.gray, below.stride, to, level.stride, level.width, first,
                               last);
                    if (mask != nullptr)
                        halve_mask(below.mask, below.stride, mask_to, level.stride, level.width,
                                   first, last);
                });
            offset += level.size;
        }
        return level;
    }

    defrec_align_params params_;
    Host host_;
    AlignPlaces places_;
    HostVector<float> inverse_{HostAllocator<float>(host_)},
        root_{HostAllocator<float>(host_)};  // 1 / n and sqrt(n), at n - 1
    HostVector<defrec_patch> patches_{HostAllocator<defrec_patch>(host_)};
    HostVector<defrec_patch_slope> slopes_{HostAllocator<defrec_patch_slope>(host_)};
    HostVector<AlignCentre> centres_{HostAllocator<AlignCentre>(host_)};
    HostVector<uint8_t> view_pixels_{HostAllocator<uint8_t>(host_)};
    HostVector<AlignView> views_{HostAllocator<AlignView>(host_)};
    HostVector<uint8_t> gray_{HostAllocator<uint8_t>(host_)},
        mask_{HostAllocator<uint8_t>(host_)};  // levels above 0
    bool prepared_ = false;
};

}  // namespace

AlignPlaces::AlignPlaces(const defrec_align_params& params, const Host& host)
    : sample_x(HostAllocator<int32_t>(host)),
      sample_y(sample_x),
      shift_x(sample_x),
      shift_y(sample_x),
      usable(kAlignRows * kAlignRow, HostAllocator<int16_t>(host)),
      x(usable),
      y(usable) {
    const int32_t r = int32_t(params.patch_radius);
    for (int32_t row = -r - 1; row <= r + 1; ++row)
        for (int32_t column = -r - 1; column <= r + 1; ++column) {
            sample_x.push_back(column);
            sample_y.push_back(row);
        }
    sample_x.resize(sample_x.size() + kAlignLanes);
    sample_y.resize(sample_x.size());
    const AlignSearch search(int32_t(params.search_radius));
    for (int32_t dy = -search.top; dy <= search.top; dy += search.step)
        for (int32_t k = 0; k < search.row_places; ++k) {
            const int32_t dx = 2 * k - search.farthest(dy);
            shift_x.push_back(dx <= search.farthest(dy) ? dx : kAlignFar);
            shift_y.push_back(dy);
        }
    shift_x.resize(shift_x.size() + kAlignLanes, kAlignFar);
    shift_y.resize(shift_x.size(), kAlignFar);
    for (int32_t row = -r; row <= r; ++row)
        for (int32_t column = -r; column <= r; ++column) {
            const size_t at = size_t((row + r) * kAlignRow + column + r);
            usable[at] = 1;
            x[at] = int16_t(column);
            y[at] = int16_t(row);
            sums.n += 1;
            sums.xx += column * column;
            sums.yy += row * row;
        }
    fits = align::make_light_fits(sums, 1.0f / float(sums.n));
}

std::unique_ptr<Stage> make_align(const defrec_align_params& params, const Host& host) {
    return std::make_unique<Align>(params, host);
}

}  // namespace defrec::cpu
