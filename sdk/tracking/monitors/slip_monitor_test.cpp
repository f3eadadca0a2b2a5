// A flat surface whose lower side slides along its upper one: what the frames say of it is made up.
#include "sdk/tracking/monitors/slip_monitor.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "backends/shared/motion.hpp"
#include "sdk/template/cut.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"

using namespace defrec;

namespace {

constexpr int kColumns = 60, kRows = 44;
constexpr double kStep = 8, kDepth = 80, kFocal = 400;
constexpr double kMmPerPx = kDepth / kFocal;

struct Sliding {
    double slip = 10;      // mm, of the lower side to the right
    double unseen = 6;     // cells on either side of the line that do not show the template
    double curvature = 0;  // px of the line, per squared px to either side
    double all = 0;        // mm, of both sides
    // Shares of the width, from the left: as far as the sides slide, and as far as either is seen.
    double slides_to = 1, seen_to = 1;
    double lost_to = 0;  // likewise: as far as nothing of the lower side shows the template
    // Shares of the width of the surface in which the line shows, from their lower ends on.
    double shown = 1;
    std::array<double, 2> shown_from = {0, 0};
    uint32_t observation = DEFREC_OBSERVED;
};

// Texture of either side, so that no window of it looks like another one.
uint8_t gray_of(double u, double v, bool is_lower) {
    const double phase = is_lower ? 2.1 : 0;
    const double value = std::sin(0.31 * u + 0.17 * v + phase) +
                         std::sin(0.13 * u - 0.29 * v + 2 * phase) +
                         std::sin(0.043 * u * (1 + 0.002 * v) + 0.37 * v);
    return static_cast<uint8_t>(128 + 36 * value);
}

class Surface {
  public:
    explicit Surface(const Sliding& given) : given_(given) {
        data_.width = static_cast<uint32_t>(kColumns * kStep);
        data_.height = static_cast<uint32_t>(kRows * kStep);
        data_.camera = {kFocal, kFocal, data_.width / 2.0, data_.height / 2.0, 5, 0};
        data_.node_spacing_mm = 4 * kStep * kMmPerPx;
        lay_nodes();
        data_.grid.columns = kColumns;
        data_.grid.rows = kRows;
        data_.grid.spacing = kStep;
        data_.grid.disparity.assign(size_t{kColumns} * kRows,
                                    static_cast<float>(kFocal * 5 / kDepth));
        data_.grid.support.assign(size_t{kColumns} * kRows, 0);
        for (int y = 0; y < kRows; ++y)
            for (int x = 0; x < kColumns; ++x) add_vertex(x * kStep, y * kStep);
        output_.samples = samples_;
        output_.check_predictions = predictions_;
        draw();
    }

    TemplateData& data() { return data_; }
    // Lower side of the line, at a pixel of the first view.
    bool is_lower(double u, double v) const { return across(u, v) > 0; }
    double across(double u, double v) const {
        const double aside = u - data_.width / 2.0;
        return v - data_.height / 2.0 - given_.curvature * aside * aside;
    }

    const std::optional<Slip>& watch(SlipMonitor& monitor, int frames) const {
        for (int i = 0; i < frames; ++i)
            monitor.add_frame(data_, output_, is_confirmed_,
                              monitor.wants_image() ? live_ : std::vector<uint8_t>(), nullptr);
        return monitor.found();
    }

  private:
    void lay_nodes() {
        NodeGrid& grid = data_.node_grid;
        grid.spacing_u = grid.spacing_v = 4 * kStep;
        grid.columns = kColumns / 4 + 1;
        grid.rows = kRows / 4 + 1;
        for (int y = 0; y < grid.rows; ++y)
            for (int x = 0; x < grid.columns; ++x) {
                grid.node.push_back(static_cast<int32_t>(grid.node.size()));
                for (const double place :
                     {(x * grid.spacing_u - data_.camera.cx) * kMmPerPx,
                      (y * grid.spacing_v - data_.camera.cy) * kMmPerPx, kDepth})
                    data_.nodes.push_back(static_cast<float>(place));
            }
    }
    void add_vertex(double u, double v) {
        data_.grid.vertex.push_back(static_cast<int32_t>(data_.vertices.size()));
        defrec_surface_point point{};
        point.position[0] = static_cast<float>((u - data_.camera.cx) * kMmPerPx);
        point.position[1] = static_cast<float>((v - data_.camera.cy) * kMmPerPx);
        point.position[2] = static_cast<float>(kDepth);
        point.normal[2] = -1;
        data_.check_of_vertex.push_back(static_cast<int32_t>(data_.vertices.size()));
        data_.vertices.push_back(point);
        data_.checks.push_back({});
        const double cells = across(u, v) / kStep;
        const bool is_shown =
            std::any_of(given_.shown_from.begin(), given_.shown_from.end(), [&](double from) {
                return u >= from * data_.width && u <= (from + given_.shown) * data_.width;
            });
        const double slip = slip_at(u);
        const bool is_hidden = u > given_.seen_to * data_.width;
        const bool is_lost = cells > 0 && u < given_.lost_to * data_.width;
        const bool is_between = is_shown && slip != 0 && std::abs(cells) < given_.unseen;
        const bool is_unseen = is_lost || is_between;
        // The surface is drawn out between what is seen.
        const double share =
            is_unseen && !is_lost ? (cells / given_.unseen + 1) / 2 : (cells > 0 ? 1 : 0);
        defrec_surface_sample sample{};
        sample.position[0] = point.position[0] + static_cast<float>(given_.all + share * slip);
        sample.position[1] = point.position[1];
        sample.position[2] = point.position[2];
        sample.observation = is_hidden   ? uint32_t{DEFREC_OCCLUDED}
                             : is_unseen ? given_.observation
                                         : uint32_t{DEFREC_OBSERVED};
        samples_.push_back(sample);
        is_confirmed_.push_back(is_unseen || is_hidden ? 0 : 1);
        defrec_patch_prediction expected{};
        expected.u = static_cast<int32_t>(256 * u);
        expected.v = static_cast<int32_t>(256 * v);
        expected.valid = 1;
        predictions_.push_back(expected);
    }
    double slip_at(double u) const { return u <= given_.slides_to * data_.width ? given_.slip : 0; }
    void draw() {
        for (uint32_t v = 0; v < data_.height; ++v)
            for (uint32_t u = 0; u < data_.width; ++u) {
                data_.image.push_back(gray_of(u, v, is_lower(u, v)));
                // Along a curved line the sides overlap by less than a pixel, and the lower wins.
                const double upper = u - given_.all / kMmPerPx,
                             lower = upper - slip_at(upper) / kMmPerPx;
                live_.push_back(is_lower(lower, v) ? gray_of(lower, v, true)
                                                   : gray_of(upper, v, false));
            }
    }

    const Sliding given_;
    TemplateData data_;
    std::vector<defrec_surface_sample> samples_;
    std::vector<defrec_patch_prediction> predictions_;
    std::vector<uint8_t> is_confirmed_, live_;
    FrameOutput output_;
};

std::optional<Slip> slip_of(const Sliding& given) {
    SlipMonitor monitor;
    return Surface(given).watch(monitor, 20);
}

}  // namespace

TEST_CASE("sides that slide are parted along the line where they meet") {
    for (const double curvature : {0.0, 0.0006}) {
        CAPTURE(curvature);
        Sliding given;
        given.curvature = curvature;
        const Surface surface(given);
        SlipMonitor monitor;
        CHECK(!surface.watch(monitor, decisions::Slips::kFrames - 1));
        CHECK(!monitor.wants_image());
        CHECK(!surface.watch(monitor, 1));
        CHECK(monitor.wants_image());  // which tells where the line runs
        const std::optional<Slip>& slip = surface.watch(monitor, 1);
        REQUIRE(slip);
        const auto& pixels = slip->line.pixels;
        REQUIRE(pixels.size() >= 4);
        // Where one side has left the image the line is continued.
        const double seen_to = kColumns * kStep - given.slip / kMmPerPx - 2 * kStep;
        for (const auto& [u, v] : pixels)
            if (u > 2 * kStep && u < seen_to)
                CHECK(std::abs(surface.across(double{u}, double{v})) < 1.25 * kStep);
        // From one border of the surface to the other.
        CHECK(std::min(pixels.front()[0], pixels.back()[0]) < kStep);
        CHECK(std::max(pixels.front()[0], pixels.back()[0]) > (kColumns - 2) * kStep);
    }
}

TEST_CASE("control points beside the line move with the side that they are on") {
    Sliding given;
    Surface surface(given);
    SlipMonitor monitor;
    const std::optional<Slip>& slip = surface.watch(monitor, 10);
    REQUIRE(slip);
    REQUIRE(slip->motions.size() > 20);
    for (const auto& [node, motion] : slip->motions) {
        const float* place = &surface.data().nodes[3 * node];
        const double v = double{place[1]} / kMmPerPx + surface.data().camera.cy;
        if (std::abs(v - surface.data().height / 2.0) < kStep) continue;
        const auto moved = apply(DualQuaternion<double>::load(motion), load3<double>(place)) -
                           load3<double>(place);
        CHECK(moved.x ==
              doctest::Approx(v > surface.data().height / 2.0 ? given.slip : 0).epsilon(0.02));
    }
}

TEST_CASE("what does not slide is not parted") {
    Sliding still;
    still.slip = 0;
    CHECK(!slip_of(still));
    Sliding moved = still;
    moved.all = 8;  // both sides
    CHECK(!slip_of(moved));
    Sliding slightly;
    slightly.slip = 5;  // less than a spacing of control points
    CHECK(!slip_of(slightly));
    Sliding covered;  // by an instrument that lies on the tissue
    covered.observation = DEFREC_OCCLUDED;
    CHECK(!slip_of(covered));
    Sliding alone;  // the template is nowhere seen beside it
    alone.unseen = 30;
    CHECK(!slip_of(alone));
}

TEST_CASE("a line that was released is not found again, and a new template begins anew") {
    Surface surface{Sliding{}};
    SlipMonitor monitor;
    REQUIRE(surface.watch(monitor, 10));
    surface.data().node_grid.cuts.push_back(monitor.found()->line);
    const auto most_unconfirmed = [&] {
        return *std::max_element(monitor.unconfirmed().begin(), monitor.unconfirmed().end());
    };
    monitor.end_release();
    CHECK(most_unconfirmed() == decisions::Slips::kFrames);
    CHECK(!surface.watch(monitor, 10));
    CHECK(most_unconfirmed() == decisions::Slips::kFrames);
    surface.data().node_grid.cuts.clear();
    monitor.reset();
    CHECK(monitor.unconfirmed().empty());
    CHECK(!surface.watch(monitor, 1));
    CHECK(most_unconfirmed() == 1);
    CHECK(surface.watch(monitor, 10));
}

TEST_CASE("a line goes on to the border where nothing is seen, and not where sides rest") {
    constexpr double kWidth = kColumns * kStep, kShare = 0.6, kSpacing = 4 * kStep;
    const auto end_of = [](const Sliding& given) {
        const std::optional<Slip> slip = slip_of(given);
        REQUIRE(slip);
        const auto& pixels = slip->line.pixels;
        return double{std::max(pixels.front()[0], pixels.back()[0])};
    };
    CHECK(end_of({.seen_to = kShare}) > kWidth - kStep);
    CHECK(end_of({.slides_to = kShare}) < kShare * kWidth + 2 * kSpacing);
}

TEST_CASE("a line is found where most of one side does not show the template") {
    CHECK(slip_of({.lost_to = 0.6}));
}

TEST_CASE("parts of a line that show far from each other along it are one line") {
    Sliding given;
    given.shown = 0.15;  // less than a line
    given.shown_from = {0.1, 0.6};
    const std::optional<Slip> slip = slip_of(given);
    REQUIRE(slip);
    const auto& pixels = slip->line.pixels;
    CHECK(std::min(pixels.front()[0], pixels.back()[0]) < 0.1 * kColumns * kStep);
    CHECK(std::max(pixels.front()[0], pixels.back()[0]) > 0.75 * kColumns * kStep);
    given.shown_from = {0.1, 0.1};
    CHECK(!slip_of(given));
}

TEST_CASE("a line that was released goes on from its end, and nowhere else, over a short part") {
    Sliding given;
    given.shown = 0.15;
    given.shown_from = {0.65, 0.65};
    Surface surface(given);
    constexpr float kMiddle = kRows * static_cast<float>(kStep) / 2, kEnd = 240;
    auto& cuts = surface.data().node_grid.cuts;
    SlipMonitor monitor;
    const auto found_beside = [&](CutLine line) {
        cuts = {std::move(line)};
        monitor.reset();
        return surface.watch(monitor, 20).has_value();
    };
    CHECK_FALSE(found_beside({0, {{kEnd, 0}, {kEnd, kMiddle - 20}}}));  // it goes downwards
    CHECK_FALSE(found_beside({1, {{-20, kMiddle}, {kEnd, kMiddle}}}));  // of another piece
    REQUIRE(found_beside({0, {{-20, kMiddle}, {kEnd, kMiddle}}}));
    const auto& pixels = monitor.found()->line.pixels;
    const bool is_forward = pixels.front()[0] < pixels.back()[0];
    const auto &first = is_forward ? pixels.front() : pixels.back(),
               &last = is_forward ? pixels.back() : pixels.front();
    CHECK(first[0] == doctest::Approx(kEnd));
    CHECK(first[1] == doctest::Approx(kMiddle));
    // And straight on, out of the surface.
    CHECK(last[0] > (kColumns - 2) * static_cast<float>(kStep));
    CHECK(std::abs(last[1] - kMiddle) < 4 * static_cast<float>(kStep));
}
