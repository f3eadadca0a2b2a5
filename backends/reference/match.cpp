// The stage match as plain code: docs/stages/match.md.
#include <bit>

#include "backends/definition/match_definition.hpp"
#include "backends/reference/stages.hpp"

namespace defrec::reference {
namespace {

int32_t hamming(const uint32_t* a, const uint32_t* b) {
    int32_t distance = 0;
    for (int word = 0; word < 8; ++word) distance += std::popcount(a[word] ^ b[word]);
    return distance;
}

class Match final : public Stage {
  public:
    Match(const defrec_match_params& params, const HostAllocator<uint32_t>& memory)
        : params_(params), landmarks_(memory), best_landmark_(params.features, memory) {
        landmarks_.reserve(params.landmarks);
    }

    void prepare(std::span<const InBuffer> in) override {
        const std::span<const defrec_landmark> given = read_template(params_, in);
        landmarks_.assign(given.begin(), given.end());
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        const auto b =
            view_buffers<MatchBuffers>(MatchBuffers::Sizes{params_, landmarks_.size()}, in, out);
        const match::Inputs inputs{live_features(params_, b, in), b.features, b.disparity};
        defrec_match* matches = b.matches;
        for (uint32_t f = 0; f < inputs.count; ++f)
            best_landmark_[f] = nearest_landmark(inputs.features[f]);
        for (size_t i = 0; i < landmarks_.size(); ++i) {
            const match::TwoBest best =
                match::choose(inputs, nearest_features(landmarks_[i], inputs));
            const bool accepted =
                match::accepts(params_, best) && best_landmark_[size_t(best.feature)] == i;
            matches[i] = match::lift<double>(params_, inputs, best, accepted);
        }
    }

  private:
    uint32_t nearest_landmark(const defrec_feature& feature) const {
        uint32_t nearest = 0;
        int32_t minimum = match::kNoDistance;
        for (uint32_t i = 0; i < landmarks_.size(); ++i) {
            const int32_t distance = hamming(feature.descriptor, landmarks_[i].descriptor);
            if (distance < minimum) minimum = distance, nearest = i;
        }
        return nearest;
    }
    static match::Nearest nearest_features(const defrec_landmark& landmark,
                                           const match::Inputs& inputs) {
        match::Nearest nearest;
        for (uint32_t f = 0; f < inputs.count; ++f) {
            const int32_t distance = hamming(landmark.descriptor, inputs.features[f].descriptor);
            int place = 3;
            for (; place > 0 && distance < nearest.distance[place - 1]; --place)
                if (place < 3) {
                    nearest.feature[place] = nearest.feature[place - 1];
                    nearest.distance[place] = nearest.distance[place - 1];
                }
            if (place < 3) {
                nearest.feature[place] = int32_t(f);
                nearest.distance[place] = distance;
            }
        }
        return nearest;
    }

    defrec_match_params params_;
    HostVector<defrec_landmark> landmarks_;
    HostVector<uint32_t> best_landmark_;  // of each live feature
};

}  // namespace

std::unique_ptr<Stage> make_match(const defrec_match_params& params, const Host& host) {
    check_params(params);
    return std::make_unique<Match>(params, HostAllocator<uint32_t>(host));
}

}  // namespace defrec::reference
