// Stage match in shaders: both directions of the search side by side, in splits, then one match for
// each landmark. docs/stages/match.md.
#include "backends/stages/match.hpp"

#include <algorithm>
#include <vector>

#include "backends/vulkan/stages.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

struct MatchPush {
    MatchSizes sizes;
    MatchConstants constants;
};

constexpr uint32_t kGroup = 64;
// Columns of a split, at least: a wide device is bound by how long one takes.
constexpr uint32_t kMinSplit = 64, kMinWideSplit = 32;
constexpr uint32_t kMaxSplits =
    32;  // enough work groups for a large device, little to put together

uint32_t splits_of(uint32_t count, const Device& device) {
    return std::clamp(count / (device.wide() ? kMinWideSplit : kMinSplit), 1u, kMaxSplits);
}
Buffer keys(Device& device, uint32_t rows, uint32_t splits, uint32_t places) {
    return Buffer(device, sizeof(uint32_t) * places * splits * rows);
}

class Match final : public Stage {
  public:
    Match(const defrec_match_params& params, Device& device)
        : p_(params),
          device_(device),
          of_landmarks_(device.kernel(shaders::match_nearest, {1})),
          of_features_(device.kernel(shaders::match_nearest, {0})),
          accept_(device.kernel(shaders::match_accept)),
          feature_keys_(keys(device, params.landmarks, splits_of(params.features, device), 3)),
          landmark_keys_(keys(device, params.features, splits_of(params.landmarks, device), 1)) {}

    void prepare(std::span<const InBuffer> in) override {
        const auto landmarks = read_template(p_, in);
        landmarks_ = device_.upload(landmarks.data(), landmarks.size_bytes());
        landmark_count_ = static_cast<uint32_t>(landmarks.size());
    }

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        const std::vector<InBuffer> ins = sizes_of_inputs(in);
        view_buffers<MatchBuffers>(MatchBuffers::Sizes{p_, landmark_count_}, ins,
                                   sizes_of_outputs(out));
        const uint32_t features = room_for_features(p_, ins[1]);
        if (landmark_count_ == 0) return;
        const MatchSizes sizes{.landmarks = landmark_count_,
                               .features = features,
                               .feature_splits = splits_of(features, device_),
                               .landmark_splits = splits_of(landmark_count_, device_)};
        recorder.dispatch(of_landmarks_, {landmarks_, in[1], in[0], feature_keys_}, sizes,
                          {cover(sizes.landmarks, kGroup), sizes.feature_splits});
        if (features > 0)
            recorder.beside(of_features_, {landmarks_, in[1], in[0], landmark_keys_}, sizes,
                            {cover(sizes.features, kGroup), sizes.landmark_splits});
        const MatchPush push{sizes, constants_of(p_)};
        recorder.dispatch(accept_, {feature_keys_, landmark_keys_, in[1], in[2], out[0]}, push,
                          {cover(sizes.landmarks, kGroup)});
    }

  private:
    defrec_match_params p_;
    Device& device_;
    std::shared_ptr<const Kernel> of_landmarks_, of_features_, accept_;
    uint32_t landmark_count_ = 0;
    Buffer landmarks_, feature_keys_, landmark_keys_;
};

}  // namespace

std::unique_ptr<Stage> make_match(const defrec_match_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Match>(params, device);
}

}  // namespace defrec::vulkan
