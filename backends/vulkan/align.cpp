// Guided patch search in shaders: the live image's level and the predictions, then one work group
// for each patch. docs/stages/align.md.
#include "backends/stages/align.hpp"

#include <cmath>

#include "backends/definition/align_math.hpp"
#include "backends/shared/align_view.hpp"
#include "backends/vulkan/shaders/align_push.h"
#include "backends/vulkan/stages.hpp"
#include "sdk/contract/stage_params.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

struct PatchPush {
    AlignConstants constants;
    AlignRun run;
};

constexpr uint32_t kPredictGroup = 64;
constexpr uint32_t kMaxGroups = 65535;  // along one side, on every device

class Align final : public Stage {
  public:
    Align(const defrec_align_params& params, Device& device)
        : p_(bounded(params)), c_(constants_of(p_)), device_(device) {
        const uint64_t max_bytes =
            std::min(device.limits().maxStorageBufferRange, uint32_t{INT32_MAX});
        const uint64_t bytes =
            std::max<uint64_t>(uint64_t{4} * level_pixels() * params.views, gray_bytes(params));
        if (bytes > max_bytes)
            throw StageError(DEFREC_ERROR_UNSUPPORTED,
                             "align: an image or all views at twice their size take " +
                                 std::to_string(bytes) + " bytes, the device takes " +
                                 std::to_string(max_bytes));
        for (const bool mask : {false, true})
            if (params.level > 0) {
                halve_[mask] = device.kernel(shaders::align_halve, {params.level, mask});
                level_[mask] = Buffer(device, level_pixels());
            }
        check_size("align", "patches", params.patches,
                   uint64_t{device.limits().maxComputeWorkGroupCount[0]} * kPredictGroup);
        predict_ = device.kernel(shaders::align_predict);
        patch_ = device.kernel(shaders::align_patch, {params.patch_radius, params.search_radius});
        const uint32_t side = 2 * params.patch_radius + 1;
        std::vector<float> of_count{0, 0};  // 1 / n and sqrt(n) at n
        for (uint32_t n = 1; n <= side * side; ++n) {
            of_count.push_back(1.0f / float(n));
            of_count.push_back(std::sqrt(float(n)));
        }
        of_count_ = device.upload(of_count);
    }

    void prepare(std::span<const InBuffer> in) override {
        const AlignTemplate given = read_template(p_, in);
        std::vector<AlignCentre> centres;
        for (const defrec_patch& patch : given.patches)
            centres.push_back(align::centre_of(patch, p_.level));
        std::vector<uint8_t> doubled;
        for (uint32_t i = 0; i < p_.views; ++i)
            align::add_view(p_, given.views + view_offset(p_, i), doubled);
        Buffer uploaded_views = device_.upload(doubled);
        Buffer uploaded_patches = device_.upload(given.patches.data(), given.patches.size_bytes());
        Buffer uploaded_slopes = device_.upload(given.slopes);
        Buffer uploaded_centres = device_.upload(centres);
        predictions_ = Buffer(device_, given.patches.size() * sizeof(defrec_patch_prediction));
        views_ = std::move(uploaded_views);
        patches_ = std::move(uploaded_patches);
        slopes_ = std::move(uploaded_slopes);
        centres_ = std::move(uploaded_centres);
        count_ = uint32_t(given.patches.size());
    }

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        if (!views_) throw StageError(DEFREC_ERROR_STATE, "align: run before prepare");
        const AlignBuffers given =
            align_buffers(p_, count_, sizes_of_inputs(in), sizes_of_outputs(out));
        if (count_ == 0) return;
        const bool masked = given.mask != nullptr;
        const Buffer* predictions = given.predictions != nullptr ? out[1] : &predictions_;
        if (given.given != nullptr) predictions = in[3];
        const Buffer *gray = in[0], *mask = masked ? in[1] : nullptr;
        uint32_t stride = p_.stride;
        if (p_.level > 0) {
            const AlignLevelSize push{c_.width, c_.height, int32_t(p_.stride)};
            const Groups groups{cover(uint32_t(c_.width), 32), cover(uint32_t(c_.height), 4)};
            recorder.dispatch(halve_[0], {gray, level_[0]}, push, groups);
            if (masked) recorder.beside(halve_[1], {mask, level_[1]}, push, groups);
            gray = &level_[0];
            if (masked) mask = &level_[1];
            stride = uint32_t(c_.width);
        }
        const PatchPush push{
            c_, {.stride = int32_t(stride), .patches = int32_t(count_), .masked = masked}};
        if (given.given == nullptr) {
            const Groups groups{cover(count_, kPredictGroup)};
            if (p_.level > 0)
                recorder.beside(predict_, {patches_, slopes_, in[2], predictions}, push, groups);
            else
                recorder.dispatch(predict_, {patches_, slopes_, in[2], predictions}, push, groups);
        } else if (given.predictions != nullptr) {
            recorder.copy(*in[3], *out[1], count_ * sizeof(defrec_patch_prediction));
        }
        recorder.dispatch(patch_, {predictions, centres_, views_, gray, mask, of_count_, out[0]},
                          push, {std::min(count_, kMaxGroups), cover(count_, kMaxGroups)});
    }

  private:
    uint64_t level_pixels() const { return uint64_t(c_.width) * uint64_t(c_.height); }

    defrec_align_params p_;
    AlignConstants c_;
    Device& device_;
    std::shared_ptr<const Kernel> predict_, patch_, halve_[2];  // the second of two: of the mask
    Buffer level_[2];  // live image and mask at the level, where that is not 0
    Buffer of_count_, views_, patches_, slopes_, centres_, predictions_;
    uint32_t count_ = 0;
};

}  // namespace

std::unique_ptr<Stage> make_align(const defrec_align_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Align>(params, device);
}

}  // namespace defrec::vulkan
