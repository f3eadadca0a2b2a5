// A grid of control points with vertices between them: what the frames say of these is made up.
#include "sdk/tracking/monitors/departed_tissue.hpp"

#include <doctest/doctest.h>

#include "sdk/tracking/decisions/template_changes.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"

using namespace defrec;
using decisions::Departure;

namespace {

constexpr int kNodes = 10;    // in each direction
constexpr int kVertices = 4;  // between two control points
constexpr int kSide = kVertices * (kNodes - 1);

struct Surface {
    TemplateData data;
    std::vector<defrec_surface_sample> samples;
    std::vector<uint8_t> is_confirmed;
    DepartedTissue departed;

    Surface() {
        data.camera = {400, 400, 240, 160, 5, 0};
        data.nodes.resize(size_t{3} * kNodes * kNodes);
        const auto node = [](int x, int y) { return static_cast<int32_t>(y * kNodes + x); };
        for (int y = 0; y < kNodes; ++y)
            for (int x = 0; x < kNodes; ++x) {
                if (x > 0) data.edges.push_back({node(x - 1, y), node(x, y), 1});
                if (y > 0) data.edges.push_back({node(x, y - 1), node(x, y), 1});
            }
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x) {
                defrec_surface_point point{};
                const float a = static_cast<float>(x % kVertices) / kVertices,
                            b = static_cast<float>(y % kVertices) / kVertices;
                const int left = x / kVertices, top = y / kVertices;
                const int32_t nodes[4] = {node(left, top), node(left + 1, top), node(left, top + 1),
                                          node(left + 1, top + 1)};
                const float weights[4] = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
                for (int k = 0; k < 4; ++k) {
                    point.node[k] = nodes[k];
                    point.weight[k] = weights[k];
                }
                data.check_of_vertex.push_back(0);
                data.vertices.push_back(point);
            }
        show_all();
    }

    void show_all() {
        defrec_surface_sample sample{};
        sample.position[2] = 80;
        samples.assign(data.vertices.size(), sample);
        is_confirmed.assign(data.vertices.size(), 1);
    }
    // In columns and rows from..to of the vertices.
    void show(int from, int to, uint32_t observation, bool confirmed,
              float px = -2 * Departure::kMinPx) {
        for (int y = from; y < to; ++y)
            for (int x = from; x < to; ++x) {
                const auto i = static_cast<size_t>(y * kSide + x);
                samples[i].observation = observation;
                samples[i].residual = px * depth_per_px(data.camera, samples[i].position[2]);
                is_confirmed[i] = confirmed ? 1 : 0;
            }
    }
    void frames(int count) {
        FrameOutput output;
        output.samples = samples;
        for (int i = 0; i < count; ++i) departed.add_frame(data, output, is_confirmed);
    }
    uint32_t age_at(int x, int y) const {
        return departed.any() ? departed.age_of(data.vertices[static_cast<size_t>(y * kSide + x)])
                              : 0;
    }
};

constexpr int kFrom = 2 * kVertices, kTo = 6 * kVertices;

}  // namespace

TEST_CASE("tissue that is seen at another depth has left, and what hides beside it with it") {
    Surface surface;
    surface.frames(3);
    CHECK(!surface.departed.any());
    surface.show(kFrom, kTo + 2 * kVertices, DEFREC_OBSERVED,
                 false);  // the bed that comes to light
    surface.show(kFrom, kTo, DEFREC_OCCLUDED, true);
    surface.frames(Departure::kFrames);
    REQUIRE(surface.departed.any());
    CHECK(surface.age_at(kFrom + kVertices, kFrom + kVertices) > 0);
    CHECK(surface.age_at(kTo + kVertices, kTo + kVertices) > 0);
    CHECK(surface.age_at(0, 0) == 0);
    CHECK(surface.age_at(kSide - 1, 0) == 0);
    CHECK(surface.departed.share() > Departure::kMaxShare);
}

TEST_CASE("it has left until it is seen again, however often its place is seen") {
    Surface surface;
    surface.frames(2);
    surface.show(kFrom, kTo, DEFREC_OCCLUDED, true);
    surface.frames(Departure::kFrames);
    surface.show(kFrom, kTo, DEFREC_OBSERVED, false);
    surface.frames(20);
    CHECK(surface.age_at(kFrom + kVertices, kFrom + kVertices) > 20);
    surface.show_all();
    surface.frames(Departure::kFramesBack - 1);
    CHECK(surface.departed.any());
    surface.frames(1);
    CHECK(!surface.departed.any());
    CHECK(surface.departed.share() == 0);
}

TEST_CASE("what hides, what is nowhere seen and what never was seen has not left") {
    Surface hidden;  // behind an instrument
    hidden.frames(2);
    hidden.show(kFrom, kTo, DEFREC_OCCLUDED, false);
    hidden.frames(5);
    CHECK(!hidden.departed.any());
    Surface blood;
    blood.frames(2);
    blood.show(kFrom, kTo, DEFREC_OBSERVED, false);
    blood.frames(5);
    CHECK(!blood.departed.any());
    Surface edge;  // a few vertices at an instrument's edge
    edge.frames(2);
    edge.show(kFrom, kFrom + kVertices, DEFREC_OCCLUDED, true);
    edge.frames(5);
    CHECK(!edge.departed.any());
    Surface first;  // the template's own frame
    first.show(kFrom, kTo, DEFREC_OCCLUDED, true);
    first.frames(5);
    CHECK(!first.departed.any());
    Surface blurred;  // depth errs by little
    blurred.frames(2);
    blurred.show(kFrom, kTo, DEFREC_OCCLUDED, true, -0.9f * Departure::kMinPx);
    blurred.frames(5);
    CHECK(!blurred.departed.any());
    Surface late;  // depth is wrong, not the tissue gone
    late.frames(2);
    late.show(0, kSide, DEFREC_OCCLUDED, true);
    late.frames(5);
    CHECK(!late.departed.any());
}

TEST_CASE("another template begins anew") {
    Surface surface;
    surface.frames(2);
    surface.show(kFrom, kTo, DEFREC_INCONSISTENT, true);
    surface.frames(Departure::kFrames);
    REQUIRE(surface.departed.any());
    surface.departed.reset();
    CHECK(!surface.departed.any());
    surface.show_all();
    surface.frames(1);
    CHECK(!surface.departed.any());
}

TEST_CASE("tissue that joins after the last frame has not left") {
    Surface surface;
    surface.frames(2);
    surface.show(kFrom, kTo, DEFREC_OCCLUDED, true);
    surface.frames(Departure::kFrames);
    REQUIRE(surface.departed.any());
    defrec_surface_point joined{};
    for (int32_t& node : joined.node) node = kNodes * kNodes;
    joined.weight[0] = 1;
    CHECK(surface.departed.age_of(joined) == 0);
}
