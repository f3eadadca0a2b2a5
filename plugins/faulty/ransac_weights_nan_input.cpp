// A match whose position is not a number keeps a weight that is none either, instead of taking no
// part.
#include <cmath>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_ransac_params> {
  public:
    using Right::Right;
    void run(Inputs in, Outputs out) override {
        Right::run(in, out);
        auto* matches = out[0].as<defrec_match>();
        for (size_t i = 0; i < in[0].size / sizeof *matches; ++i)
            for (const float x : matches[i].position)
                if (std::isnan(x)) matches[i].weight = x;
    }
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
