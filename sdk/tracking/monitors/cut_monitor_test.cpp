// A flat surface that opens along a line: what the frames say of it is made up.
#include "sdk/tracking/monitors/cut_monitor.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "sdk/template/cut.hpp"

using namespace defrec;

namespace {

constexpr int kColumns = 60, kRows = 40;
constexpr double kStep = 8, kDepth = 80;

struct Opening {
    double opening = 6;       // mm
    double half_length = 14;  // cells along the line, to either side
    double unseen = 6;        // cells on either side that do not show the template
    double slope = 0.5;       // rows per column of the line
    double everywhere = 1;    // scale of the whole surface
    double residual = 4;      // mm from the surface to what is seen in the gap
    uint32_t observation = DEFREC_INCONSISTENT;
};

struct Surface {
    TemplateData data;
    std::vector<defrec_surface_sample> samples;
    std::vector<uint8_t> is_confirmed;

    explicit Surface(const Opening& given) {
        data.width = static_cast<uint32_t>(kColumns * kStep);
        data.height = static_cast<uint32_t>(kRows * kStep);
        data.camera = {400, 400, 240, 160, 5, 0};
        data.grid.columns = kColumns;
        data.grid.rows = kRows;
        data.grid.spacing = kStep;
        data.node_grid.spacing_u = data.node_grid.spacing_v = 4 * kStep;
        const double norm = std::hypot(1, given.slope);
        for (int y = 0; y < kRows; ++y)
            for (int x = 0; x < kColumns; ++x) {
                data.grid.vertex.push_back(static_cast<int32_t>(data.vertices.size()));
                const double u = x * kStep, v = y * kStep;
                defrec_surface_point point{};
                const double mm = kDepth / data.camera.fx;
                point.position[0] = static_cast<float>((u - data.camera.cx) * mm);
                point.position[1] = static_cast<float>((v - data.camera.cy) * mm);
                point.position[2] = static_cast<float>(kDepth);
                data.vertices.push_back(point);
                const double column = x - kColumns / 2.0, row = y - kRows / 2.0,
                             along = (column + given.slope * row) / norm,
                             across = (row - given.slope * column) / norm;
                // The sides move apart; what is not seen is drawn out between them.
                const bool is_beside = std::abs(along) <= given.half_length;
                const double share = std::abs(across) >= given.unseen ? std::copysign(1.0, across)
                                                                      : across / given.unseen;
                const double moved = is_beside ? given.opening / 2 * share : 0;
                defrec_surface_sample sample{};
                sample.position[0] = static_cast<float>(given.everywhere * point.position[0] -
                                                        moved * given.slope / norm);
                sample.position[1] =
                    static_cast<float>(given.everywhere * point.position[1] + moved / norm);
                sample.position[2] = point.position[2];
                const bool is_unseen = is_beside && std::abs(across) < given.unseen,
                           is_gap = is_beside && std::abs(across) < 2;
                sample.observation = is_gap ? given.observation : uint32_t{DEFREC_OBSERVED};
                sample.residual = is_gap ? static_cast<float>(given.residual) : 0;
                samples.push_back(sample);
                is_confirmed.push_back(is_unseen ? 0 : 1);
            }
    }

    std::optional<CutLine> watch(CutMonitor& monitor, int frames) const {
        for (int i = 0; i < frames; ++i) monitor.add_frame(data, samples, is_confirmed);
        return monitor.found();
    }
    std::optional<CutLine> watch() const {
        CutMonitor monitor;
        return watch(monitor, 20);
    }
};

}  // namespace

TEST_CASE("a surface that opens along a line is cut there") {
    const Surface surface{Opening{}};
    CutMonitor monitor;
    CHECK(!surface.watch(monitor, 4));
    const std::optional<CutLine> cut = surface.watch(monitor, 1);
    REQUIRE(cut);
    REQUIRE(cut->pixels.size() >= 4);
    const double norm = std::hypot(1, 0.5);
    double begin = 0, end = 0;
    for (const auto& [u, v] : cut->pixels) {
        const double column = double{u} / kStep - kColumns / 2.0,
                     row = double{v} / kStep - kRows / 2.0, along = (column + 0.5 * row) / norm;
        CHECK(std::abs(row - 0.5 * column) / norm < 1);
        begin = std::min(begin, along);
        end = std::max(end, along);
    }
    CHECK(begin == doctest::Approx(-18).epsilon(0.1));
    CHECK(end == doctest::Approx(18).epsilon(0.1));
}

TEST_CASE("what looks like a gap but does not open is no cut") {
    Opening still;
    still.opening = 0;
    CHECK(!Surface(still).watch());
    Opening larger = still;
    larger.everywhere = 1.4;  // all of it
    CHECK(!Surface(larger).watch());
    Opening instrument;  // in front of the surface
    instrument.observation = DEFREC_OCCLUDED;
    instrument.residual = -4;
    CHECK(!Surface(instrument).watch());
    Opening stretched;  // as far as a cut opens, but the surface is what is seen
    stretched.observation = DEFREC_OBSERVED;
    stretched.residual = 0;
    CHECK(!Surface(stretched).watch());
    Opening pit;
    pit.half_length = 4;
    CHECK(!Surface(pit).watch());
    Opening alone;  // the template is nowhere seen beside it
    alone.unseen = 25;
    CHECK(!Surface(alone).watch());
}

TEST_CASE(
    "a gap that is seen now and then is no cut, and one that was released is not found again") {
    const Surface open{Opening{}};
    Opening closed_gap;
    closed_gap.observation = DEFREC_OBSERVED;
    closed_gap.residual = 0;
    const Surface closed{closed_gap};
    CutMonitor monitor;
    for (int i = 0; i < 20; ++i) {
        CHECK(!open.watch(monitor, 1));
        CHECK(!closed.watch(monitor, 1));
    }
    Surface released = open;
    released.data.node_grid.cuts.push_back(*open.watch());
    CHECK(!released.watch());
}
