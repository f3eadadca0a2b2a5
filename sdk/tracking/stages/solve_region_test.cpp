// The part of a map that is solved: a plane three images wide, of which a camera that moves along
// it sees a third.
#include "sdk/tracking/stages/solve_region.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numeric>

#include "backends/shared/motion.hpp"
#include "sdk/template/node_edges.hpp"
#include "sdk/tracking/stages/make_stage.hpp"
#include "sdk/tracking/test_device.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

constexpr double kSpacingMm = 5, kPlaneMm = 80;  // mm
constexpr int kColumns = 17, kRows = 14;         // of the first image's control points
constexpr double kMapEnd = (3 * kColumns - 1) * kSpacingMm;

struct Map {
    TemplateData data;

    Map() {
        data.width = 340;
        data.height = 280;
        data.camera = {340, 340, 0, 0, 5, 0};
        data.node_spacing_mm = kSpacingMm;
        data.node_grid.columns = kColumns;
        data.node_grid.rows = kRows;
        data.node_grid.node.resize(static_cast<size_t>(kColumns) * kRows);
        add_columns(0, kColumns);
        connect_nodes(data, 0);
        add_items(0);
        data.parts.push_back({});
        data.parts.front().before = data.counts();
        const size_t first = data.nodes.size() / 3, first_item = data.vertices.size();
        add_columns(kColumns, 3 * kColumns);
        connect_nodes(data, first);
        add_items(first_item);
    }

    size_t nodes() const { return data.nodes.size() / 3; }
    // The camera has moved along the plane.
    std::vector<defrec_motion> seen_from(double along, double back = 0) const {
        const auto motion = from_rigid(Quaternion<double>{1, 0, 0, 0}, {-along, 0, back});
        return std::vector<defrec_motion>(nodes(), motion.store());
    }

  private:
    void add_columns(int first, int end) {
        for (int x = first; x < end; ++x)
            for (int y = 0; y < kRows; ++y)
                for (const double value : {x * kSpacingMm, y * kSpacingMm, kPlaneMm})
                    data.nodes.push_back(static_cast<float>(value));
    }
    // A vertex, a landmark and a patch between two control points of a column each.
    void add_items(size_t first) {
        for (size_t i = first; i + 1 < nodes(); ++i) {
            const bool ends_column = i % kRows == kRows - 1;
            const auto other = static_cast<int32_t>(ends_column ? i : i + 1);
            const auto place = [&](auto& item) {
                std::copy_n(&data.nodes[3 * i], 3, item.position);
                item.position[1] += ends_column ? 0.f : float(kSpacingMm / 2);
                std::fill_n(item.node, DEFREC_BLEND_NODES, static_cast<int32_t>(i));
                item.node[1] = other;
                item.weight[0] = item.weight[1] = 0.5f;
            };
            defrec_surface_point& vertex = data.vertices.emplace_back();
            place(vertex);
            vertex.normal[2] = -1;
            place(data.landmark_points.emplace_back());
            place(data.patches.emplace_back());
        }
    }
};

bool is_pair(const Map& map, const defrec_edge& edge) {
    return static_cast<size_t>(edge.a) == map.nodes() &&
           static_cast<size_t>(edge.b) == map.nodes() + 1;
}

double weight_of(std::span<const defrec_edge> edges) {
    return std::accumulate(edges.begin(), edges.end(), 0.0,
                           [](double sum, const defrec_edge& edge) { return sum + edge.weight; });
}

// Least and greatest x at rest of the control points that the connections are of.
std::pair<double, double> extent(const Map& map, const RegionLists& lists) {
    std::pair<double, double> found{1e9, -1e9};
    for (const defrec_edge& edge : lists.edges) {
        if (is_pair(map, edge)) continue;
        const double x = lists.nodes[3 * static_cast<size_t>(edge.a)];
        found = {std::min(found.first, x), std::max(found.second, x)};
    }
    return found;
}

using Choice = SolveRegion::Choice;

}  // namespace

TEST_CASE("a part is of use where a map is much larger than its first view") {
    const Map map;
    CHECK(SolveRegion::suits(map.data));
    TemplateData first = map.data;
    first.parts.clear();
    CHECK_FALSE(SolveRegion::suits(first));
    first = map.data;
    first.edges.resize(map.data.parts.front().before.edges * 5 / 4);
    CHECK_FALSE(SolveRegion::suits(first));
}

TEST_CASE("a part has what lies in the image, and is chosen anew when that changes") {
    const Map map;
    SolveRegion region(map.data, map.data.vertices);
    const RegionLists& lists = region.lists();
    const size_t edges = lists.edges.size(), points = lists.points.size();
    CHECK(edges < map.data.edges.size() * 2 / 3);
    CHECK(points < map.data.vertices.size() * 2 / 3);
    const double width = map.data.width * kPlaneMm / map.data.camera.fx;
    for (const double along : {0.0, 60.0, kMapEnd - width}) {
        CAPTURE(along);
        REQUIRE(region.choose(map.seen_from(along)) == Choice::kOther);
        CHECK(region.choose(map.seen_from(along)) == Choice::kSame);
        CHECK(region.choose(map.seen_from(along + 0.5)) == Choice::kSame);
        CHECK(region.covers_image(map.seen_from(along)));
        const auto [low, high] = extent(map, lists);
        CHECK(low <= std::max(0.0, along - kSpacingMm));
        CHECK(low >= along - 4 * kSpacingMm);
        CHECK(high >= std::min(kMapEnd - kSpacingMm, along + width));
        CHECK(high <= along + width + 4 * kSpacingMm);
        CHECK(lists.edges.size() == edges);
        CHECK(lists.points.size() == points);
        CHECK(lists.nodes.size() / 3 == map.nodes() + SolveRegion::kPair);
    }
    CHECK_FALSE(region.covers_image(map.seen_from(0)));
    CHECK(region.choose(map.seen_from(60, 300)) == Choice::kTooLarge);
    CHECK(region.choose(map.seen_from(60)) == Choice::kOther);
}

TEST_CASE("connections weigh the same against the mean in a part and in the whole") {
    const Map map;
    SolveRegion region(map.data, map.data.vertices);
    REQUIRE(region.choose(map.seen_from(60)) == Choice::kOther);
    const RegionLists& lists = region.lists();
    const double whole = weight_of(map.data.edges) / static_cast<double>(map.nodes()),
                 part = weight_of(lists.edges) / (static_cast<double>(lists.nodes.size()) / 3);
    CHECK(part == doctest::Approx(whole).epsilon(1e-4));
    for (const defrec_edge& edge : lists.edges) CHECK(edge.weight > 0);
}

namespace {

// Solves a frame with a wave along the ray, patches being seen where it takes them.
class Solver {
  public:
    explicit Solver(const Map& map) : map_(map), on_("cpu"), queue_(on_.device) {}

    std::vector<defrec_motion> solve(const RegionLists& lists,
                                     const std::vector<defrec_motion>& start) {
        auto params = make_params<defrec_lm_params>();
        params.nodes = static_cast<uint32_t>(lists.nodes.size() / 3);
        params.edges = static_cast<uint32_t>(lists.edges.size());
        params.points = static_cast<uint32_t>(lists.points.size());
        params.landmarks = static_cast<uint32_t>(lists.landmarks.size());
        params.patches = static_cast<uint32_t>(lists.patches.size());
        params.width = map_.data.width;
        params.height = map_.data.height;
        params.camera = map_.data.camera;
        params.cg_iterations = 100;
        params.iterations = 20;
        const auto stage = make_stage<DEFREC_STAGE_LM>(on_.device, params);
        const DeviceBuffer nodes = upload(lists.nodes), edges = upload(lists.edges),
                           points = upload(lists.points), landmarks = upload(lists.landmarks),
                           patches = upload(lists.patches), motions = upload(start),
                           seen = upload(observations(start)), results = upload(start),
                           summary(on_.device, sizeof(defrec_lm_summary));
        stage->prepare(queue_, {&nodes, &edges, &points, &landmarks, &patches});
        stage->enqueue(queue_, {&motions, nullptr, &seen, nullptr}, {&results, &summary});
        std::vector<defrec_motion> found(start.size());
        queue_.read(results, found.data(), std::span(found).size_bytes());
        queue_.finish();
        return found;
    }

  private:
    template <class T>
    DeviceBuffer upload(const std::vector<T>& values) {
        DeviceBuffer buffer(on_.device, std::span(values).size_bytes());
        queue_.write(buffer, values.data(), std::span(values).size_bytes());
        return buffer;
    }
    std::vector<defrec_patch_observation> observations(
        const std::vector<defrec_motion>& start) const {
        std::vector<defrec_patch_observation> seen;
        for (const defrec_patch& patch : map_.data.patches) {
            defrec_patch_observation& observation = seen.emplace_back();
            const Vec3<double> p = apply(blend<double>(start.data(), patch.node, patch.weight),
                                         load3<double>(patch.position)) +
                                   Vec3<double>{0.6 * std::sin(patch.position[0] / 9.0), 0.4, 0};
            const double u = map_.data.camera.fx * p.x / p.z, v = map_.data.camera.fy * p.y / p.z;
            if (u < 0 || v < 0 || u >= map_.data.width || v >= map_.data.height) continue;
            observation.valid = 1;
            observation.u = static_cast<int32_t>(std::lround(256 * u));
            observation.v = static_cast<int32_t>(std::lround(256 * v));
            observation.information[0] = observation.information[2] = 1;
        }
        return seen;
    }

    const Map& map_;
    TestDevice on_;
    Queue queue_;
};

}  // namespace

TEST_CASE("what lies in the image is solved as with the whole map, the rest stays where it was") {
    const Map map;
    SolveRegion region(map.data, map.data.vertices);
    const auto start = map.seen_from(60);
    REQUIRE(region.choose(start) == Choice::kOther);
    auto with_pair = start;
    with_pair.resize(map.nodes() + SolveRegion::kPair, DualQuaternion<double>::identity().store());
    Solver solver(map);
    const auto part = solver.solve(region.lists(), with_pair),
               whole = solver.solve({map.data.nodes, map.data.edges, map.data.vertices,
                                     map.data.landmark_points, map.data.patches},
                                    start);
    double moved = 0;
    for (size_t i = 0; i < map.nodes(); ++i) {
        CAPTURE(i);
        const auto at = [&](const std::vector<defrec_motion>& motions) {
            return apply(DualQuaternion<double>::load(motions[i]),
                         load3<double>(&map.data.nodes[3 * i]));
        };
        const auto distance = [](Vec3<double> a, Vec3<double> b) {
            return std::sqrt(dot(a - b, a - b));
        };
        const auto pixel = [&](Vec3<double> p) { return map.data.camera.fx / p.z * p; };
        const double u = pixel(at(start)).x;
        moved = std::max(moved, distance(at(part), at(start)));
        // Nothing tells the depth.
        if (u >= 0 && u < map.data.width) CHECK(distance(pixel(at(part)), pixel(at(whole))) < 0.05);
        if (u < -200 || u > map.data.width + 200) CHECK(distance(at(part), at(start)) < 1e-4);
    }
    CHECK(moved > 0.5);
    for (size_t i = map.nodes(); i < part.size(); ++i) CHECK(std::abs(part[i].real[0] - 1) < 1e-5);
}
