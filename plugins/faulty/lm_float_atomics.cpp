// The weight of the matches at each control point is added up by several threads with float
// atomics, in whatever order they come, and each match is scaled by what rounding made of it: right
// to single precision, and never twice the same.
#include <atomic>
#include <barrier>
#include <chrono>
#include <thread>
#include <vector>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
namespace {

constexpr size_t kThreads = 8;

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
        std::barrier together(kThreads);
        std::vector<std::thread> threads;
        for (size_t t = 0; t < kThreads; ++t)
            threads.emplace_back([&, t] {
                for (size_t first = 0; first < landmarks_.size(); first += kThreads) {
                    together.arrive_and_wait();  // or the first thread would be done before the
                                                 // last begins
                    // Idle cores would race less than a device does.
                    for (auto turns =
                             std::chrono::steady_clock::now().time_since_epoch().count() % 7;
                         turns > 0; --turns)
                        std::this_thread::yield();
                    if (first + t < landmarks_.size())
                        add(first + t,
                            [&](size_t node, float value) { racing[node].fetch_add(value); });
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
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
            add_to(size_t(landmarks_[landmark].node[k]),
                   matches_[landmark].weight * landmarks_[landmark].weight[k]);
    }

    std::vector<defrec_surface_point> landmarks_;
    std::vector<defrec_match> matches_;
};
}  // namespace
const Fault fault = in_stage<Wrong>();
}  // namespace defrec::faulty
