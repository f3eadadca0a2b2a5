// The weight of the matches at each control point is added up by several threads with float atomics, in whatever order they
// come, and each match is scaled by what rounding made of it: right to single precision, and never twice the same.
#include <atomic>
#include <barrier>
#include <thread>
#include <vector>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {

constexpr size_t kThreads = 4;

class Wrong final : public Right<defrec_lm_params> {
  public:
    using Right::Right;
    void prepare(Inputs in) override {
        Right::prepare(in);
        const auto* first = in[3].as<defrec_surface_point>();
        landmarks_.assign(first, first + params().landmarks);
    }
    void run(Inputs in, Outputs out) override {
        ChangedInputs changed(in);
        if (in.size() > 1 && in[1].data != nullptr) {
            const auto* given = in[1].as<defrec_match>();
            matches_.assign(given, given + landmarks_.size());
            scale();
            changed[1].data = matches_.data();
        }
        Right::run(changed, out);
    }

  private:
    void scale() {
        std::vector<std::atomic<float>> racing(params().nodes);
        std::barrier start(kThreads);
        std::vector<std::thread> threads;
        for (size_t t = 0; t < kThreads; ++t)
            threads.emplace_back([&, t] {
                start.arrive_and_wait();
                for (size_t i = t; i < landmarks_.size(); i += kThreads) {
                    add(i, [&](size_t node, float value) { racing[node].fetch_add(value); });
                    std::this_thread::yield();
                }
            });
        for (std::thread& thread : threads) thread.join();

        std::vector<double> exact(params().nodes);
        for (size_t i = 0; i < landmarks_.size(); ++i)
            add(i, [&](size_t node, float value) { exact[node] += double(value); });
        for (size_t i = 0; i < landmarks_.size(); ++i) {
            const auto node = size_t(landmarks_[i].node[0]);
            if (exact[node] > 0) matches_[i].weight *= float(double(racing[node]) / exact[node]);
        }
    }
    template <class Add>
    void add(size_t landmark, Add&& add_to) const {
        for (int k = 0; k < DEFREC_SKIN_NODES; ++k)
            add_to(size_t(landmarks_[landmark].node[k]), matches_[landmark].weight * landmarks_[landmark].weight[k]);
    }

    std::vector<defrec_surface_point> landmarks_;
    std::vector<defrec_match> matches_;
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
