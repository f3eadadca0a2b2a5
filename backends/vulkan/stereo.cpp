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

struct StereoPush {
    StereoConstants constants;
    StereoGiven given;
};

constexpr uint32_t kTile = 32;  // side of the tile of a work group, pixels or samples; but for:
constexpr uint32_t kSearchTileWidth = 48, kRefineTileWidth = 96, kRefineTileHeight = 16,
                   kSmoothTile = 30;
constexpr uint32_t kPassesAtOnce = 4;

// How work is divided, by the names in the shaders: runs are what an invocation does of a line.
struct Division {
    uint32_t prepare_invocations;
    uint32_t tile_levels;  // of support and fill
    uint32_t support_run, fill_run;
    uint32_t holes_run;
    uint32_t smooth_run, smooth_result_run, smooth_invocations;
    uint32_t tile() const { return 1u << tile_levels; }  // side of the tiles of support and fill
    // One for each run of the samples whose support is counted, in whole subgroups.
    uint32_t support_invocations() const {
        const uint32_t side = tile() + 2 * kHalfSmoothRadius;
        return cover(side * cover(side, support_run), 32) * 32;
    }
    uint32_t fill_invocations() const { return tile() * tile() / fill_run; }
};
constexpr Division kNarrow{.prepare_invocations = 64,
                           .tile_levels = 5,
                           .support_run = 4,
                           .fill_run = 4,
                           .holes_run = 8,
                           .smooth_run = 8,
                           .smooth_result_run = 2,
                           .smooth_invocations = 144};
constexpr Division kWide{.prepare_invocations = 256,
                         .tile_levels = 4,
                         .support_run = 1,
                         .fill_run = 1,
                         .holes_run = 2,
                         .smooth_run = 2,
                         .smooth_result_run = 1,
                         .smooth_invocations = 512};

// Groups of disparities that stereo_search_wide.comp has at once, as many as shared memory has room
// for.
constexpr uint32_t wide_slots(const StereoConstants& c) { return c.radius <= 4 ? 16 : 8; }

Groups tiles(int width, int height, uint32_t tile_width = kTile, uint32_t tile_height = kTile) {
    return {cover(uint64_t(width), tile_width), cover(uint64_t(height), tile_height)};
}

struct Level {
    int width, height;
    uint64_t pixels() const { return uint64_t(width) * uint64_t(height); }
};

// The field of half resolution's samples and its coarser ones, down to one pixel.
std::vector<Level> levels_of(const StereoConstants& size) {
    std::vector<Level> levels{{size.half_samples_x, size.half_samples_y}};
    while (levels.back().pixels() > 1)
        levels.push_back({(levels.back().width + 1) / 2, (levels.back().height + 1) / 2});
    return levels;
}

// From level `first` on, or of the coarsest alone.
uint64_t all_pixels(const std::vector<Level>& levels, size_t first = 0) {
    uint64_t sum = 0;
    for (size_t i = std::min(first, levels.size() - 1); i < levels.size(); ++i)
        sum += levels[i].pixels();
    return sum;
}

// Bytes of shared memory of stereo_fill.comp.
uint64_t fill_shared(const std::vector<Level>& levels, const Division& by) {
    const uint64_t side = by.tile() + 2 * kEdgeRadius;
    return 4 * (1 + all_pixels(levels, by.tile_levels) + side * side * 5 / 3);
}

// The narrow tiles fit any image: 30,488 bytes of the largest.
Division division_of(const std::vector<Level>& levels, const Device& device) {
    Division by = device.wide() ? kWide : kNarrow;
    if (fill_shared(levels, by) > device.limits().maxComputeSharedMemorySize) {
        by.tile_levels = kNarrow.tile_levels;
        by.support_run = kNarrow.support_run;
        by.fill_run = kNarrow.fill_run;
    }
    return by;
}

// Bytes of an image in words (shaders/stereo.glsl).
uint64_t column_words(int width, int height) {
    return 4 * uint64_t(width) * cover(uint64_t(height), 4);
}
uint64_t row_words(int width, int height) {
    return 8 * uint64_t{cover(uint64_t(width), 4) + 2} * uint64_t(height);
}

class Stereo final : public Stage {
  public:
    Stereo(const defrec_stereo_params& params, Device& device)
        : c_(constants_of(params)),
          wide_(device.wide()),
          levels_(levels_of(c_)),
          by_(division_of(levels_, device)),
          kernels_(c_, levels_, by_, device),
          left_(device, column_words(c_.width, c_.height), c_, wide_ ? 0 : c_.half_samples()),
          right_(device, row_words(c_.width, c_.height), c_, wide_ ? 0 : c_.right_winners()),
          right_half_rows_(device, row_words(c_.half_width, c_.half_height)),
          left_keys_(device, 4 * c_.half_samples()),
          candidates_(device, 2 * c_.half_samples()),
          right_keys_(device, 4 * c_.right_winners()),
          supported_(device, 2 * c_.half_samples()),
          pyramid_(device, 2 * all_pixels(levels_)),
          dense_(device, 2 * c_.half_samples()),
          standing_(device, c_.half_samples()),
          half_moved_(device, 2 * c_.half_samples()),
          evidence_(device, 4 * c_.samples()),
          fields_{Buffer(device, 2 * c_.samples()), Buffer(device, 2 * c_.samples())} {
        // A wide search leaves out where no window fits.
        device.clear(left_keys_);
        device.clear(candidates_);
    }

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        const StereoBuffers given =
            view_buffers<StereoBuffers>(c_, sizes_of_inputs(in), sizes_of_outputs(out));
        const auto at = [](Buffers buffers, size_t i) {
            return i < buffers.size() ? buffers[i] : nullptr;
        };
        Outputs outputs;
        int given_outputs = 0;
        for (size_t i = 0; i < kOutputs; ++i) {
            outputs[i] = at(out, i);
            if (outputs[i] != nullptr) given_outputs |= 1 << i;
        }
        const StereoPush push{c_,
                              {.mask = given.right_mask != nullptr,
                               .left_mask = given.left_mask != nullptr,
                               .outputs = given_outputs}};
        Run run{recorder, push, in[0], in[1], at(in, 2), at(in, 3)};
        prepare_images(run, outputs);
        search(run, outputs);
        refine(run, outputs);
        finish(run, outputs);
    }

  private:
    static constexpr size_t kOutputs = 15;
    using Outputs = std::array<const Buffer*, kOutputs>;

    struct Kernels {
        Kernels(const StereoConstants& c, const std::vector<Level>& levels, const Division& by,
                Device& device) {
            const auto radius = uint32_t(c.radius), refine_radius = uint32_t(c.refine_radius);
            prepare_left = device.kernel(shaders::stereo_prepare, {0, by.prepare_invocations});
            prepare_right = device.kernel(shaders::stereo_prepare, {1, by.prepare_invocations});
            if (device.wide()) {
                const uint32_t slots = wide_slots(c);
                search = device.kernel(shaders::stereo_search_wide,
                                       {radius, slots, slots * kWideSearchTile / kWideSearchRun});
            } else {
                left_statistics = device.kernel(shaders::stereo_statistics, {radius, 0});
                right_statistics = device.kernel(shaders::stereo_statistics, {radius, 1});
                search = device.kernel(shaders::stereo_search, {radius});
            }
            support = device.kernel(shaders::stereo_support,
                                    {by.tile_levels, by.support_run, by.support_invocations()});
            fill = device.kernel(shaders::stereo_fill,
                                 {uint32_t(all_pixels(levels, by.tile_levels)), by.tile_levels,
                                  by.fill_run, by.fill_invocations()});
            const Shader& refinement =
                device.wide() ? shaders::stereo_refine_wide : shaders::stereo_refine;
            refine_half = device.kernel(refinement, {radius, 1});
            refine = device.kernel(refinement, {refine_radius, 0});
            holes = device.kernel(shaders::stereo_holes,
                                  {uint32_t(c.fill_radius), by.holes_run, kTile / by.holes_run});
            for (uint32_t left = uint32_t(c.smooth_passes); left > 0;) {
                const uint32_t passes = std::min(left, kPassesAtOnce);
                left -= passes;
                smooth.push_back(device.kernel(shaders::stereo_smooth,
                                               {uint32_t(c.smooth_radius), uint32_t(c.smooth_range),
                                                passes, left == 0 ? 1u : 0u, by.smooth_run,
                                                by.smooth_result_run, by.smooth_invocations}));
            }
        }
        std::shared_ptr<const Kernel> prepare_left, prepare_right, left_statistics,
            right_statistics, search, support, fill, refine_half, refine, holes;
        std::vector<std::shared_ptr<const Kernel>> smooth;  // one after the other
    };

    // One of the two images with what is made of it before the search.
    struct Image {
        // windows: of which statistics are kept for the search
        Image(Device& device, uint64_t bytes, const StereoConstants& c, uint64_t windows)
            : words(device, bytes),
              half_columns(device, column_words(c.half_width, c.half_height)),
              half_mask(device, c.right_winners()),
              statistics(device, 8 * windows) {}
        Buffer words;         // of full resolution
        Buffer half_columns;  // of half resolution
        Buffer half_mask;     // of even rows
        Buffer statistics;
    };

    struct Run {
        Recorder& recorder;
        StereoPush push;
        const Buffer *left, *right, *left_mask, *right_mask;
    };

    // What a sub-stage left in `from`, if it is wanted.
    static void give(Run& run, const Buffer& from, const Buffer* to) {
        if (to != nullptr) run.recorder.copy(from, *to, from.size());
    }

    void prepare_images(Run& run, const Outputs& out) {
        const Groups full = tiles(c_.width, c_.height), half = tiles(c_.half_width, c_.half_height);
        StereoPush left_push = run.push;
        left_push.given.mask = run.push.given.left_mask;
        // Not the buffer that stands for none: both write that, as far as the layers can tell.
        const Buffer* left_mask = run.left_mask != nullptr ? run.left_mask : run.left;
        const Buffer* right_mask = run.right_mask != nullptr ? run.right_mask : run.right;
        run.recorder.dispatch(kernels_.prepare_left,
                              {run.left, left_mask, left_.words, left_.half_columns, nullptr,
                               left_.half_mask, out[kOutLeftGray], nullptr},
                              left_push, full);
        run.recorder.beside(kernels_.prepare_right,
                            {run.right, right_mask, right_.words, right_.half_columns,
                             right_half_rows_, right_.half_mask, out[kOutRightGray], right_keys_},
                            run.push, full);
        if (wide_) return;
        run.recorder.dispatch(kernels_.left_statistics,
                              {left_.half_columns, left_.statistics, left_.half_mask}, run.push,
                              half);
        run.recorder.beside(kernels_.right_statistics,
                            {right_.half_columns, right_.statistics, nullptr}, run.push, half);
    }

    // Leaves what is supported, the dense field and what stands.
    void search(Run& run, const Outputs& out) {
        const Groups samples = tiles(c_.half_samples_x, c_.half_samples_y, by_.tile(), by_.tile());
        if (wide_) {
            // Pixels from the first sample to the last that has a window.
            const int first_x = (c_.radius + c_.first + 1) / 2 * 2,
                      first_y = (c_.radius + 1) / 2 * 2,
                      width = c_.half_width - c_.radius - first_x,
                      height = c_.half_height - c_.radius - first_y;
            if (width > 0 && height > 0)
                run.recorder.dispatch(
                    kernels_.search,
                    {left_.half_columns, right_.half_columns, candidates_, right_keys_, left_keys_},
                    run.push, tiles(width, height, 2 * kWideSearchTile, 2 * kWideSearchRows));
        } else {
            run.recorder.dispatch(kernels_.search,
                                  {left_.half_columns, right_.half_columns, left_.statistics,
                                   right_.statistics, candidates_, right_keys_, left_keys_},
                                  run.push, tiles(c_.half_width, c_.half_height, kSearchTileWidth));
        }
        run.recorder.dispatch(kernels_.support,
                              {candidates_, right_keys_, left_.half_mask, right_.half_mask,
                               out[kOutChecked], supported_, pyramid_},
                              run.push, samples);
        run.recorder.dispatch(kernels_.fill, {pyramid_, supported_, dense_, standing_}, run.push,
                              samples);
        give(run, left_keys_, out[4]);
        give(run, right_keys_, out[5]);
        give(run, supported_, out[7]);
        give(run, dense_, out[8]);
    }

    void refine(Run& run, const Outputs& out) {
        run.recorder.dispatch(kernels_.refine_half,
                              {left_.half_columns, right_half_rows_, dense_, half_moved_, nullptr,
                               nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr},
                              run.push, refine_groups(c_.half_width, c_.half_height));
        run.recorder.dispatch(kernels_.refine,
                              {left_.words, right_.words, half_moved_, nullptr, run.left_mask,
                               run.right_mask, standing_, evidence_, out[kOutHalfRefined],
                               out[kOutHypothesis], out[kOutRefined], out[kOutScore]},
                              run.push, refine_groups(c_.width, c_.height));
    }
    Groups refine_groups(int width, int height) const {
        return wide_ ? tiles(width, height, 2 * kWideRefineWidth, 2 * kWideRefineHeight)
                     : tiles(width, height, kRefineTileWidth, kRefineTileHeight);
    }

    void finish(Run& run, const Outputs& out) {
        run.recorder.dispatch(kernels_.holes,
                              {evidence_, fields_[0], out[kOutConfidence], out[kOutEvidence]},
                              run.push, tiles(c_.samples_x, c_.samples_y));
        give(run, fields_[0], out[14]);
        const SmoothSize size{c_.samples_x, c_.samples_y, c_.width, c_.height, c_.stride};
        for (size_t i = 0; i < kernels_.smooth.size(); ++i)
            run.recorder.dispatch(
                kernels_.smooth[i],
                {fields_[i % 2], i + 1 == kernels_.smooth.size() ? *out[0] : fields_[1 - i % 2]},
                size, tiles(c_.samples_x, c_.samples_y, kSmoothTile, kSmoothTile));
    }

    StereoConstants c_;
    bool wide_;
    std::vector<Level> levels_;
    Division by_;
    Kernels kernels_;
    Image left_, right_;
    Buffer right_half_rows_;
    Buffer left_keys_, candidates_, right_keys_, supported_;
    Buffer pyramid_;  // the smoothed samples and coarser fields of them, all with their holes
    Buffer dense_, standing_, half_moved_;
    Buffer evidence_;   // shaders/stereo_evidence.glsl
    Buffer fields_[2];  // of samples that are smoothed
};

}  // namespace

std::unique_ptr<Stage> make_stereo(const defrec_stereo_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Stereo>(params, device);
}

}  // namespace defrec::vulkan
