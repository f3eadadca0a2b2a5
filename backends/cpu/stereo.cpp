// Stage stereo on the CPU: memory, and the order in which its kernels pass over bands of rows.
// docs/stages/stereo.md.
#include "backends/stages/stereo.hpp"

#include <algorithm>
#include <cstring>

#include "backends/cpu/scratch_pool.hpp"
#include "backends/cpu/stages.hpp"
#include "backends/cpu/stereo_kernels.hpp"

namespace defrec::cpu {
namespace {

// Most rows that one task works on; more where it begins with rows that another ends with.
constexpr int kBand = 32, kSearchBand = 64, kTileRows = 64;
constexpr int kFewestRows = 8;  // fewer spend their time on the windows' first rows

// Rows of a task, where that many tasks lie side by side: as many as let all threads end together.
int rows_of_task(int rows, int most, int side_by_side, int threads) {
    const int tasks = (rows + most - 1) / most * side_by_side,
              rounds = (tasks + threads - 1) / threads,
              below = std::max(1, rounds * threads / side_by_side);
    return std::max((rows + below - 1) / below, kFewestRows);
}

// An image with margins that owns its memory.
template <class T>
class Image {
  public:
    Image(const Host& host, int width, int height, T margin = T())
        : stride_(ptrdiff_t(width + kMargin - 1) / kMargin * kMargin + 2 * kMargin),
          memory_(size_t(stride_) * size_t(height), margin, HostAllocator<T>(host)) {}
    Plane<T> plane() { return {memory_.data() + kMargin, stride_}; }
    Plane<const T> view() const { return {memory_.data() + kMargin, stride_}; }
    T* row(int y) { return plane().row(y); }
    const T* row(int y) const { return view().row(y); }

  private:
    ptrdiff_t stride_;
    HostVector<T> memory_;
};
using Bytes = Image<uint8_t>;
using Field = Image<int16_t>;

Field make_field(const Host& host, int width, int height) {
    return Field(host, width, height, int16_t(kNoDisparity));
}

// Images of one resolution.
struct Level {
    Level(const Host& host, int w, int h)
        : width(w), height(h), left(host, w, h), right(host, w, h), right_mask(host, w, h) {}

    int width, height;
    Bytes left, right, right_mask;
};

class Stereo final : public Stage {
  public:
    Stereo(const defrec_stereo_params& params, const Host& host)
        : c_(constants_of(params)),
          host_(host),
          threads_(int(std::clamp<size_t>(host.concurrency(), 1, 256))),
          full_(host, c_.width, c_.height),
          half_(host, c_.half_width, c_.half_height),
          half_left_mask_(host, c_.half_width, c_.half_height),
          standing_(host, c_.half_samples_x, c_.half_samples_y),
          dense_(make_field(host, c_.half_samples_x, c_.half_samples_y)),
          hypothesis_(make_field(host, c_.width, c_.height)),
          fields_{make_field(host, c_.samples_x, c_.samples_y),
                  make_field(host, c_.samples_x, c_.samples_y)},
          none_row_(make_field(host, c_.samples_x, 1)),
          confidence_(host, c_.samples_x, c_.samples_y),
          scratch_(host,
                   std::max({search_scratch_ints(c_), size_t(4 * c_.width + 2),
                             (smooth_scratch(c_.samples_x, c_.smooth_passes) + 1) / 2}),
                   size_t((c_.height + kFewestRows - 1) / kFewestRows)) {
        for (int w = c_.half_samples_x, h = c_.half_samples_y; w > 1 || h > 1;) {
            w = (w + 1) / 2;
            h = (h + 1) / 2;
            coarser_.push_back({w, h, make_field(host, w, h)});
        }
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        const StereoBuffers b = view_buffers<StereoBuffers>(c_, in, out);
        prepare_images(b);
        search_half(b);
        if (!fill_all(dense_)) {
            give_nothing(b);
            return;
        }
        give_half_samples(dense_, b.dense);
        refine_half(b);
        refine_full(b);
        finish(b);
    }

  private:
    struct Coarser {
        int width, height;
        Field field;
    };

    // work(y0, y1), or work(y0, y1, scratch), for bands of rows.
    template <class Work>
    void bands(int rows, Work&& work, int most = kBand) {
        const int each = rows_of_task(rows, most, 1, threads_);
        host_.parallel_for(size_t((rows + each - 1) / each), [&](size_t band) {
            const int y0 = int(band) * each;
            work(y0, std::min(rows, y0 + each));
        });
    }
    template <class Work>
    void bands_with_scratch(int rows, Work&& work, int most = kBand) {
        const auto lent = [&](int y0, int y1) {
            scratch_.lend([&](int32_t* scratch) { work(y0, y1, scratch); });
        };
        bands(rows, lent, most);
    }
    template <class Work>
    void each_row(int rows, Work&& work) {
        bands(rows, [&](int y0, int y1) {
            for (int y = y0; y < y1; ++y) work(y);
        });
    }
    template <class T>
    static void give(const Image<T>& from, int width, int height, T* to) {
        for (int y = 0; to != nullptr && y < height; ++y)
            std::copy_n(from.row(y), width, to + size_t(y) * size_t(width));
    }
    void give_half_samples(const Field& from, int16_t* to) const {
        give(from, c_.half_samples_x, c_.half_samples_y, to);
    }
    void give_samples(const Field& from, int16_t* to) const {
        give(from, c_.samples_x, c_.samples_y, to);
    }

    void prepare_images(const StereoBuffers& b) {
        const int w = c_.width, h = c_.height;
        // In pairs of rows, of which the half images' are made at once.
        bands_with_scratch((h + 1) / 2, [&](int y0, int y1, int32_t* scratch) {
            const auto one = [&](const uint8_t* gray, const uint8_t* mask, Bytes& image, int y) {
                pad_row(gray + ptrdiff_t(y) * c_.stride, image.row(y), w);
                if (mask != nullptr)
                    inpaint_row({gray, c_.stride}, {mask, c_.stride}, w, h, y, image.row(y),
                                scratch);
            };
            for (int y = y0; y < y1; ++y) {
                for (int v = 2 * y; v < std::min(h, 2 * y + 2); ++v) {
                    one(b.left, b.left_mask, full_.left, v);
                    one(b.right, b.right_mask, full_.right, v);
                    keep_right_mask(b, v);
                }
                if (y < half_.height) halve(b, y);
            }
        });
        give(full_.left, c_.width, c_.height, b.prepared_left);
        give(full_.right, c_.width, c_.height, b.prepared_right);
    }
    void keep_right_mask(const StereoBuffers& b, int y) {
        if (b.right_mask != nullptr)
            pad_row(b.right_mask + ptrdiff_t(y) * c_.stride, full_.right_mask.row(y), c_.width);
        else
            std::memset(full_.right_mask.row(y), 255, size_t(c_.width));
    }
    void halve(const StereoBuffers& b, int y) {
        const int upper = 2 * y, lower = upper + 1, w = half_.width;
        halve_row(full_.left.row(upper), full_.left.row(lower), half_.left.row(y), w);
        halve_row(full_.right.row(upper), full_.right.row(lower), half_.right.row(y), w);
        halve_mask_row(full_.right_mask.row(upper), full_.right_mask.row(lower),
                       half_.right_mask.row(y), w);
        if (b.left_mask != nullptr)
            halve_mask_row(b.left_mask + ptrdiff_t(upper) * c_.stride,
                           b.left_mask + ptrdiff_t(lower) * c_.stride, half_left_mask_.row(y), w);
        else
            std::memset(half_left_mask_.row(y), 255, size_t(w));
    }

    // Leaves what is supported in field 0 and the smoothed of it in the dense field. Until
    // refine_full the fields hold some of half resolution, and the hypothesis is its own.
    void search_half(const StereoBuffers& b) {
        Field& checked = fields_[1];
        const SearchJob job{.c = c_,
                            .left = half_.left.view(),
                            .right = half_.right.view(),
                            .left_mask = half_left_mask_.view(),
                            .right_mask = half_.right_mask.view(),
                            .left_keys = b.left_keys,
                            .right_keys = b.right_keys,
                            .checked = checked.plane()};
        const auto search = [&](int y0, int y1, int32_t* scratch) {
            search_rows(job, y0, y1, scratch);
        };
        bands_with_scratch(c_.half_samples_y, search, kSearchBand);
        give_half_samples(checked, b.checked);
        each_row(c_.half_samples_y, [&](int y) {
            supported_row(checked.view(), c_.half_samples_x, c_.half_samples_y, y, c_,
                          fields_[0].row(y));
        });
        give_half_samples(fields_[0], b.supported);
        smooth_half(kSearchSmoothRange);
    }

    // Field 0 into the dense field.
    void smooth_half(int range) {
        smooth({.from = fields_[0].view(),
                .to = dense_.plane(),
                .width = c_.half_samples_x,
                .height = c_.half_samples_y,
                .radius = kHalfSmoothRadius,
                .range = range,
                .passes = 1,
                .none_row = none_row_.row(0)});
    }
    void smooth(const SmoothJob& job) {
        bands_with_scratch(job.height, [&](int y0, int y1, int32_t* scratch) {
            smooth_rows(job, y0, y1, reinterpret_cast<int16_t*>(scratch));
        });
    }

    // Fills every hole; false if there is not one disparity.
    bool fill_all(Field& field) {
        if (coarser_.empty()) return field.row(0)[0] != kNoDisparity;  // one sample
        const auto coarser = [&](const Field& from, int width, int height, Field& to, int y) {
            coarser_row(from.row(2 * y),
                        2 * y + 1 < height ? from.row(2 * y + 1) : none_row_.row(0), width,
                        to.row(y));
        };
        const auto fill = [&](Field& fine, int width, const Coarser& c, int y) {
            const int v2 = std::clamp(y % 2 == 0 ? y / 2 - 1 : y / 2 + 1, 0, c.height - 1);
            fill_row(fine.row(y), width, c.field.row(y / 2), c.field.row(v2), c.width);
        };
        each_row(coarser_[0].height, [&](int y) {
            coarser(field, c_.half_samples_x, c_.half_samples_y, coarser_[0].field, y);
        });
        for (size_t i = 1; i < coarser_.size(); ++i)
            for (int y = 0; y < coarser_[i].height; ++y)
                coarser(coarser_[i - 1].field, coarser_[i - 1].width, coarser_[i - 1].height,
                        coarser_[i].field, y);
        if (coarser_.back().field.row(0)[0] == kNoDisparity) return false;
        for (size_t i = coarser_.size() - 1; i > 0; --i)
            for (int y = 0; y < coarser_[i - 1].height; ++y)
                fill(coarser_[i - 1].field, coarser_[i - 1].width, coarser_[i], y);
        each_row(c_.half_samples_y, [&](int y) { fill(field, c_.half_samples_x, coarser_[0], y); });
        return true;
    }

    void refine(const RefineJob& job) {
        const int columns = (job.width + kRefineTile - 1) / kRefineTile,
                  samples_y = (job.height + 1) / 2,
                  each = rows_of_task(samples_y, kTileRows, columns, threads_),
                  rows = (samples_y + each - 1) / each;
        host_.parallel_for(size_t(columns * rows), [&](size_t tile) {
            const int x0 = int(tile) % columns * kRefineTile, row0 = int(tile) / columns * each;
            refine_tile(job, x0, std::min(job.width, x0 + kRefineTile), row0,
                        std::min(samples_y, row0 + each));
        });
    }

    // From the dense field and the supported field 0; leaves the result in the dense field.
    void refine_half(const StereoBuffers& b) {
        const int w = c_.half_samples_x, h = c_.half_samples_y;
        bands_with_scratch(h, [&](int y0, int y1, int32_t* scratch) {
            for (int y = y0; y < y1; ++y)
                standing_row(fields_[0].view(), dense_.view(), y, c_,
                             reinterpret_cast<int16_t*>(scratch), standing_.row(y));
        });
        each_row(half_.height, [&](int y) {
            between_row(dense_.view(), w, h, half_.width, y, hypothesis_.row(y));
        });
        RefineJob job{};
        job.c = c_;
        job.left = half_.left.view();
        job.right = half_.right.view();
        job.width = half_.width;
        job.height = half_.height;
        job.radius = c_.radius;
        job.hypothesis = hypothesis_.view();
        job.result = fields_[0].plane();
        refine(job);
        smooth_half(kHalfSmoothRange);
        give_half_samples(dense_, b.half_refined);
    }

    // Leaves the evidence, speckles and all, in field 0.
    void refine_full(const StereoBuffers& b) {
        each_row(full_.height, [&](int y) {
            hypothesis_row(dense_.view(), c_.half_samples_x, c_.half_samples_y, full_.width, y,
                           hypothesis_.row(y));
        });
        give(hypothesis_, c_.width, c_.height, b.hypothesis);
        RefineJob job{};
        job.c = c_;
        job.left = full_.left.view();
        job.right = full_.right.view();
        job.width = full_.width;
        job.height = full_.height;
        job.radius = c_.refine_radius;
        job.hypothesis = hypothesis_.view();
        job.result = fields_[0].plane();
        job.classify = true;
        job.right_mask = full_.right_mask.view();
        job.left_mask = {b.left_mask, c_.stride};
        job.standing = standing_.view();
        job.confidence = confidence_of(b);
        job.refined = b.refined;
        job.score = b.score;
        refine(job);
    }

    Plane<uint8_t> confidence_of(const StereoBuffers& b) {
        return b.confidence != nullptr ? confidence_.plane() : Plane<uint8_t>{};
    }

    void finish(const StereoBuffers& b) {
        Field* f = fields_;
        const int w = c_.samples_x, h = c_.samples_y;
        const Plane<uint8_t> confidence = confidence_of(b);
        bands(h, [&](int y0, int y1) {
            drop_speckles_rows(f[0].view(), y0, y1, c_, f[1].plane(), confidence);
        });
        give_samples(f[1], b.evidence);
        bands(h, [&](int y0, int y1) {
            fill_small_rows(f[1].view(), hypothesis_.view(), y0, y1, c_, f[0].plane(), confidence);
        });
        give_samples(f[0], b.filled);
        smooth({.from = f[0].view(),
                .to = f[1].plane(),
                .width = w,
                .height = h,
                .radius = c_.smooth_radius,
                .range = c_.smooth_range,
                .passes = c_.smooth_passes,
                .none_row = none_row_.row(0)});
        each_row(c_.height, [&](int y) {
            result_row(f[1].view(), h, c_.width, c_.smooth_range, y,
                       b.disparity + ptrdiff_t(y) * c_.stride);
            if (b.confidence == nullptr) return;
            const uint8_t* from = confidence_.row(y / 2);
            uint8_t* to = b.confidence + ptrdiff_t(y) * c_.stride;
            for (int x = 0; x < c_.width; ++x) to[x] = from[x / 2];
        });
    }

    // The results of a pair without one disparity.
    void give_nothing(const StereoBuffers& b) const {
        const auto none = [](int16_t* to, size_t count) {
            if (to != nullptr) std::fill_n(to, count, int16_t(kNoDisparity));
        };
        none(b.dense, c_.half_samples());
        none(b.half_refined, c_.half_samples());
        none(b.hypothesis, c_.pixels());
        for (int16_t* field : {b.refined, b.evidence, b.filled}) none(field, c_.samples());
        if (b.score != nullptr) std::fill_n(b.score, c_.samples(), int16_t{0});
        for (int y = 0; y < full_.height; ++y) {
            none(b.disparity + ptrdiff_t(y) * c_.stride, size_t(full_.width));
            if (b.confidence != nullptr)
                std::fill_n(b.confidence + ptrdiff_t(y) * c_.stride, full_.width, uint8_t{0});
        }
    }

    StereoConstants c_;
    Host host_;
    int threads_;
    Level full_, half_;
    Bytes half_left_mask_;
    // Values per sample of half resolution.
    Bytes standing_;
    Field dense_;
    Field hypothesis_;  // of all pixels
    // Values per sample.
    Field fields_[2], none_row_;
    Bytes confidence_;
    std::vector<Coarser> coarser_;
    ScratchPool<int32_t> scratch_;
};

}  // namespace

std::unique_ptr<Stage> make_stereo(const defrec_stereo_params& params, const Host& host) {
    check_params(params);
    return std::make_unique<Stereo>(params, host);
}

}  // namespace defrec::cpu
