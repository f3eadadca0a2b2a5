// Stage ransac in shaders: all references side by side, then what they agree on.
// docs/stages/ransac.md.
#include "backends/stages/ransac.hpp"

#include <algorithm>
#include <bit>

#include "backends/vulkan/shaders/ransac_structs.h"
#include "backends/vulkan/stages.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

constexpr uint64_t kVectorBytes = 16;

constexpr uint32_t kLargestGroup = 512;
// Pairs that an invocation goes through: a GPU is bound by latency.
constexpr uint32_t kSoftwarePairs = 8, kGpuPairs = 2;
// lavapipe ends loops, those of one invocation together, after 65,535 rounds; the pairs may have
// these.
constexpr uint64_t kMaxRounds = 50000;

// Invocations that share the pairs of one reference: few where there are few, so that sums are
// short.
uint32_t group_size(uint32_t landmarks, const Device& device) {
    const uint32_t pairs = device.physical().software ? kSoftwarePairs : kGpuPairs;
    return std::bit_ceil(std::clamp(landmarks / pairs, 64u, kLargestGroup));
}

class Ransac final : public Stage {
  public:
    Ransac(const defrec_ransac_params& params, Device& device)
        : params_(bounded(params)),
          device_(device),
          gather_(device.kernel(shaders::ransac_gather)),
          follow_(device.kernel(shaders::ransac_follow, {group_size(params.landmarks, device)})),
          merge_(device.kernel(shaders::ransac_merge)),
          summary_(device.kernel(shaders::ransac_summary, {group_size(params.landmarks, device)})),
          from_(device, kVectorBytes * params.landmarks),
          to_(device, kVectorBytes * params.landmarks),
          pair_of_(device, sizeof(uint32_t) * params.landmarks),
          frame_(device, sizeof(RansacFrame)),
          hypotheses_(device, sizeof(RansacHypothesis) * params.references) {}

    void prepare(std::span<const InBuffer> in) override {
        const auto landmarks = read_template(params_, in);
        landmarks_ = device_.upload(landmarks.data(), landmarks.size_bytes());
        landmark_count_ = static_cast<uint32_t>(landmarks.size());
    }

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        if (!landmarks_) throw StageError(DEFREC_ERROR_STATE, "ransac: run before prepare");
        view_buffers<RansacBuffers>(landmark_count_, sizes_of_inputs(in), sizes_of_outputs(out));
        const RansacConstants push = constants_of(params_, landmark_count_);
        recorder.dispatch(gather_, {landmarks_, in[0], from_, to_, pair_of_, frame_}, push, {1});
        recorder.dispatch(follow_, {from_, to_, frame_, hypotheses_}, push, {params_.references});
        recorder.dispatch(merge_, {frame_, hypotheses_, from_, to_, pair_of_, in[0], out[0]}, push,
                          {cover(landmark_count_, 64)});
        recorder.dispatch(summary_, {frame_, hypotheses_, from_, to_, out[0], out[1]}, push, {1});
    }

  private:
    defrec_ransac_params params_;
    Device& device_;
    std::shared_ptr<const Kernel> gather_, follow_, merge_, summary_;
    uint32_t landmark_count_ = 0;
    Buffer landmarks_, from_, to_, pair_of_, frame_, hypotheses_;
};

}  // namespace

std::unique_ptr<Stage> make_ransac(const defrec_ransac_params& params, Device& device) {
    check_params(params);
    // The summary goes through the pairs ten times, whatever the iterations.
    const uint64_t rounds = std::max(params.iterations + 1, 10u);
    check_size("ransac", "landmarks with that many iterations", params.landmarks,
               kMaxRounds * kLargestGroup / rounds);
    return std::make_unique<Ransac>(params, device);
}

}  // namespace defrec::vulkan
