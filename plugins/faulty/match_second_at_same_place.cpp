// The second best feature counts even where it is the best one's own corner on another level.
#include <algorithm>
#include <bit>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_match_params> {
  public:
    Wrong(const Params& given, const Host& host)
        : Right(given, host), landmarks_(HostAllocator<defrec_landmark>(host)) {
        landmarks_.reserve(given.landmarks);
    }
    void prepare(Inputs in) override {
        Right::prepare(in);
        const auto* first = in[0].as<defrec_landmark>();
        landmarks_.assign(first,
                          first + std::min<size_t>(params().landmarks, in[0].size / sizeof *first));
    }
    void run(Inputs in, Outputs out) override {
        Right::run(in, out);
        const uint32_t count = std::min(*in[0].as<uint32_t>(), params().features);
        for (size_t i = 0; i < landmarks_.size(); ++i) {
            defrec_match& match = out[0].as<defrec_match>()[i];
            match.second = second_distance(landmarks_[i], in[1].as<defrec_feature>(), count);
            const int32_t second = count < 2 ? 257 : match.second;
            if (match.feature >= 0 && 256 * match.distance > int32_t(params().ratio) * second)
                match = {.feature = -1,
                         .distance = match.distance,
                         .second = match.second,
                         .u = 0,
                         .v = 0,
                         .position = {},
                         .weight = 0,
                         .reserved = 0};
        }
    }

  private:
    static int32_t second_distance(const defrec_landmark& landmark, const defrec_feature* features,
                                   uint32_t count) {
        int32_t best = 256, second = 256;
        for (uint32_t f = 0; f < count; ++f) {
            int32_t distance = 0;
            for (int word = 0; word < 8; ++word)
                distance += std::popcount(landmark.descriptor[word] ^ features[f].descriptor[word]);
            second = std::min(second, std::max(best, distance));
            best = std::min(best, distance);
        }
        return second;
    }

    HostVector<defrec_landmark> landmarks_;
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
