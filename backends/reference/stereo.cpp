// Stage stereo as plain code: the order of its sub-stages, and its buffers. docs/stages/stereo.md.
#include "backends/stages/stereo.hpp"

#include <algorithm>

#include "backends/reference/stages.hpp"
#include "backends/reference/stereo_steps.hpp"

namespace defrec::reference {
namespace {

template <class T>
void give(const Picture<T>& from, T* to) {
    if (to != nullptr) std::copy(from.pixels.begin(), from.pixels.end(), to);
}

Picture<uint8_t> read(const uint8_t* image, const StereoConstants& size) {
    Picture<uint8_t> result(size.width, size.height, 1);
    for (int y = 0; image != nullptr && y < size.height; ++y)
        std::copy_n(image + size_t(y) * size_t(size.stride), size.width, &result(0, y));
    return result;
}

class Stereo final : public Stage {
  public:
    explicit Stereo(const defrec_stereo_params& params) : c_(constants_of(params)) {}

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        const StereoBuffers b = view_buffers<StereoBuffers>(c_, in, out);
        const Mask left_mask = read(b.left_mask, c_), right_mask = read(b.right_mask, c_);
        const Gray left = inpaint(read(b.left, c_), left_mask),
                   right = inpaint(read(b.right, c_), right_mask);
        give(left, b.prepared_left);
        give(right, b.prepared_right);

        const Level half{halve(left), halve(right), halve_mask(left_mask), halve_mask(right_mask)};
        const Disparities agreed = search_half(b, half);
        const Disparities dense = fill_all(smooth(agreed, kHalfSmoothRadius, kSearchSmoothRange));
        give(dense, b.dense);
        const Disparities known = is_empty(dense) ? dense : refine_half(half, dense);
        give(known, b.half_refined);
        Evidence evidence{Disparities(c_.samples_x, c_.samples_y, kNoDisparity),
                          Picture<uint8_t>(c_.samples_x, c_.samples_y)};
        if (is_empty(known)) {
            give(Disparities(c_.width, c_.height, kNoDisparity), b.hypothesis);
            for (int16_t* field : {b.refined, b.evidence, b.filled})
                give(evidence.disparity, field);
            give(Picture<int16_t>(c_.samples_x, c_.samples_y), b.score);
        } else {
            const Disparities hypothesis = hypothesis_of(known, c_.width, c_.height);
            give(hypothesis, b.hypothesis);
            const Refinement refined = refine(left, right, hypothesis, c_.refine_radius);
            give(refined.disparity, b.refined);
            give(refined.score, b.score);
            evidence = classify(refined, hypothesis, standing(agreed, dense, c_), left_mask,
                                right_mask, c_);
            drop_speckles(evidence, c_);
            give(evidence.disparity, b.evidence);
            fill_small(evidence, hypothesis, c_);
            give(evidence.disparity, b.filled);
        }
        for (int pass = 0; pass < c_.smooth_passes; ++pass)
            evidence.disparity = smooth(evidence.disparity, c_.smooth_radius, c_.smooth_range);
        const Evidence result = at_all_pixels(evidence, c_);
        give_rows(result.disparity, b.disparity);
        give_rows(result.confidence, b.confidence);
    }

  private:
    struct Level {
        Gray left, right;
        Mask left_mask, right_mask;
    };

    // The samples' disparities that others agree with.
    Disparities search_half(const StereoBuffers& b, const Level& half) const {
        const WindowStatistics left_stats = statistics(half.left, c_.radius),
                               right_stats = statistics(half.right, c_.radius);
        const SearchResult found = search(half.left, half.right, left_stats, right_stats, c_);
        give(found.left, b.left_keys);
        give(found.right, b.right_keys);
        const Disparities checked = check(found, left_stats, half.left_mask, half.right_mask, c_);
        give(checked, b.checked);
        const Disparities agreed = supported(checked, c_);
        give(agreed, b.supported);
        return agreed;
    }
    Disparities refine_half(const Level& half, const Disparities& dense) const {
        const Disparities all = between_samples(dense, c_.half_width, c_.half_height);
        return smooth(refine(half.left, half.right, all, c_.radius).disparity, kHalfSmoothRadius,
                      kHalfSmoothRange);
    }

    template <class T>
    void give_rows(const Picture<T>& from, T* to) const {
        for (int y = 0; to != nullptr && y < c_.height; ++y)
            std::copy_n(&from(0, y), c_.width, to + size_t(y) * size_t(c_.stride));
    }

    StereoConstants c_;
};

}  // namespace

std::unique_ptr<Stage> make_stereo(const defrec_stereo_params& params, const Host&) {
    check_params(params);
    return std::make_unique<Stereo>(params);
}

}  // namespace defrec::reference
