// The last of equally near features is taken: the right stage is given them in reverse order.
#include <algorithm>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_match_params> {
  public:
    Wrong(const Params& given, const Host& host)
        : Right(given, host), reversed_(given.features, HostAllocator<defrec_feature>(host)) {}
    void run(Inputs in, Outputs out) override {
        const uint32_t count = std::min(*in[0].as<uint32_t>(), params().features);
        const auto* features = in[1].as<defrec_feature>();
        std::reverse_copy(features, features + count, reversed_.begin());
        ChangedInputs changed(in);
        changed[1] = {reversed_.data(), in[1].size};
        Right::run(changed, out);
        auto* matches = out[0].as<defrec_match>();
        for (size_t i = 0; i < landmarks_; ++i)
            if (matches[i].feature >= 0)
                matches[i].feature = int32_t(count) - 1 - matches[i].feature;
    }
    void prepare(Inputs in) override {
        Right::prepare(in);
        landmarks_ = std::min<size_t>(params().landmarks, in[0].size / sizeof(defrec_landmark));
    }

  private:
    HostVector<defrec_feature> reversed_;
    size_t landmarks_ = 0;
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
