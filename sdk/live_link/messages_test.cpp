// What a receiver unpacks is what the frame was, to the last bit.
#include "sdk/live_link/messages.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "include/defrec_c.h"
#include "sdk/live_link/test_receiver.hpp"

#ifdef __SANITIZE_ADDRESS__
// OpenIGTLink 1.11 leaks what it allocates to unpack a POLYDATA, which only these tests do.
extern "C" __attribute__((visibility("default"))) const char* __lsan_default_suppressions() {
    return "leak:igtl_polydata_alloc_info\nleak:igtl_polydata_unpack\n";
}
#endif

using namespace defrec::cli;

namespace {

ReceivedFrame received(const std::string& bytes) { return FrameReader(from_text(bytes)).last(); }

const std::vector<std::string> kEverything{
    "STATUS TrackingState", "TRANSFORM TemplateToCamera", "POLYDATA SurfaceInCamera",
    "POINT PointsInCamera", "POINT TargetsInCamera",      "POLYDATA TargetErrorsInCamera"};
const std::vector<std::string> kStateAlone{"STATUS TrackingState"};
const std::vector<std::string> kWithoutSurface{"STATUS TrackingState", "TRANSFORM TemplateToCamera",
                                               "POINT PointsInCamera", "POINT TargetsInCamera",
                                               "POLYDATA TargetErrorsInCamera"};

// matrix: 3x3. covariance: xx, xy, xz, yy, yz, zz.
void check_covariance(const float* matrix, const float* covariance) {
    for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = row; column < 3; ++column, ++covariance) {
            CHECK(matrix[3 * row + column] == *covariance);
            CHECK(matrix[3 * column + row] == *covariance);
        }
}

void check_point(const ReceivedPoint& received, const LinkPoint& sent) {
    CHECK(received.name == std::to_string(sent.id));
    CHECK(received.group == sent.status);
    CHECK(received.radius == static_cast<float>(sent.expected_error_mm));
    for (std::size_t k = 0; k < 3; ++k) CHECK(received.xyz[k] == static_cast<float>(sent.xyz[k]));
}

}  // namespace

TEST_CASE("every message of a frame arrives, with header version 1 and the frame's values") {
    const LinkFrame sent = example_frame();
    const ReceivedFrame frame = received(pack_messages(sent));
    CHECK(frame.messages == kEverything);
    CHECK(frame.versions == std::vector<unsigned>(6, 1));
    CHECK(frame.code == igtl::StatusMessage::STATUS_OK);
    CHECK(frame.index == 7);
    CHECK(frame.state == "tracking");
    CHECK(frame.text == "reasons= epoch=2 vertices=4 points=2 targets=2");
    for (std::size_t i = 0; i < 12; ++i)
        CHECK(frame.matrix[i / 4][i % 4] == static_cast<float>(sent.rigid_motion[i]));
    for (std::size_t i = 0; i < 4; ++i) CHECK(frame.matrix[3][i] == (i == 3 ? 1.0F : 0.0F));
    CHECK(frame.vertices == sent.vertices);
    CHECK(frame.triangles == *sent.triangles);
    CHECK(frame.expected_error_mm == sent.expected_error_mm);
    CHECK(frame.status == std::vector<float>{0, 1, 2, 0});
    CHECK(frame.evidence == std::vector<float>{3, 1, 0, 2});
    REQUIRE(frame.covariance.size() == 4 * 9);
    for (std::size_t i = 0; i < 4; ++i)
        check_covariance(&frame.covariance[9 * i], &sent.vertex_covariance[6 * i]);
    REQUIRE(frame.points.size() == 2);
    for (std::size_t i = 0; i < 2; ++i) check_point(frame.points[i], sent.points[i]);
    REQUIRE(frame.targets.size() == 2);
    REQUIRE(frame.target_positions.size() == 2 * 3);
    REQUIRE(frame.target_error_mm.size() == 2);
    REQUIRE(frame.target_covariance.size() == 2 * 9);
    for (std::size_t i = 0; i < 2; ++i) {
        const LinkTarget& target = sent.targets[i];
        check_point(frame.targets[i], target);
        for (std::size_t k = 0; k < 3; ++k)
            CHECK(frame.target_positions[3 * i + k] == static_cast<float>(target.xyz[k]));
        CHECK(frame.target_error_mm[i] == static_cast<float>(target.expected_error_mm));
        check_covariance(&frame.target_covariance[9 * i], target.covariance.data());
    }
}

TEST_CASE("points have the colour of their status, and targets one of their own") {
    const ReceivedFrame frame = received(pack_messages(example_frame()));
    const auto colour = [](const ReceivedPoint& point) {
        return std::vector<int>(point.colour, point.colour + 4);
    };
    REQUIRE(frame.points.size() == 2);
    CHECK(frame.points[0].group == "tracked");
    CHECK(colour(frame.points[0]) == std::vector<int>{45, 212, 191, 255});
    CHECK(frame.points[1].group == "extrapolated");
    CHECK(colour(frame.points[1]) == std::vector<int>{251, 191, 36, 255});
    REQUIRE(frame.targets.size() == 2);
    for (const ReceivedPoint& target : frame.targets)
        CHECK(colour(target) == std::vector<int>{244, 114, 255, 255});
}

TEST_CASE("a damaged message is told by its checksum") {
    std::string bytes = pack_messages(example_frame());
    bytes[bytes.size() / 2] ^= 1;
    CHECK_THROWS_WITH(received(bytes), "a message is damaged");
}

TEST_CASE("without geometry to be trusted only the state is sent") {
    for (const auto& [state, name, code] :
         {std::tuple(DEFREC_LOST, "lost", igtl::StatusMessage::STATUS_NOT_FOUND),
          std::tuple(DEFREC_INITIALISING, "initialising", igtl::StatusMessage::STATUS_NOT_READY)}) {
        CAPTURE(name);
        LinkFrame sent = example_frame();  // the old geometry is there, and is not sent
        sent.has_geometry = false;
        sent.state = static_cast<std::uint32_t>(state);
        sent.reasons = DEFREC_REASON_DARK | DEFREC_REASON_FEW_MATCHES;
        const ReceivedFrame frame = received(pack_messages(sent));
        CHECK(frame.messages == kStateAlone);
        CHECK(frame.code == code);
        CHECK(frame.state == name);
        CHECK(frame.text == "reasons=dark|few-matches epoch=2 vertices=0 points=0 targets=0");
    }
}

TEST_CASE("states with geometry are OK, and say their name") {
    for (const auto& [state, name] :
         {std::tuple(DEFREC_TRACKING, "tracking"), std::tuple(DEFREC_DEGRADED, "degraded"),
          std::tuple(DEFREC_RELOCALISED, "relocalised")}) {
        LinkFrame sent = example_frame();
        sent.state = static_cast<std::uint32_t>(state);
        const ReceivedFrame frame = received(pack_messages(sent));
        CHECK(frame.code == igtl::StatusMessage::STATUS_OK);
        CHECK(frame.state == name);
        CHECK(frame.messages == kEverything);
    }
}

TEST_CASE("an empty or inconsistent surface is never sent") {
    const auto with_triangles = [](LinkFrame& frame, std::vector<std::uint32_t> triangles) {
        frame.triangles = std::make_shared<const std::vector<std::uint32_t>>(std::move(triangles));
    };
    const auto check = [](const auto& spoil) {
        LinkFrame frame = example_frame();
        spoil(frame);
        const ReceivedFrame got = received(pack_messages(frame));
        CHECK(got.messages == kWithoutSurface);
        CHECK(got.text == "reasons= epoch=2 vertices=0 points=2 targets=2");
    };
    check([](LinkFrame& frame) {
        frame.vertices.clear();
        frame.vertex_status.clear();
        frame.vertex_evidence.clear();
        frame.expected_error_mm.clear();
        frame.vertex_covariance.clear();
    });
    check([](LinkFrame& frame) { frame.triangles = nullptr; });
    check([&](LinkFrame& frame) { with_triangles(frame, {}); });
    check([&](LinkFrame& frame) { with_triangles(frame, {0, 1, 4}); });
    check([&](LinkFrame& frame) { with_triangles(frame, {0, 1, 2, 3}); });
    check([](LinkFrame& frame) { frame.vertices.pop_back(); });
    check([](LinkFrame& frame) { frame.vertex_status.push_back(0); });
    check([](LinkFrame& frame) { frame.expected_error_mm.pop_back(); });
    check([](LinkFrame& frame) { frame.vertex_evidence.pop_back(); });
    check([](LinkFrame& frame) { frame.vertex_covariance.pop_back(); });
    check([](LinkFrame& frame) { frame.vertex_covariance[3] = std::nanf(""); });
    check([](LinkFrame& frame) { frame.vertices[5] = std::numeric_limits<float>::quiet_NaN(); });
    check([](LinkFrame& frame) {
        frame.expected_error_mm[1] = std::numeric_limits<float>::infinity();
    });
}

TEST_CASE("a motion that is no number is not sent, nor lists of no points and targets") {
    LinkFrame sent = example_frame();
    sent.rigid_motion[3] = std::nan("");
    sent.points.clear();
    sent.targets.clear();
    CHECK(received(pack_messages(sent)).messages ==
          std::vector<std::string>{"STATUS TrackingState", "POLYDATA SurfaceInCamera"});
}

TEST_CASE("the left image, red first, also of a frame without geometry") {
    LinkFrame sent = example_frame();
    sent.has_geometry = false;
    const auto pixels = std::make_shared<const std::vector<std::uint8_t>>(
        std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6, 0, 0, 7, 8, 9, 10, 11, 12, 0, 0});
    sent.image = LinkImage{pixels->data(), 2, 2, 3, 8, pixels};
    ReceivedFrame frame = received(pack_messages(sent));
    CHECK(frame.messages == std::vector<std::string>{"STATUS TrackingState", "IMAGE LeftImage"});
    CHECK(frame.image_size[0] == 2);
    CHECK(frame.image_size[1] == 2);
    CHECK(frame.image_size[2] == 1);
    CHECK(frame.components == 3);
    CHECK(frame.pixels == std::vector<std::uint8_t>{3, 2, 1, 6, 5, 4, 9, 8, 7, 12, 11, 10});

    sent.has_geometry = true;
    sent.image->channels = 1;
    frame = received(pack_messages(sent));
    CHECK(frame.messages.size() == kEverything.size() + 1);
    CHECK(frame.components == 1);
    CHECK(frame.pixels == std::vector<std::uint8_t>{1, 2, 7, 8});
}

TEST_CASE("a plan: a POLYDATA of each part with its errors, targets, and how many there are") {
    LinkFrame sent = example_frame();
    sent.plan =
        LinkPlan{{{"organ", 0, {0, 0, 80, 9, 0, 80, 0, 9, 80}, {1, 2, 3}, {1, 1, 0}, {0, 1, 2}},
                  {"tum\xc3\xb6r with a long name",
                   3,
                   {0, 0, 90, 1, 0, 90, 0, 1, 90},
                   {0.5F, 0.5F, 0.25F},
                   {1, 1, 1},
                   {0, 2, 1}}},
                 {{5, "extrapolated", {1, 2, 90}, 0.75, ""},
                  {6, "extrapolated", {1, 2, 91}, 0.75, "tum\xc3\xb6r centre"},
                  {7, "extrapolated", {1, 2, 92}, 0.75, std::string(62, 'x') + "\xc3\xb6y"}}};
    const ReceivedFrame frame = received(pack_messages(sent));
    REQUIRE(frame.messages.size() == 9);
    CHECK(frame.messages[6] == "POLYDATA Plan0-organ");
    CHECK(frame.messages[7] == "POLYDATA Plan3-tum__r_with_a_");
    CHECK(frame.messages[8] == "POINT PlanTargetsInCamera");
    CHECK(frame.text ==
          "reasons= epoch=2 vertices=4 points=2 targets=2 parts=2 plan_targets=3 Plan0-organ "
          "Plan3-tum__r_with_a_");
    REQUIRE(frame.parts.size() == 2);
    CHECK(frame.parts[0].vertices == sent.plan->parts[0].vertices);
    CHECK(frame.parts[0].triangles == sent.plan->parts[0].triangles);
    CHECK(frame.parts[0].expected_error_mm == sent.plan->parts[0].expected_error_mm);
    CHECK(frame.parts[1].status == sent.plan->parts[1].status);
    REQUIRE(frame.plan_targets.size() == 3);
    check_point(frame.plan_targets[0], sent.plan->targets[0]);
    CHECK(frame.plan_targets[1].name == "tum\xc3\xb6r centre");
    // Cut before the letter that does not fit whole.
    CHECK(frame.plan_targets[2].name == std::string(62, 'x'));

    // No message comes of a part of which nothing is known, and the text says so.
    sent.plan = LinkPlan{};
    const ReceivedFrame lost = received(pack_messages(sent));
    CHECK(lost.messages == kEverything);
    CHECK(lost.text.ends_with(" parts=0 plan_targets=0"));
}

TEST_CASE("the frame's time to the nanosecond") {
    for (const std::int64_t time :
         {0LL, 1LL, 33'333'333LL, 999'999'999LL, 1'000'000'000LL, 1'760'000'000'123'456'789LL}) {
        LinkFrame sent = example_frame();
        sent.timestamp_ns = time;
        const ReceivedFrame frame = received(pack_messages(sent));
        CHECK(frame.seconds == time / 1'000'000'000);
        CHECK(std::llround(std::ldexp(static_cast<double>(frame.fraction), -32) * 1e9) ==
              time % 1'000'000'000);
    }
}
