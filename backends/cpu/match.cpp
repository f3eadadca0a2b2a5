// The stage match on a CPU: every landmark against every live feature, both directions at once,
// then the tests and lifting to 3D.
#include <algorithm>
#include <cstring>

#include "backends/cpu/match_kernels.hpp"
#include "backends/cpu/stages.hpp"
#include "backends/definition/match_definition.hpp"

namespace defrec::cpu {
namespace {

constexpr uint32_t kLiftedAtOnce = 64;  // landmarks

class Match final : public Stage {
  public:
    Match(const defrec_match_params& params, const Host& host,
          const HostAllocator<uint32_t>& memory)
        : params_(params),
          host_(host),
          blocks_(2 * host.concurrency()),
          members_((params.features + kMatchGroup - 1) / kMatchGroup * kMatchGroup),
          landmarks_(params.landmarks, memory),
          groups_(members_ / kMatchGroup, memory),
          index_(members_, memory),
          best_(params.landmarks, memory),
          nearest_(blocks_ * members_, memory) {}

    void prepare(std::span<const InBuffer> in) override {
        const std::span<const defrec_landmark> given = read_template(params_, in);
        count_ = uint32_t(given.size());
        for (size_t i = 0; i < given.size(); ++i)
            std::memcpy(landmarks_[i].data(), given[i].descriptor, sizeof landmarks_[i]);
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        const auto given =
            view_buffers<MatchBuffers>(MatchBuffers::Sizes{params_, count_}, in, out);
        const match::Inputs inputs{live_features(params_, given, in), given.features,
                                   given.disparity};
        defrec_match* matches = given.matches;
        const size_t groups = (inputs.count + kMatchGroup - 1) / kMatchGroup;
        arrange(inputs, groups);
        host_.parallel_for(blocks_, [&](size_t b) { compare(b, groups); });
        for (size_t b = 1; b < blocks_; ++b)
            for (size_t f = 0; f < inputs.count; ++f)
                nearest_[f] = std::min(nearest_[f], nearest_[b * members_ + f]);
        host_.parallel_for((count_ + kLiftedAtOnce - 1) / kLiftedAtOnce, [&](size_t task) {
            const uint32_t first = uint32_t(task) * kLiftedAtOnce;
            for (uint32_t i = first; i < std::min(count_, first + kLiftedAtOnce); ++i) {
                const match::TwoBest best = match::choose(inputs, nearest_features(i));
                const bool accepted =
                    match::accepts(params_, best) && (nearest_[size_t(best.feature)] & 0xffff) == i;
                matches[i] = match::lift<float>(params_, inputs, best, accepted);
            }
        });
    }

  private:
    match::Nearest nearest_features(uint32_t landmark) const {
        match::Nearest nearest;
        for (size_t place = 0; place < 3; ++place) {
            const uint32_t key = best_[landmark][place];
            if (key == kNoKey) break;
            nearest.feature[place] = int32_t(key & 0xffff);
            nearest.distance[place] = int32_t(key >> 16);
        }
        return nearest;
    }
    void arrange(const match::Inputs& inputs, size_t groups) {
        for (uint32_t f = 0; f < groups * kMatchGroup; ++f) {
            const bool there = f < inputs.count;
            MatchDescriptor words{};
            if (there) std::memcpy(words.data(), inputs.features[f].descriptor, sizeof words);
            const size_t member = f % kMatchGroup;
            for (size_t w = 0; w < 4; ++w)
                groups_[f / kMatchGroup].word[w][member % 2][member / 2] = words[w];
            index_[f] = there ? f : kNoKey;
        }
    }
    void compare(size_t b, size_t groups) {
        uint32_t* nearest = &nearest_[b * members_];
        std::fill_n(nearest, groups * kMatchGroup, kNoKey);
        const auto border = [&](size_t k) { return uint32_t(k * count_ / blocks_); };
        match_block({landmarks_.data(), border(b), border(b + 1), groups_.data(), groups,
                     index_.data(), best_.data(), nearest});
    }

    defrec_match_params params_;
    Host host_;
    size_t blocks_;   // of landmarks
    size_t members_;  // of all groups
    uint32_t count_ = 0;
    HostVector<MatchDescriptor> landmarks_;
    HostVector<MatchGroup> groups_;
    HostVector<uint32_t> index_;
    HostVector<MatchKeys> best_;
    HostVector<uint32_t> nearest_;  // members_ for each block
};

}  // namespace

std::unique_ptr<Stage> make_match(const defrec_match_params& params, const Host& host) {
    check_params(params);
    return std::make_unique<Match>(params, host, HostAllocator<uint32_t>(host));
}

}  // namespace defrec::cpu
