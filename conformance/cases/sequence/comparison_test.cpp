// The comparisons of the sequence tier, on tracks made by hand, and that sequence is what it says.
#include "conformance/cases/sequence/comparison.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numeric>
#include <set>

#include "conformance/cases/sequence/sequence_list.hpp"
#include "conformance/worker/tolerances.hpp"

using namespace defrec::conformance;

namespace {

TrackedFrame frame_of(uint32_t state, std::vector<float> vertices) {
    TrackedFrame frame;
    frame.state = state;
    frame.epoch = 1;
    frame.vertex_status.assign(vertices.size() / 3, DEFREC_POINT_OBSERVED);
    frame.vertices = std::move(vertices);
    return frame;
}

Track two_frames() {
    Track track;
    track.rectification = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    track.camera = {100, 100, 16, 12, 5, 0};
    track.frames = {frame_of(DEFREC_TRACKING, {0, 0, 80, 1, 0, 80, 0, 1, 80}),
                    frame_of(DEFREC_TRACKING, {0, 0, 81, 1, 0, 81, 0, 1, 81})};
    return track;
}

RenderedSequence two_points() {
    RenderedSequence film{
        {"by hand", 32, 24, 2}, {}, {16, 12, 17, 12}, std::vector<FilmedFrame>(2)};
    for (FilmedFrame& frame : film.frames) {
        frame.left.assign(32 * 24 * 3, 90);
        frame.truth = {{{0, 0, 80}, true}, {{1, 0, 80}, true}};
    }
    return film;
}

}  // namespace

TEST_CASE("quantiles take a value that is there") {
    std::vector<double> values(200);
    std::iota(values.begin(), values.end(), 1.0);
    CHECK(quantile(values, 0.5) == 100);
    CHECK(quantile(values, 0.99) == 198);
    CHECK(quantile(values, 1) == 200);
    CHECK(quantile({7}, 0.5) == 7);
    CHECK(quantile({}, 0.5) == 0);
    CHECK(std::isnan(quantile({1, std::nan(""), 2}, 0.5)));
}

TEST_CASE(
    "errors to the truth: visible points alone, in the rectified camera, and lost ones counted") {
    RenderedSequence film = two_points();
    Track track = two_frames();
    track.on_surface = {1, 1};
    // The camera as given is turned by a quarter about z.
    track.rectification = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    for (TrackedFrame& frame : track.frames) {
        frame.points = {0, 0, 80.5, 0, 1.25, 80};
        frame.point_status = {DEFREC_POINT_OBSERVED, DEFREC_POINT_EXTRAPOLATED};
    }
    TruthErrors found = errors_to_truth(track, film);
    CHECK(found.errors == std::vector<double>{0.5, 0.25, 0.5, 0.25});
    CHECK(found.observed == std::vector<double>{0.5, 0.5});
    CHECK(found.lost == 0);
    film.frames[0].truth[0].visible = false;
    track.frames[1].state = DEFREC_LOST;
    found = errors_to_truth(track, film);
    CHECK(found.errors == std::vector<double>{0.25});
    CHECK(found.observed == std::vector<double>{0.5});
    CHECK(found.visible == 3);
    CHECK(found.lost == 2);
    track.on_surface[1] = 0;
    CHECK(errors_to_truth(track, film).lost_share() == 1);
}

TEST_CASE("states: lost or not and the epoch must be the same; other reasons are counted") {
    const Track expected = two_frames();
    Track found = expected;
    CHECK(state_difference(expected, found).other_state.empty());
    CHECK(state_difference(expected, found).other_reasons == 0);
    found.frames[1].state = DEFREC_DEGRADED;
    found.frames[1].reasons = DEFREC_REASON_LOW_CONTRAST;
    CHECK(state_difference(expected, found).other_state.empty());
    CHECK(state_difference(expected, found).other_reasons == 1);
    CHECK(state_difference(expected, found).reasons_message.find("frame 1 is degraded") == 0);
    CHECK(state_difference(expected, found).other_contradicted == 0);
    found.frames[1].reasons |= DEFREC_REASON_CONTRADICTED;
    CHECK(state_difference(expected, found).other_reasons == 1);
    CHECK(state_difference(expected, found).other_contradicted == 1);
    found = expected;
    found.frames[0].reasons ^= DEFREC_REASON_CONTRADICTED;
    CHECK(state_difference(expected, found).other_reasons == 0);
    CHECK(state_difference(expected, found).other_contradicted == 1);
    found.frames[1].state = DEFREC_LOST;
    CHECK(state_difference(expected, found).other_state.find("frame 1 is lost") == 0);
    found = expected;
    found.frames[0].epoch = 2;
    CHECK_FALSE(state_difference(expected, found).other_state.empty());
    found = expected;
    found.frames[0].vertices.resize(6);
    CHECK_FALSE(state_difference(expected, found).other_state.empty());
    found = expected;
    found.frames[1].template_epoch = 2;
    CHECK_FALSE(state_difference(expected, found).other_state.empty());
}

TEST_CASE("of a template that has grown the vertices of the first frame are compared") {
    Track expected = two_frames();
    expected.frames[1].vertices.resize(3 * 100);
    expected.frames[1].vertex_status.resize(100);
    Track found = expected;
    found.frames[1].vertices.resize(3 * 102, 7);
    found.frames[1].vertex_status.resize(102);
    CHECK(state_difference(expected, found).other_state.empty());
    CHECK(distance_between(expected, found).vertices == 6);
    CHECK(quantile(distance_between(expected, found).observed, 1) == 0);
    found.frames[1].vertices.resize(3 * 103);
    CHECK_FALSE(state_difference(expected, found).other_state.empty());
    found.frames[1].vertices.resize(9);  // it forgot to grow
    CHECK_FALSE(state_difference(expected, found).other_state.empty());
}

TEST_CASE(
    "distances: observed and extrapolated apart, unknown ones left out, other statuses counted") {
    const Track expected = two_frames();
    Track found = expected;
    found.frames[1].vertices[2] += 0.5f;
    found.frames[1].vertex_status[1] = DEFREC_POINT_EXTRAPOLATED;
    found.frames[1].vertex_status[2] = DEFREC_POINT_UNKNOWN;
    const TrackDistance apart = distance_between(expected, found);
    CHECK(quantile(apart.observed, 1) == doctest::Approx(0.5));
    CHECK(apart.observed.size() == 4);
    CHECK(apart.extrapolated.size() == 1);
    CHECK(apart.other_status == 2);
    CHECK(apart.vertices == 6);
    CHECK(apart.worst_frame == 1);
    found.frames[1].vertices[0] = std::nanf("");
    CHECK(std::isnan(quantile(distance_between(expected, found).observed, 0.5)));
}

TEST_CASE("the pictures show where two tracks part") {
    const Track expected = two_frames();
    Track found = expected;
    found.frames[0].vertices[2] += 3;
    const std::vector<Picture> pictures = distance_pictures(expected, found, two_points(), 0, 1);
    REQUIRE(pictures.size() == 3);
    const auto pixel = [&](size_t which, size_t x, size_t y) {
        return &pictures[which].pixels[3 * (y * 32 + x)];
    };
    for (const Picture& picture : pictures)
        CHECK(picture.pixels.size() == size_t{3} * picture.width * picture.height);
    CHECK(pixel(2, 15, 11)[0] > 200);  // the vertex that is off, red
    CHECK(pixel(2, 15, 11)[2] < 100);
    CHECK(pixel(2, 18, 13)[0] < 100);  // its neighbour, blue
    CHECK(pixel(2, 5, 5)[0] == 45);    // no vertex
}

TEST_CASE("sequence: rendered once, small as asked, with truth for every point") {
    const SequenceRequest request{"heartbeat", 192, 160, 4};
    const RenderedSequence& film = rendered_sequence(request);
    CHECK(&film == &rendered_sequence(request));
    REQUIRE(film.frames.size() == 4);
    CHECK(film.points.size() >= 2 * 50);
    for (const FilmedFrame& frame : film.frames) {
        CHECK(frame.left.size() == 192 * 160 * 3);
        CHECK(frame.truth.size() == film.points.size() / 2);
        CHECK(frame.left != frame.right);
    }
    CHECK(film.frames[0].left != film.frames[1].left);
}

TEST_CASE("the list has limits for each of its sequences, each once") {
    std::set<SequenceRequest> seen;
    for (const SequenceEntry& entry : sequence_list()) {
        CHECK(seen.insert(entry.sequence).second);
        const std::string size =
            std::to_string(entry.sequence.width) + "x" + std::to_string(entry.sequence.height);
        CHECK_NOTHROW(Tolerances::of_suite().at("sequence.error_" + (entry.hazy ? "hazy" : size)));
    }
}
