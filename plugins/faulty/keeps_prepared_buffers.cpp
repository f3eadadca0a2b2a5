// Match reads its landmarks in each run, from the buffer that prepare was given.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {
class Wrong final : public Right<defrec_match_params> {
  public:
    using Right::Right;
    void prepare(Inputs in) override {
        Right::prepare(in);
        landmarks_ = in[0];
    }
    void run(Inputs in, Outputs out) override {
        if (landmarks_.data != nullptr) Right::prepare({&landmarks_, 1});
        Right::run(in, out);
    }

  private:
    InBuffer landmarks_;
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
