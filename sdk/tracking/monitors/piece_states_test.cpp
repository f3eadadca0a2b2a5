#include "sdk/tracking/monitors/piece_states.hpp"

#include <doctest/doctest.h>

using namespace defrec;

namespace {

// Evidence of a piece whose vertices all lie in the image, where so many patches of 100 are
// confirmed and so much of it has depth that agrees.
PieceEvidence seen(uint32_t confirmed, double measured = 0.9) {
    PieceEvidence evidence;
    evidence.vertices = evidence.vertices_inside = 1000;
    evidence.vertices_measured = static_cast<uint32_t>(1000 * measured);
    evidence.patches_expected = 100;
    evidence.patches_confirmed = confirmed;
    return evidence;
}

PieceEvidence out_of_view() {
    PieceEvidence evidence;
    evidence.vertices = 1000;
    return evidence;
}

PieceStates two_pieces(bool are_found) {
    PieceStates states;
    states.reset(2, are_found);
    return states;
}

}  // namespace

TEST_CASE("each piece is lost and found again by its own evidence") {
    PieceStates states = two_pieces(true);
    const auto end_frame = [&](const PieceEvidence& first, const PieceEvidence& second) {
        CHECK(states.shows_any({first, second}, true));
        states.end_frame(DEFREC_TRACKING, {first, second}, true);
    };
    end_frame(seen(80), seen(70));
    CHECK(states.pieces().size() == 2);
    CHECK(states.pieces()[0].state == DEFREC_TRACKING);
    CHECK(states.pieces()[1].state == DEFREC_TRACKING);
    CHECK(states.pieces()[1].patches == 70);
    CHECK(states.pieces()[1].vertices_inside == 1000);
    CHECK(!states.misses_one());

    end_frame(seen(80), seen(30));
    CHECK(states.pieces()[1].state == DEFREC_DEGRADED);

    for (const uint32_t age : {1u, 2u}) {
        end_frame(seen(80), seen(2));
        CHECK(states.pieces()[0].state == DEFREC_TRACKING);
        CHECK(states.pieces()[1].state == DEFREC_LOST);
        CHECK(states.pieces()[1].age == age);
        CHECK(states.misses_one());
    }
    // To be found again takes more than to be followed.
    end_frame(seen(80), seen(9));
    CHECK(states.pieces()[1].state == DEFREC_LOST);
    end_frame(seen(80), seen(20));
    CHECK(states.pieces()[1].state == DEFREC_RELOCALISED);
    CHECK(states.pieces()[1].age == 0);
    end_frame(seen(80), seen(9));
    CHECK(states.pieces()[1].state == DEFREC_DEGRADED);
}

TEST_CASE("patches without depth find no piece, but where depth is of no use") {
    PieceStates states = two_pieces(true);
    states.end_frame(DEFREC_TRACKING, {seen(80), seen(80, 0.05)}, true);
    CHECK(states.pieces()[1].state == DEFREC_LOST);
    states.end_frame(DEFREC_DEGRADED, {seen(80, 0), seen(80, 0)}, false);
    CHECK(states.pieces()[0].state == DEFREC_TRACKING);
    CHECK(states.pieces()[1].state == DEFREC_RELOCALISED);
}

TEST_CASE("a piece out of the view is lost, and not missed") {
    PieceStates states = two_pieces(true);
    states.end_frame(DEFREC_TRACKING, {seen(80), out_of_view()}, true);
    CHECK(states.pieces()[1].state == DEFREC_LOST);
    CHECK(!states.misses_one());
}

TEST_CASE("a frame that finds no piece finds nothing; one that is lost loses all") {
    PieceStates states = two_pieces(true);
    CHECK(!states.shows_any({seen(2), seen(2)}, true));
    states.end_frame(DEFREC_LOST, {}, true);
    CHECK(states.pieces()[0].state == DEFREC_LOST);
    CHECK(states.pieces()[1].state == DEFREC_LOST);
    CHECK(!states.misses_one());
    states.end_frame(DEFREC_RELOCALISED, {seen(40), seen(2)}, true);
    CHECK(states.pieces()[0].state == DEFREC_RELOCALISED);
    CHECK(states.pieces()[1].age == 2);
}

TEST_CASE("a single piece has the frame's state") {
    PieceStates states;
    states.reset(1, false);
    CHECK(states.shows_any({seen(0)}, true));
    for (const uint32_t state :
         {DEFREC_RELOCALISED, DEFREC_TRACKING, DEFREC_DEGRADED, DEFREC_LOST}) {
        states.end_frame(state, {seen(0)}, true);
        REQUIRE(states.pieces().size() == 1);
        CHECK(states.pieces()[0].state == state);
        CHECK(!states.misses_one());
    }
}
