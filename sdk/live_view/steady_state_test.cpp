#include "sdk/live_view/steady_state.hpp"

#include <doctest/doctest.h>

#include <vector>

using defrec::cli::OutageLimit;
using defrec::cli::SteadyState;

namespace {

constexpr double kFrameMs = 66;

// States of one frame after the other, kFrameMs apart.
class Run {
  public:
    std::string take(const std::string& said, bool is_unseen = false,
                     const std::string& found = {}) {
        return state_.take(said, found, ms_ += kFrameMs, is_unseen);
    }
    // All that was shown in so many frames.
    std::vector<std::string> take(const std::string& said, int frames) {
        std::vector<std::string> shown;
        for (int i = 0; i < frames; ++i) {
            const std::string now = take(said);
            if (shown.empty() || shown.back() != now) shown.push_back(now);
        }
        return shown;
    }
    void wait(double ms) { ms_ += ms; }
    const SteadyState& state() const { return state_; }

  private:
    SteadyState state_;
    double ms_ = 0;
};

using Shown = std::vector<std::string>;

}  // namespace

TEST_CASE("frames that are less sure once a heartbeat turn the view amber once, until they end") {
    Run run;
    run.take("tracking", 15);
    int changes = 0;
    std::string last = "tracking";
    for (int frame = 0; frame < 255; ++frame) {  // 17 s
        const std::string now = run.take(frame % 9 < 2 ? "degraded" : "tracking");
        changes += now != last;
        last = now;
    }
    CHECK(changes == 1);
    CHECK(last == "degraded");
    CHECK(run.state().is_held());
    CHECK(run.take("tracking", 30) == Shown{"degraded", "tracking"});
    CHECK_FALSE(run.state().is_held());
}

TEST_CASE("a single frame that is less sure leaves the state") {
    Run run;
    run.take("tracking", 15);
    CHECK(run.take("degraded") == "tracking");
    CHECK(run.take("tracking", 20) == Shown{"tracking"});
    CHECK(run.take("degraded", 7) == Shown{"tracking"});
    CHECK(run.take("degraded") == "degraded");
}

TEST_CASE("what is worse than less sure comes and goes at once") {
    Run run;
    run.take("tracking", 15);
    CHECK(run.take("lost") == "lost");
    CHECK(run.take("degraded") == "degraded");  // no better than the frame
    CHECK(run.take("unusable") == "unusable");
    CHECK(run.take("tracking") == "tracking");
    CHECK(run.take("degraded", true) == "degraded");  // nothing is seen
    CHECK(run.take("initialising") == "initialising");
}

TEST_CASE("found again is not cut up by single frames that are less sure") {
    Run run;
    run.take("tracking", 15);
    run.take("lost");
    for (int frame = 0; frame < 20; ++frame)
        CHECK(run.take(frame % 9 == 3 ? "degraded" : "relocalised", false, "relocalised") ==
              "relocalised");
    CHECK_FALSE(run.state().is_resumed());
}

TEST_CASE("pictures that come again after an outage are of tissue that is found again") {
    Run run;
    run.take("tracking", 15);
    run.wait(4000);
    CHECK(run.take("tracking") == "relocalised");
    CHECK(run.state().gap_ms() == 4000 + kFrameMs);
    CHECK(run.state().is_resumed());
    CHECK(run.take("tracking") == "relocalised");
    CHECK(run.state().gap_ms() == 0);
    CHECK(run.take("tracking", 80) == Shown{"relocalised", "tracking"});
    CHECK_FALSE(run.state().is_resumed());
    // Or after a video that stood still.
    CHECK(run.take("stalled", 10) == Shown{"stalled"});
    CHECK(run.take("tracking", 80) == Shown{"relocalised", "tracking"});
    run.wait(4000);
    CHECK(run.take("lost") == "lost");
    CHECK(run.take("tracking") == "tracking");
}

TEST_CASE("a slow source has not stopped between two of its pictures") {
    OutageLimit limit;
    CHECK(limit.ms() == OutageLimit::kFirstMs);
    for (int i = 0; i < 9; ++i) limit.add(33);
    CHECK(limit.ms() == OutageLimit::kLeastMs);
    limit.add(5000);  // one late frame is no slow source
    CHECK(limit.ms() == OutageLimit::kLeastMs);
    for (int i = 0; i < 9; ++i) limit.add(1000);
    CHECK(limit.ms() == 3000);
}

TEST_CASE("a recording that begins again had no outage") {
    SteadyState state;
    for (int i = 0; i < 9; ++i) state.take("tracking", "", 5000 + 33 * i, false);
    CHECK(state.take("tracking", "", 0, false) == "tracking");
    CHECK(state.gap_ms() == 0);
}
