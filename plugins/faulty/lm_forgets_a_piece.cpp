// Only what is connected with the first control point is moved.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_lm_params> {
  public:
    Wrong(const Params& given, const Host& host)
        : Right(given, host), is_connected_(HostAllocator<uint8_t>(host)) {}
    void prepare(Inputs in) override {
        is_connected_.assign(params().nodes, 0);
        if (!is_connected_.empty()) is_connected_[0] = 1;
        const auto* edges = in[1].as<defrec_edge>();
        for (bool grows = true; grows;) {
            grows = false;
            for (uint32_t i = 0; i < params().edges; ++i) {
                uint8_t& a = is_connected_[static_cast<size_t>(edges[i].a)];
                uint8_t& b = is_connected_[static_cast<size_t>(edges[i].b)];
                grows |= a != b;
                a = b = a | b;
            }
        }
        Right::prepare(in);
    }
    void run(Inputs in, Outputs out) override {
        Right::run(in, out);
        const auto* start = in[0].as<defrec_motion>();
        auto* motions = out[0].as<defrec_motion>();
        for (size_t i = 0; i < is_connected_.size(); ++i)
            if (is_connected_[i] == 0) motions[i] = start[i];
    }

  private:
    HostVector<uint8_t> is_connected_;
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
