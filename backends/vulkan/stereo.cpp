// Stage stereo in shaders: half resolution from the images to a refined field, then full resolution
// from the hypothesis to the result. docs/stages/stereo.md; the shaders' names are those of its
// sections.
#include "backends/stages/stereo.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "backends/vulkan/shaders/stereo_push.h"
#include "backends/vulkan/stages.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

struct Push {
    StereoConstants constants;
    StereoGiven given;
};

constexpr int kTile = 32;  // side of the tile of a work group
constexpr uint64_t kOneGroupPixels =
    2048;  // coarser fields up to this size are made and filled by one work group

Groups tiles(int width, int height) {
    return {cover(uint64_t(width), kTile), cover(uint64_t(height), kTile)};
}
// Of the shaders with an invocation per pixel.
Groups pixels(int width, int height) {
    return {cover(uint64_t(width), 32), cover(uint64_t(height), 4)};
}

struct Level {
    int width, height;
    uint64_t pixels() const { return uint64_t(width) * uint64_t(height); }
};

// The field at half resolution and its coarser ones, down to one pixel.
std::vector<Level> levels_of(const StereoConstants& size) {
    std::vector<Level> levels{{size.half_width, size.half_height}};
    while (levels.back().pixels() > 1)
        levels.push_back({(levels.back().width + 1) / 2, (levels.back().height + 1) / 2});
    return levels;
}

uint64_t all_pixels(const std::vector<Level>& levels) {
    uint64_t sum = 0;
    for (const Level& level : levels) sum += level.pixels();
    return sum;
}

class Stereo final : public Stage {
  public:
    Stereo(const defrec_stereo_params& params, Device& device)
        : c_(constants_of(params)),
          levels_(levels_of(c_)),
          word_rows_(cover(uint64_t(c_.half_height), kTile) * (kTile / 4) + kMaxRadius / 2 + 1),
          kernels_(params, device),
          left_(device, c_.pixels(), c_.half_pixels(), words()),
          right_(device, c_.pixels(), c_.half_pixels(), words()),
          left_keys_(device, 4 * c_.half_pixels()),
          seconds_(device, 4 * c_.half_pixels()),
          right_keys_(device, 4 * c_.half_pixels()),
          checked_(device, 2 * c_.half_pixels()),
          supported_(device, 2 * c_.half_pixels()),
          pyramid_(device, 2 * all_pixels(levels_)),
          standing_(device, c_.half_pixels()),
          half_moved_(device, 2 * c_.half_pixels()),
          half_refined_(device, 2 * c_.half_pixels()),
          hypothesis_(device, 2 * c_.pixels()),
          confidence_(device, c_.pixels()),
          fields_{Buffer(device, 2 * c_.pixels()), Buffer(device, 2 * c_.pixels())} {}

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        const StereoBuffers given =
            view_buffers<StereoBuffers>(c_, sizes_of_inputs(in), sizes_of_outputs(out));
        const auto at = [](Buffers buffers, size_t i) {
            return i < buffers.size() ? buffers[i] : nullptr;
        };
        Run run{recorder, push_of(given), in[0], in[1], at(in, 2), at(in, 3)};
        std::array<const Buffer*, kOutputs> outputs;
        for (size_t i = 0; i < kOutputs; ++i) outputs[i] = at(out, i);
        prepare_images(run, outputs);
        search(run, outputs);
        fill(run, outputs);
        refine_half(run, outputs);
        refine_full(run, outputs);
        finish(run, outputs);
    }

  private:
    static constexpr int kMaxRadius = 6;
    static constexpr size_t kOutputs = 15;
    using Outputs = std::array<const Buffer*, kOutputs>;

    struct Kernels {
        Kernels(const defrec_stereo_params& p, Device& device)
            : prepare(device.kernel(shaders::stereo_prepare)),
              pack(device.kernel(shaders::stereo_pack, {p.radius})),
              left_statistics(device.kernel(shaders::stereo_statistics, {p.radius, 0})),
              right_statistics(device.kernel(shaders::stereo_statistics, {p.radius, 1})),
              search(device.kernel(shaders::stereo_search, {p.radius})),
              check(device.kernel(shaders::stereo_check)),
              support(device.kernel(shaders::stereo_support)),
              smooth_search(
                  device.kernel(shaders::stereo_smooth, {kHalfSmoothRadius, kSearchSmoothRange})),
              coarser(device.kernel(shaders::stereo_coarser)),
              fill_coarse(device.kernel(shaders::stereo_fill_coarse)),
              fill(device.kernel(shaders::stereo_fill)),
              standing(device.kernel(shaders::stereo_standing)),
              refine_half(device.kernel(shaders::stereo_refine, {p.radius, 1})),
              smooth_half(
                  device.kernel(shaders::stereo_smooth, {kHalfSmoothRadius, kHalfSmoothRange})),
              upsample(device.kernel(shaders::stereo_upsample)),
              refine(device.kernel(shaders::stereo_refine, {p.refine_radius, 0})),
              speckles(device.kernel(shaders::stereo_speckles)),
              small_holes(device.kernel(shaders::stereo_small_holes, {p.fill_radius})),
              // A smoothing of radius 0 only copies.
              smooth(device.kernel(shaders::stereo_smooth,
                                   {p.smooth_passes == 0 ? 0 : p.smooth_radius, p.smooth_range})) {}
        std::shared_ptr<const Kernel> prepare, pack, left_statistics, right_statistics, search,
            check, support, smooth_search, coarser, fill_coarse, fill, standing, refine_half,
            smooth_half, upsample, refine, speckles, small_holes, smooth;
    };

    // One of the two images with what is made of it before the search.
    struct Image {
        Image(Device& device, uint64_t pixels, uint64_t half_pixels, uint64_t words)
            : gray(device, pixels),
              half(device, half_pixels),
              half_mask(device, half_pixels),
              packed(device, 4 * words),
              statistics(device, 8 * half_pixels) {}
        Buffer gray, half, half_mask, packed, statistics;
    };

    struct Run {
        Recorder& recorder;
        Push push;
        const Buffer *left, *right, *left_mask, *right_mask;
    };

    uint64_t words() const { return uint64_t(word_rows_) * uint64_t(c_.half_width); }

    Push push_of(const StereoBuffers& given) const {
        return {c_,
                {.mask = given.right_mask != nullptr,
                 .left_mask = given.left_mask != nullptr,
                 .refined = given.refined != nullptr,
                 .score = given.score != nullptr,
                 .confidence = given.confidence != nullptr}};
    }

    // What a sub-stage left in `from`, if it is wanted.
    static void give(Run& run, const Buffer& from, const Buffer* to, uint64_t size) {
        if (to != nullptr) run.recorder.copy(from, *to, size);
    }

    void prepare_images(Run& run, const Outputs& out) {
        const Groups full = tiles(c_.width, c_.height), half = tiles(c_.half_width, c_.half_height);
        Push left_push = run.push;
        left_push.given.mask = run.push.given.left_mask;
        run.recorder.dispatch(kernels_.prepare,
                              {run.left, run.left_mask, left_.gray, left_.half, left_.half_mask},
                              left_push, full);
        run.recorder.beside(kernels_.prepare,
                            {run.right, run.right_mask, right_.gray, right_.half, right_.half_mask},
                            run.push, full);

        const Groups rows{cover(uint64_t(c_.half_width), 32), cover(uint64_t(word_rows_), 4)};
        run.recorder.dispatch(kernels_.left_statistics,
                              {left_.half, left_.statistics, left_.half_mask, nullptr}, run.push,
                              half);
        run.recorder.beside(kernels_.right_statistics,
                            {right_.half, right_.statistics, nullptr, right_keys_}, run.push, half);
        run.recorder.beside(kernels_.pack, {left_.half, left_.packed}, run.push, rows);
        run.recorder.beside(kernels_.pack, {right_.half, right_.packed}, run.push, rows);
        give(run, left_.gray, out[2], c_.pixels());
        give(run, right_.gray, out[3], c_.pixels());
    }

    // Leaves what is supported, and the smoothed of it as the finest field of the pyramid.
    void search(Run& run, const Outputs& out) {
        const Groups half = pixels(c_.half_width, c_.half_height);
        const Groups half_tiles = tiles(c_.half_width, c_.half_height);
        run.recorder.dispatch(kernels_.search,
                              {left_.packed, right_.packed, left_.statistics, right_.statistics,
                               left_keys_, seconds_, right_keys_},
                              run.push, half_tiles);
        run.recorder.dispatch(
            kernels_.check,
            {left_keys_, seconds_, right_keys_, left_.half_mask, right_.half_mask, checked_},
            run.push, half);
        run.recorder.dispatch(kernels_.support, {checked_, supported_}, run.push, half);
        run.recorder.dispatch(kernels_.smooth_search, {supported_, pyramid_}, half_smoothing(),
                              half_tiles);
        give(run, left_keys_, out[4], left_keys_.size());
        give(run, right_keys_, out[5], right_keys_.size());
        give(run, checked_, out[6], checked_.size());
        give(run, supported_, out[7], supported_.size());
    }

    void fill(Run& run, const Outputs& out) {
        int last = 0;  // the coarsest field that a dispatch of its own fills
        while (size_t(last) + 1 < levels_.size() &&
               levels_[size_t(last) + 1].pixels() > kOneGroupPixels)
            ++last;
        const auto level_push = [&](int level) {
            return PyramidLevel{c_.half_width, c_.half_height, level};
        };
        if (levels_.size() > 1) {
            for (int level = 0; level < last; ++level) {
                const Level& made = levels_[size_t(level) + 1];
                run.recorder.dispatch(kernels_.coarser, {pyramid_}, level_push(level),
                                      pixels(made.width, made.height));
            }
            run.recorder.dispatch(kernels_.fill_coarse, {pyramid_}, level_push(last), {1});
            for (int level = last; level >= 0; --level) {
                const Level& filled = levels_[size_t(level)];
                run.recorder.dispatch(kernels_.fill, {pyramid_}, level_push(level),
                                      pixels(filled.width, filled.height));
            }
        }
        give(run, pyramid_, out[8], 2 * c_.half_pixels());
    }

    void refine_half(Run& run, const Outputs& out) {
        const Groups half_tiles = tiles(c_.half_width, c_.half_height);
        run.recorder.dispatch(kernels_.refine_half,
                              {left_.half, right_.half, pyramid_, half_moved_, nullptr, nullptr,
                               nullptr, nullptr, nullptr, nullptr},
                              run.push, half_tiles);
        run.recorder.beside(kernels_.standing, {pyramid_, supported_, standing_}, run.push,
                            half_tiles);
        run.recorder.dispatch(kernels_.smooth_half, {half_moved_, half_refined_}, half_smoothing(),
                              half_tiles);
        give(run, half_refined_, out[9], half_refined_.size());
    }

    // Leaves the evidence, speckles and all, in field 0.
    void refine_full(Run& run, const Outputs& out) {
        run.recorder.dispatch(kernels_.upsample, {half_refined_, hypothesis_}, run.push,
                              pixels(c_.width, c_.height));
        run.recorder.dispatch(kernels_.refine,
                              {left_.gray, right_.gray, hypothesis_, fields_[0], run.left_mask,
                               run.right_mask, standing_, confidence_, out[11], out[12]},
                              run.push, tiles(c_.width, c_.height));
        give(run, hypothesis_, out[10], hypothesis_.size());
    }

    void finish(Run& run, const Outputs& out) {
        const Groups full = tiles(c_.width, c_.height);
        run.recorder.dispatch(kernels_.speckles, {fields_[0], confidence_, fields_[1]}, run.push,
                              full);
        give(run, fields_[1], out[13], fields_[1].size());
        run.recorder.dispatch(kernels_.small_holes,
                              {fields_[1], hypothesis_, confidence_, fields_[0], out[1]}, run.push,
                              full);
        give(run, fields_[0], out[14], fields_[0].size());
        const int passes = std::max(c_.smooth_passes, 1);
        for (int pass = 0; pass < passes; ++pass) {
            const bool last = pass == passes - 1;
            const SmoothSize push{c_.width, c_.height, last ? c_.stride : c_.width};
            run.recorder.dispatch(kernels_.smooth,
                                  {fields_[pass % 2], last ? *out[0] : fields_[(pass + 1) % 2]},
                                  push, full);
        }
    }

    SmoothSize half_smoothing() const { return {c_.half_width, c_.half_height, c_.half_width}; }

    StereoConstants c_;
    std::vector<Level> levels_;
    uint32_t word_rows_;  // rows of words in a packed half image, up to the end of the last tile's
                          // windows
    Kernels kernels_;
    Image left_, right_;
    Buffer left_keys_, seconds_, right_keys_, checked_, supported_;
    Buffer pyramid_;  // the dense field and its coarser ones
    Buffer standing_, half_moved_, half_refined_, hypothesis_, confidence_;
    Buffer fields_[2];  // of full resolution, which the last steps pass back and forth
};

}  // namespace

std::unique_ptr<Stage> make_stereo(const defrec_stereo_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Stereo>(params, device);
}

}  // namespace defrec::vulkan
