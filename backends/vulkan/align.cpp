// Guided patch search in shaders: the live image's level and the predictions, then one work group
// for each patch. docs/stages/align.md.
#include <cmath>

#include "backends/shared/align_buffers.hpp"
#include "backends/shared/align_math.hpp"
#include "backends/shared/align_view.hpp"
#include "backends/vulkan/stages.hpp"
#include "sdk/contract/stage_params.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

struct HalvePush {
    int32_t width, height, stride;
};
struct PredictPush {
    float fx, fy, cx, cy;
    float last_x, last_y, margin;
    int32_t patches;
};
struct PatchPush {
    int32_t width, height, stride;
    int32_t last_u, last_v;
    int32_t view_width, view_height;
    int32_t level, patches;
    uint32_t texture;
    int32_t min_score;
    int32_t masked;
};
struct Centre {
    int32_t x, y, view, valid;
};

constexpr uint32_t kPredictGroup = 64;
constexpr uint32_t kMaxGroups = 65535;  // along one side, on every device

class Align final : public Stage {
  public:
    Align(const defrec_align_params& params, Device& device) : p_(params), device_(device) {
        check_params(params);
        const uint64_t max_bytes =
            std::min(device.limits().maxStorageBufferRange, uint32_t{INT32_MAX});
        const uint64_t bytes =
            std::max<uint64_t>(uint64_t{4} * width() * height() * params.views, gray_size(params));
        if (bytes > max_bytes)
            throw StageError(DEFREC_ERROR_UNSUPPORTED,
                             "align: an image or all views at twice their size take " +
                                 std::to_string(bytes) + " bytes, the device takes " +
                                 std::to_string(max_bytes));
        for (const bool mask : {false, true})
            if (params.level > 0) {
                halve_[mask] = device.kernel(shaders::align_halve, {params.level, mask});
                level_[mask] = Buffer(device, uint64_t{width()} * height());
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
        expect_buffers("align: prepare", in, 2);
        const std::span<const defrec_patch> patches = take_patches(p_, in[0]);
        const auto* views =
            take<uint8_t>("align: views", in[1], view_offset(p_, p_.views - 1) + gray_size(p_));
        std::vector<Centre> centres;
        for (const defrec_patch& patch : patches) {
            Centre centre{0, 0, patch.view, 0};
            centre.valid = align::to_fixed(patch.u, centre.x) && align::to_fixed(patch.v, centre.y);
            centre.x = align::to_level(centre.x, p_.level);
            centre.y = align::to_level(centre.y, p_.level);
            centres.push_back(centre);
        }
        std::vector<uint8_t> doubled;
        for (uint32_t i = 0; i < p_.views; ++i)
            align::add_view(p_, views + view_offset(p_, i), doubled);
        Buffer uploaded_views = device_.upload(doubled);
        Buffer uploaded_patches = device_.upload(patches.data(), patches.size_bytes());
        Buffer uploaded_centres = device_.upload(centres);
        predictions_ = Buffer(device_, patches.size() * sizeof(defrec_patch_prediction));
        views_ = std::move(uploaded_views);
        patches_ = std::move(uploaded_patches);
        centres_ = std::move(uploaded_centres);
        count_ = uint32_t(patches.size());
    }

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        if (!views_) throw StageError(DEFREC_ERROR_STATE, "align: run before prepare");
        const AlignBuffers given =
            take_buffers(p_, count_, sizes_of_inputs(in), sizes_of_outputs(out));
        if (count_ == 0) return;
        const bool masked = given.mask != nullptr;
        const Buffer* predictions = given.predictions != nullptr ? out[1] : &predictions_;
        if (given.given != nullptr) predictions = in[3];
        const Buffer *gray = in[0], *mask = masked ? in[1] : nullptr;
        uint32_t stride = p_.stride;
        if (p_.level > 0) {
            const HalvePush push{int32_t(width()), int32_t(height()), int32_t(p_.stride)};
            const Groups groups{cover(width(), 32), cover(height(), 4)};
            recorder.dispatch(halve_[0], {gray, level_[0]}, push, groups);
            if (masked) recorder.beside(halve_[1], {mask, level_[1]}, push, groups);
            gray = &level_[0];
            if (masked) mask = &level_[1];
            stride = width();
        }
        if (given.given == nullptr) {
            const PredictPush push{float(p_.camera.fx),
                                   float(p_.camera.fy),
                                   float(p_.camera.cx),
                                   float(p_.camera.cy),
                                   float(p_.width - 1),
                                   float(p_.height - 1),
                                   float((p_.patch_radius + 2) << p_.level),
                                   int32_t(count_)};
            const Groups groups{cover(count_, kPredictGroup)};
            if (p_.level > 0)
                recorder.beside(predict_, {patches_, in[2], predictions}, push, groups);
            else
                recorder.dispatch(predict_, {patches_, in[2], predictions}, push, groups);
        } else if (given.predictions != nullptr) {
            recorder.copy(*in[3], *out[1], count_ * sizeof(defrec_patch_prediction));
        }
        const PatchPush push{int32_t(width()),
                             int32_t(height()),
                             int32_t(stride),
                             int32_t(p_.width - 1) * 256,
                             int32_t(p_.height - 1) * 256,
                             int32_t(2 * width()),
                             int32_t(2 * height()),
                             int32_t(p_.level),
                             int32_t(count_),
                             p_.texture,
                             int32_t(p_.min_score),
                             masked};
        recorder.dispatch(patch_, {predictions, centres_, views_, gray, mask, of_count_, out[0]},
                          push, {std::min(count_, kMaxGroups), cover(count_, kMaxGroups)});
    }

  private:
    uint32_t width() const { return p_.width >> p_.level; }
    uint32_t height() const { return p_.height >> p_.level; }

    defrec_align_params p_;
    Device& device_;
    std::shared_ptr<const Kernel> predict_, patch_, halve_[2];  // the second of two: of the mask
    Buffer level_[2];  // live image and mask at the level, where that is not 0
    Buffer of_count_, views_, patches_, centres_, predictions_;
    uint32_t count_ = 0;
};

}  // namespace

std::unique_ptr<Stage> make_align(const defrec_align_params& params, Device& device) {
    return std::make_unique<Align>(params, device);
}

}  // namespace defrec::vulkan
