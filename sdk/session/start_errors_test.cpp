// Expected errors after the start that allow for a late right view.
#include "sdk/session/start_errors.hpp"

#include <doctest/doctest.h>

#include "sdk/client/library.hpp"

using namespace defrec::cli;

namespace {

struct Frame {
    float expected_mm;
    std::uint32_t state = DEFREC_TRACKING, reasons = 0;
};

std::string note_of(const std::vector<Frame>& frames) {
    StartErrors errors;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        // Two observed vertices; the third is not, and says nothing.
        const std::uint8_t status[] = {DEFREC_POINT_OBSERVED, DEFREC_POINT_OBSERVED,
                                       DEFREC_POINT_EXTRAPOLATED};
        const float expected[] = {frames[i].expected_mm, frames[i].expected_mm, 50};
        auto result = defrec::cli::initialised<defrec_result>();
        result.state = frames[i].state;
        result.reasons = frames[i].reasons;
        result.vertex_count = 3;
        result.vertex_status = status;
        result.expected_error_mm = expected;
        errors.add(static_cast<std::int64_t>(i) + 10, result);
    }
    return errors.note();
}

}  // namespace

TEST_CASE("large expected errors after the start are named with their frames and why") {
    const std::string note = note_of({{0.1F}, {7.94F}, {2}, {0.1F}, {0.2F}});
    CHECK(note.find("up to frame 12, half of them 7.9 mm or more in frame 11: at the start") !=
          std::string::npos);
}

TEST_CASE("expected errors that are as large in every frame, or small, or explained, are no news") {
    CHECK(note_of({}) == "");
    CHECK(note_of({{3}, {3}, {2}}) == "");  // far tissue
    CHECK(note_of({{0.1F}, {0.9F}, {0.1F}}) == "");
    CHECK(note_of({{0.1F}, {8, DEFREC_TRACKING, DEFREC_REASON_VIEW_LATE}, {0.1F}}) == "");
    CHECK(note_of({{0.1F}, {8, DEFREC_DEGRADED, 0}, {0.1F}}) == "");
    std::vector<Frame> late(100, Frame{0.1F});
    late.back().expected_mm = 8;
    CHECK(note_of(late) == "");
}
