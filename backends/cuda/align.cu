// Stage align: the live image's level, then a warp for each patch, from its prediction to its
// observation. docs/stages/align.md.
#include "backends/cuda/align_refine.cuh"
#include "backends/cuda/align_search.cuh"
#include "backends/cuda/halving.cuh"
#include "backends/cuda/stages.hpp"
#include "backends/shared/align_view.hpp"
#include "backends/stages/align.hpp"

namespace defrec::cuda {
namespace {

// ---- section 2 --------------------------------------------------------------

constexpr uint32_t kHalveWidth = 32, kHalveHeight = 8;

// The live image and its mask as the caller has them, and copies of both at the level.
struct Source {
    const uint8_t *gray, *mask;  // mask: may be nullptr
    int32_t stride;
};
struct Copies {
    uint8_t *gray, *mask;
    int32_t width, height, stride;  // beyond the width 0
};

template <int kLevel>
__global__ void __launch_bounds__(kHalveWidth* kHalveHeight) align_halve(Source from, Copies to) {
    const int32_t x = static_cast<int32_t>(blockIdx.x * kHalveWidth + threadIdx.x);
    const int32_t y = static_cast<int32_t>(blockIdx.y * kHalveHeight + threadIdx.y);
    if (x >= to.stride || y >= to.height) return;
    const int64_t at = int64_t{y} * to.stride + x;
    const bool in_image = x < to.width;
    to.gray[at] =
        in_image ? static_cast<uint8_t>(halved<kLevel, false>(from.gray, from.stride, x, y)) : 0;
    if (from.mask != nullptr)
        to.mask[at] =
            in_image ? static_cast<uint8_t>(halved<kLevel, true>(from.mask, from.stride, x, y)) : 0;
}

// ---- sections 1 and 3 to 6 --------------------------------------------------

// A patch's centre in its view, 1/256 px of the level.
struct alignas(16) Centre : AlignCentre {};

struct PatchTask {
    defrec_align_params params;
    int64_t min_spread;  // of a textured patch: n^2 texture^2
    Level level;
    const uint8_t* views;  // doubled
    const Centre* centres;
    const defrec_patch* patches;
    const defrec_patch_slope* slopes;
    AlignBuffers buffers;
};

template <int kRadius>
__device__ defrec_patch_observation observe(const PatchTask& task, const Centre& centre,
                                            const defrec_patch_prediction& prediction) {
    const defrec_align_params& params = task.params;
    if (!usable(prediction, params) || centre.valid == 0) return {};
    const int32_t search_radius = static_cast<int32_t>(params.search_radius),
                  margin = kRadius + search_radius + 1;
    const int32_t u = to_level(prediction.u, params.level),
                  v = to_level(prediction.v, params.level);
    const int2 predicted = make_int2((u + 128) >> 8, (v + 128) >> 8);
    const int2 fraction = make_int2(u - kPatchOne * predicted.x, v - kPatchOne * predicted.y);
    const auto window = load_window<kRadius>(
        task.level, make_int2(predicted.x - margin, predicted.y - margin), search_radius);
    const int32_t view_width = 2 * task.level.width, view_height = 2 * task.level.height;
    const auto patch = sample_view<kRadius>(
        task.views + int64_t{centre.view} * view_width * view_height, view_width, view_height,
        make_int2(centre.x, centre.y), prediction.view_from_live, fraction, task.min_spread);
    if (!patch.textured) return {};
    __syncwarp();
    const DisplacementSearch<kRadius> search(task.level, window, patch, predicted, search_radius);
    defrec_patch_observation observation{};
    if (int2 by; search.find(by)) {
        const int2 found = make_int2(predicted.x + by.x, predicted.y + by.y);
        if (task.level.inside(found, kRadius + 2))
            observation = refine(params, window, patch, found,
                                 make_int2(margin + by.x, margin + by.y), fraction);
    }
    if (observation.valid != 0 || params.keep_predicted == 0) return observation;
    return predicted_observation(prediction, search.predicted_score(), params);
}

// Every lane predicts: that is no more work for the warp than if one did, and needs no exchange.
template <int kRadius>
__global__ void __launch_bounds__(kWarp, 16) align_patch(PatchTask task) {
    const uint32_t index = blockIdx.x;
    const Centre centre = task.centres[index];
    const defrec_patch_prediction prediction =
        task.buffers.given != nullptr ? task.buffers.given[index]
                                      : predict<float>(task.patches[index], task.slopes[index],
                                                       task.buffers.motions, task.params);
    const defrec_patch_observation observation = observe<kRadius>(task, centre, prediction);
    if (threadIdx.x != 0) return;
    if (task.buffers.predictions != nullptr) task.buffers.predictions[index] = prediction;
    task.buffers.observations[index] = observation;
}

class Align final : public Stage {
  public:
    Align(const defrec_align_params& params, Device& device)
        : p_(bounded(params)), device_(device) {
        if (in_place()) return;
        gray_ = Buffer(device, uint64_t{stride()} * height());
        mask_ = Buffer(device, uint64_t{stride()} * height());
    }

    bool reentrant() const override { return in_place(); }
    void prepare(std::span<const InBuffer> in) override {
        const AlignTemplate given = read_template(p_, in);
        std::vector<Centre> centres;
        for (const defrec_patch& patch : given.patches)
            centres.push_back({centre_of(patch, p_.level)});
        std::vector<uint8_t> doubled;
        for (uint32_t i = 0; i < p_.views; ++i)
            add_view(p_, given.views + view_offset(p_, i), doubled);
        template_ = {upload(device_, doubled), upload(device_, centres),
                     upload(device_, std::vector(given.patches.begin(), given.patches.end())),
                     upload(device_, given.slopes), static_cast<uint32_t>(given.patches.size())};
    }

    void record(Recorder& recorder, std::span<const InBuffer> in,
                std::span<const OutBuffer> out) override {
        if (!template_.views) throw StageError(DEFREC_ERROR_STATE, "align: run before prepare");
        const AlignBuffers given = align_buffers(p_, template_.count, in, out);
        if (template_.count == 0) return;
        const int64_t side = 2 * int64_t{p_.patch_radius} + 1, pixels = side * side;
        const PatchTask task{.params = p_,
                             .min_spread = pixels * pixels * p_.texture * p_.texture,
                             .level = level_of(recorder, given),
                             .views = template_.views.as<uint8_t>(),
                             .centres = template_.centres.as<Centre>(),
                             .patches = template_.patches.as<defrec_patch>(),
                             .slopes = template_.slopes.as<defrec_patch_slope>(),
                             .buffers = given};
        switch (p_.patch_radius) {
            case 1:
                return launch<1>(recorder, task);
            case 2:
                return launch<2>(recorder, task);
            case 3:
                return launch<3>(recorder, task);
            case 4:
                return launch<4>(recorder, task);
            case 5:
                return launch<5>(recorder, task);
            case 6:
                return launch<6>(recorder, task);
            default:
                return launch<7>(recorder, task);
        }
    }

  private:
    uint32_t width() const { return p_.width >> p_.level; }
    uint32_t height() const { return p_.height >> p_.level; }
    uint32_t stride() const { return (width() + 3) / 4 * 4; }

    // Whether the caller's images can be searched as they are: rows of whole words, and nothing
    // between them.
    bool in_place() const { return p_.level == 0 && p_.stride == stride() && p_.width == stride(); }

    // The live image and the mask that are searched.
    Level level_of(Recorder& recorder, const AlignBuffers& given) const {
        const auto level = [&](const uint8_t* gray, const uint8_t* mask) {
            return Level{reinterpret_cast<const uint32_t*>(gray),
                         reinterpret_cast<const uint32_t*>(mask), static_cast<int32_t>(width()),
                         static_cast<int32_t>(height()), static_cast<int32_t>(stride() / 4)};
        };
        if (in_place()) return level(given.gray, given.mask);
        const Copies copies{gray_.as<uint8_t>(), mask_.as<uint8_t>(), static_cast<int32_t>(width()),
                            static_cast<int32_t>(height()), static_cast<int32_t>(stride())};
        constexpr decltype(&align_halve<0>) kKernels[] = {align_halve<0>, align_halve<1>,
                                                          align_halve<2>, align_halve<3>};
        const dim3 blocks(cover(stride(), kHalveWidth), cover(height(), kHalveHeight));
        const uint64_t size = uint64_t{p_.stride} * p_.height;
        recorder.early({range_of(given.gray, size), range_of(given.mask, size)}, [&] {
            recorder.launch(kKernels[p_.level], {blocks, dim3(kHalveWidth, kHalveHeight)},
                            Source{given.gray, given.mask, static_cast<int32_t>(p_.stride)},
                            copies);
        });
        return level(copies.gray, given.mask != nullptr ? copies.mask : nullptr);
    }
    template <int kRadius>
    void launch(Recorder& recorder, const PatchTask& task) const {
        const int32_t words = WindowSize<kRadius>(static_cast<int32_t>(p_.search_radius)).size();
        const size_t windows = task.level.mask != nullptr ? 2 : 1;
        recorder.launch(align_patch<kRadius>,
                        {dim3(template_.count), dim3(kWarp),
                         windows * static_cast<size_t>(words) * sizeof(uint32_t)},
                        task);
    }

    defrec_align_params p_;
    Device& device_;
    Buffer gray_, mask_;  // live image and mask at the level, unless in place
    struct {
        Buffer views, centres, patches, slopes;
        uint32_t count = 0;
    } template_;
};

}  // namespace

std::unique_ptr<Stage> make_align(const defrec_align_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Align>(params, device);
}

}  // namespace defrec::cuda
