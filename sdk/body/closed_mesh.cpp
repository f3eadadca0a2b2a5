// See closed_mesh.hpp. A place is inside where the surface winds around it: the sum of the signs of
// the triangles above it. All triangles at an edge judge on which side of it a line along z passes
// by the same numbers, so that a line through an edge or a vertex counts as one that passes near.
#include "sdk/body/closed_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "sdk/base/util/error.hpp"
#include "sdk/body/decisions.hpp"

namespace defrec {
namespace {

using decisions::BodyMesh;

constexpr uint64_t kMaxCellsPerTriangle = 10;  // on average
constexpr int kShareLines = 4;                 // along x and along y

// To four digits.
float rounded(double value) {
    if (value == 0) return 0;
    const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 3);
    constexpr double kMax = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(std::round(value / unit) * unit, -kMax, kMax));
}

std::string text(const Eigen::Vector3d& place) {
    const Eigen::Vector3f shown = place.cast<float>();
    return concat("(", shown.x(), " ", shown.y(), " ", shown.z(), ")");
}

std::string box_text(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    return concat(text(low), " .. ", text(high));
}

// How often a line along z at x, y has the edge on its right, with the edge's direction up or down.
// Exactly the negative for the reversed edge.
int edge_winding(const Eigen::Vector3d& from, const Eigen::Vector3d& to, bool is_reversed, double x,
                 double y) {
    if ((from.y() <= y) == (to.y() <= y)) return 0;
    const Eigen::Vector3d& a = is_reversed ? to : from;
    const Eigen::Vector3d& b = is_reversed ? from : to;
    const double side = (b.x() - a.x()) * (y - a.y()) - (x - a.x()) * (b.y() - a.y());
    const int sign = a.y() <= y ? (side > 0 ? 1 : 0) : (side < 0 ? -1 : 0);
    return is_reversed ? -sign : sign;
}

// Height of a triangle's plane at x, y, within the triangle's heights.
double plane_height(const std::array<Eigen::Vector3d, 3>& corner, double x, double y) {
    const auto [least, most] = std::minmax({corner[0].z(), corner[1].z(), corner[2].z()});
    const Eigen::Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    if (normal.z() == 0) return (least + most) / 2;
    const double rise =
        (normal.x() * (x - corner[0].x()) + normal.y() * (y - corner[0].y())) / normal.z();
    return std::clamp(corner[0].z() - rise, least, most);
}

// From where to where along x a triangle lies in a row of that height, and a little beyond.
std::pair<double, double> range_in_row(const std::array<Eigen::Vector2d, 3>& corners, uint32_t row,
                                       double height) {
    const double margin = 1e-6 * height;
    const double low = row * height - margin, high = low + height + 2 * margin;
    double from = std::numeric_limits<double>::infinity(), to = -from;
    for (size_t i = 0; i < 3; ++i) {
        const Eigen::Vector2d &a = corners[i], &b = corners[(i + 1) % 3];
        if (std::max(a.y(), b.y()) < low || std::min(a.y(), b.y()) > high) continue;
        for (const Eigen::Vector2d& end : {a, b}) {
            const double y = std::clamp(end.y(), low, high);
            const double x =
                y == end.y() ? end.x() : a.x() + (b.x() - a.x()) * (y - a.y()) / (b.y() - a.y());
            from = std::min(from, x);
            to = std::max(to, x);
        }
    }
    return {from - margin, to + margin};
}

// Searches a mesh for triangles that cross, in a tree of boxes.
class CrossingSearch {
  public:
    struct Found {
        uint32_t first, second;  // triangles
        Eigen::Vector3d place;
    };

    CrossingSearch(std::span<const float> vertices, std::span<const uint32_t> triangles,
                   double tolerance)
        : vertices_(vertices), triangles_(triangles), tolerance_(tolerance) {
        std::vector<Item> items(triangles.size() / 3);
        for (size_t i = 0; i < items.size(); ++i) {
            items[i].triangle = static_cast<uint32_t>(i);
            const Box box = box_of(items[i].triangle);
            for (size_t axis = 0; axis < 3; ++axis)
                items[i].middle[axis] = box.low[axis] / 2 + box.high[axis] / 2;
        }
        boxes_.reserve(items.size());
        order_.reserve(items.size());
        nodes_.reserve(items.size());
        add_node(items);
    }

    std::optional<Found> find() {
        search_within(0);
        return found_;
    }
    bool has_given_up() const { return pairs_ > BodyMesh::kMaxPairs; }

  private:
    static constexpr size_t kLeafTriangles = 4;
    struct Item {
        std::array<float, 3> middle;
        uint32_t triangle;
    };
    struct Box {
        std::array<float, 3> low, high;
        bool meets(const Box& other) const {
            return low[0] <= other.high[0] && other.low[0] <= high[0] && low[1] <= other.high[1] &&
                   other.low[1] <= high[1] && low[2] <= other.high[2] && other.low[2] <= high[2];
        }
        void include(const Box& other) {
            for (size_t axis = 0; axis < 3; ++axis) {
                low[axis] = std::min(low[axis], other.low[axis]);
                high[axis] = std::max(high[axis], other.high[axis]);
            }
        }
    };
    struct Node {
        Box box;
        uint32_t first, last;   // places in order_
        uint32_t second_child;  // 0: a leaf; the first child follows its parent
    };
    using Corners = std::array<Eigen::Vector3d, 3>;

    Box box_of(uint32_t triangle) const {
        Box box;
        for (size_t corner = 0; corner < 3; ++corner)
            for (size_t axis = 0; axis < 3; ++axis) {
                const float value = vertices_[3 * triangles_[3 * triangle + corner] + axis];
                box.low[axis] = corner == 0 ? value : std::min(box.low[axis], value);
                box.high[axis] = corner == 0 ? value : std::max(box.high[axis], value);
            }
        return box;
    }
    Corners corners_of(uint32_t triangle) const {
        Corners corners;
        for (size_t corner = 0; corner < 3; ++corner)
            corners[corner] =
                Eigen::Map<const Eigen::Vector3f>(&vertices_[3 * triangles_[3 * triangle + corner]])
                    .cast<double>();
        return corners;
    }

    // Halves the items along the longest side of their middles' box. Recurses 20 deep at most.
    uint32_t add_node(std::span<Item> items) {
        const auto index = static_cast<uint32_t>(nodes_.size());
        const auto first = static_cast<uint32_t>(order_.size());
        nodes_.push_back({{}, first, first, 0});
        uint32_t second_child = 0;
        Box box;
        if (items.size() <= kLeafTriangles) {
            for (const Item& item : items) {
                order_.push_back(item.triangle);
                boxes_.push_back(box_of(item.triangle));
            }
            box = boxes_[first];
            for (size_t i = first; i < boxes_.size(); ++i) box.include(boxes_[i]);
        } else {
            Box middles{items[0].middle, items[0].middle};
            for (const Item& item : items) middles.include({item.middle, item.middle});
            size_t longest = 0;
            for (size_t axis = 1; axis < 3; ++axis)
                if (middles.high[axis] - middles.low[axis] >
                    middles.high[longest] - middles.low[longest])
                    longest = axis;
            const auto half = items.begin() + static_cast<std::ptrdiff_t>(items.size() / 2);
            std::nth_element(items.begin(), half, items.end(), [=](const Item& a, const Item& b) {
                return std::pair(a.middle[longest], a.triangle) <
                       std::pair(b.middle[longest], b.triangle);
            });
            const uint32_t first_child = add_node({items.begin(), half});
            second_child = add_node({half, items.end()});
            box = nodes_[first_child].box;
            box.include(nodes_[second_child].box);
        }
        nodes_[index] = {box, first, static_cast<uint32_t>(order_.size()), second_child};
        return index;
    }

    bool is_done() const { return found_ || has_given_up(); }

    void search_within(uint32_t index) {
        if (is_done()) return;
        const Node& node = nodes_[index];
        if (node.second_child != 0) {
            search_within(index + 1);
            search_within(node.second_child);
            search_between(index + 1, node.second_child);
            return;
        }
        for (uint32_t i = node.first; i < node.last; ++i)
            for (uint32_t k = i + 1; k < node.last; ++k) test(i, k);
    }
    void search_between(uint32_t a, uint32_t b) {
        const Node &one = nodes_[a], &other = nodes_[b];
        if (!one.box.meets(other.box) || is_done()) return;
        const bool is_leaf = one.second_child == 0, other_is_leaf = other.second_child == 0;
        if (is_leaf && other_is_leaf) {
            for (uint32_t i = one.first; i < one.last; ++i)
                if (boxes_[i].meets(other.box))
                    for (uint32_t k = other.first; k < other.last; ++k) test(i, k);
        } else if (other_is_leaf ||
                   (!is_leaf && one.last - one.first >= other.last - other.first)) {
            search_between(a + 1, b);
            search_between(one.second_child, b);
        } else {
            search_between(a, b + 1);
            search_between(a, other.second_child);
        }
    }

    void test(uint32_t i, uint32_t k) {
        if (is_done() || !boxes_[i].meets(boxes_[k])) return;
        const uint32_t first = std::min(order_[i], order_[k]);
        const uint32_t second = std::max(order_[i], order_[k]);
        int shared = 0;
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b)
                shared += triangles_[3 * first + a] == triangles_[3 * second + b];
        if (shared >= 2) return;
        ++pairs_;
        const Corners one = corners_of(first), other = corners_of(second);
        std::optional<Eigen::Vector3d> place = piercing(one, other);
        if (!place) place = piercing(other, one);
        if (place) found_ = {first, second, *place};
    }

    // Where a side of the one triangle passes through the other: its ends lie on both sides, and it
    // meets the inside, each by more than the tolerance. A common vertex is on neither side.
    std::optional<Eigen::Vector3d> piercing(const Corners& sides, const Corners& plane) const {
        const Eigen::Vector3d normal = (plane[1] - plane[0]).cross(plane[2] - plane[0]);
        const double area = normal.norm();
        const double least = tolerance_ * area;
        std::array<double, 3> above;
        for (size_t i = 0; i < 3; ++i) above[i] = normal.dot(sides[i] - plane[0]);
        for (size_t i = 0; i < 3; ++i) {
            const size_t next = (i + 1) % 3;
            if (!((above[i] > least && above[next] < -least) ||
                  (above[i] < -least && above[next] > least)))
                continue;
            const double at = above[i] / (above[i] - above[next]);
            const Eigen::Vector3d place = sides[i] + at * (sides[next] - sides[i]);
            if (is_within(place, plane, normal / area)) return place;
        }
        return std::nullopt;
    }
    bool is_within(const Eigen::Vector3d& place, const Corners& corners,
                   const Eigen::Vector3d& normal) const {
        for (size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d side = corners[(i + 1) % 3] - corners[i];
            if (!(normal.cross(side).dot(place - corners[i]) > tolerance_ * side.norm()))
                return false;
        }
        return true;
    }

    std::span<const float> vertices_;
    std::span<const uint32_t> triangles_;
    double tolerance_;
    std::vector<Node> nodes_;
    std::vector<uint32_t> order_;  // triangles
    std::vector<Box> boxes_;       // in that order
    uint64_t pairs_ = 0;
    std::optional<Found> found_;
};

// What is wrong with an edge that some triangles run along from its lower vertex to the higher one
// and some back; empty: nothing.
std::string edge_fault(size_t forth, size_t back) {
    if (forth == 1 && back == 1) return {};
    if (forth + back == 1) return "is not closed";
    if (forth + back == 2) return "is not oriented consistently";
    return "has an edge of more than two triangles";
}

void check_counts(const defrec_mesh& mesh, std::string_view name) {
    if (mesh.vertex_count > BodyMesh::kMaxCount)
        fail(DEFREC_ERROR_ARGUMENT, name, " has ", mesh.vertex_count, " vertices, expected 0..",
             BodyMesh::kMaxCount);
    if (mesh.triangle_count > BodyMesh::kMaxCount)
        fail(DEFREC_ERROR_ARGUMENT, name, " has ", mesh.triangle_count, " triangles, expected 0..",
             BodyMesh::kMaxCount);
    if (mesh.vertices == nullptr && mesh.vertex_count != 0)
        fail(DEFREC_ERROR_ARGUMENT, name, ".vertices is NULL, expected ", mesh.vertex_count,
             " vertices");
    if (mesh.triangles == nullptr && mesh.triangle_count != 0)
        fail(DEFREC_ERROR_ARGUMENT, name, ".triangles is NULL, expected ", mesh.triangle_count,
             " triangles");
    if (mesh.triangle_count < 4)
        fail(DEFREC_ERROR_ARGUMENT, name, " has ", mesh.triangle_count,
             " triangles, expected a closed mesh, which has 4 at least");
}

}  // namespace

ClosedMesh::ClosedMesh(const defrec_mesh& mesh, std::string_view name) {
    check_counts(mesh, name);
    vertices_.assign(mesh.vertices, mesh.vertices + 3 * mesh.vertex_count);
    triangles_.assign(mesh.triangles, mesh.triangles + 3 * mesh.triangle_count);
    check_triangles(name);
    check_size(name);
    check_edges(name);
    check_volume(name);
    check_crossings(name);
    make_grid();
    check_windings(name);
}

Eigen::Vector3d ClosedMesh::vertex(uint32_t index) const {
    return Eigen::Map<const Eigen::Vector3f>(&vertices_[3 * size_t{index}]).cast<double>();
}

void ClosedMesh::check_triangles(std::string_view name) {
    const size_t count = vertices_.size() / 3;
    for (size_t i = 0; i < vertices_.size(); ++i)
        if (!std::isfinite(vertices_[i]))
            fail(DEFREC_ERROR_ARGUMENT, name, ": vertex ", i / 3, " is (", vertices_[i - i % 3],
                 " ", vertices_[i - i % 3 + 1], " ", vertices_[i - i % 3 + 2],
                 "), expected finite coordinates");
    low_.setConstant(std::numeric_limits<double>::infinity());
    high_ = -low_;
    for (size_t i = 0; i < triangles_.size(); ++i) {
        const uint32_t index = triangles_[i];
        if (index >= count)
            fail(DEFREC_ERROR_ARGUMENT, name, ": triangle ", i / 3, " has vertex ", index,
                 ", expected less than the number of vertices, ", count);
        low_ = low_.cwiseMin(vertex(index));
        high_ = high_.cwiseMax(vertex(index));
    }
    for (size_t i = 0; i < triangle_count(); ++i)
        for (size_t corner = 0; corner < 3; ++corner)
            if (triangles_[3 * i + corner] == triangles_[3 * i + (corner + 1) % 3])
                fail(DEFREC_ERROR_ARGUMENT, name, ": triangle ", i, " has vertex ",
                     triangles_[3 * i + corner], " twice, expected three vertices");
}

void ClosedMesh::check_size(std::string_view name) const {
    const double side = longest_side();
    if (side < BodyMesh::kMinSide)
        fail(DEFREC_ERROR_ARGUMENT, name, " looks like metres: the largest side of its box is ",
             rounded(side), ", expected ", BodyMesh::kMinSide, "..", BodyMesh::kMaxSide, " mm");
    if (side > BodyMesh::kMaxSide)
        fail(DEFREC_ERROR_ARGUMENT, name,
             " is too large, or looks like micrometres: the largest side of its box is ",
             rounded(side), ", expected ", BodyMesh::kMinSide, "..", BodyMesh::kMaxSide, " mm");
}

// Two triangles at each edge, one in each direction.
void ClosedMesh::check_edges(std::string_view name) const {
    // By the edge's lower vertex: twice the higher one, plus 1 for a triangle that runs back.
    std::vector<uint32_t> first(vertices_.size() / 3 + 1), edges(triangles_.size());
    const auto visit = [&](const auto& take) {
        for (size_t i = 0; i < triangles_.size(); ++i) {
            const uint32_t from = triangles_[i], to = triangles_[i - i % 3 + (i + 1) % 3];
            if (take(std::min(from, to), 2 * std::max(from, to) + (from > to), i / 3)) return;
        }
    };
    visit([&](uint32_t lower, uint32_t, size_t) {
        ++first[lower + 1];
        return false;
    });
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    visit([&](uint32_t lower, uint32_t edge, size_t) {
        edges[next[lower]++] = edge;
        return false;
    });
    for (uint32_t lower = 0; lower + 1 < first.size(); ++lower) {
        const auto begin = edges.begin() + first[lower], end = edges.begin() + first[lower + 1];
        std::sort(begin, end);
        for (auto edge = begin; edge != end;) {
            const uint32_t higher = *edge / 2;
            const auto turn = std::upper_bound(edge, end, 2 * higher);
            const auto done = std::upper_bound(turn, end, 2 * higher + 1);
            const std::string fault =
                edge_fault(static_cast<size_t>(turn - edge), static_cast<size_t>(done - turn));
            if (fault.empty()) {
                edge = done;
                continue;
            }
            std::string at;
            visit([&](uint32_t a, uint32_t code, size_t triangle) {
                if (a == lower && code / 2 == higher)
                    at += concat(at.empty() ? "" : ", ", triangle,
                                 code % 2 == 0 ? " (forth)" : " (back)");
                return at.size() > 100;
            });
            // Files without indices list each vertex once for each of its triangles.
            std::string hint;
            for (uint32_t i = 0; done - edge == 1 && hint.empty() && i < vertices_.size() / 3; ++i)
                for (const uint32_t end_vertex : {lower, higher})
                    if (i != end_vertex && vertex(i) == vertex(end_vertex))
                        hint = concat("; vertices ", end_vertex, " and ", i,
                                      " lie at the same place: merge them");
            fail(DEFREC_ERROR_ARGUMENT, name, " ", fault, ": the edge from vertex ", lower, " ",
                 text(vertex(lower)), " to vertex ", higher, " ", text(vertex(higher)),
                 " is of triangle ", at, ", expected one forth and one back", hint);
        }
    }
}

void ClosedMesh::check_volume(std::string_view name) const {
    const Eigen::Vector3d centre = (low_ + high_) / 2;
    double volume = 0, area = 0;
    for (size_t i = 0; i < triangle_count(); ++i) {
        const Eigen::Vector3d a = vertex(triangles_[3 * i]) - centre;
        const Eigen::Vector3d b = vertex(triangles_[3 * i + 1]) - centre;
        const Eigen::Vector3d c = vertex(triangles_[3 * i + 2]) - centre;
        volume += a.dot(b.cross(c)) / 6;
        area += (b - a).cross(c - a).norm() / 2;
    }
    const double least = BodyMesh::kMinThickness * longest_side() * area / 2;
    if (volume < -least)
        fail(DEFREC_ERROR_ARGUMENT, name,
             " is inside out: its triangles are clockwise seen from outside, its volume is ",
             rounded(volume), " mm3, expected counter-clockwise triangles");
    if (volume <= least)
        fail(DEFREC_ERROR_ARGUMENT, name, " has no volume: its triangles enclose ", rounded(volume),
             " mm3, expected more than ", rounded(least));
}

void ClosedMesh::check_crossings(std::string_view name) const {
    CrossingSearch search(vertices_, triangles_, BodyMesh::kTolerance * max_coordinate());
    const std::optional<CrossingSearch::Found> found = search.find();
    if (found)
        fail(DEFREC_ERROR_ARGUMENT, name, " intersects itself: triangles ", found->first, " and ",
             found->second, " cross at ", text(found->place), ", expected none that do");
    if (search.has_given_up())
        fail(DEFREC_ERROR_ARGUMENT, name,
             " cannot be searched for triangles that cross: more than ", BodyMesh::kMaxPairs,
             " pairs lie close to each other, expected triangles that are less long and thin");
}

// Finds what check_crossings does not: parts that are inside out, lie in each other, or overlap
// such that sides meet sides.
void ClosedMesh::check_windings(std::string_view name) const {
    std::vector<Crossing> column;
    // Between the coordinates that meshes have.
    constexpr double kShift = 0.4637;
    for (int row = 0; row < BodyMesh::kOverlapColumns; ++row)
        for (int i = 0; i < BodyMesh::kOverlapColumns; ++i) {
            const double x = (i + kShift) / BodyMesh::kOverlapColumns,
                         y = (row + kShift) / BodyMesh::kOverlapColumns;
            check_column(low_.x() + x * (high_.x() - low_.x()),
                         low_.y() + y * (high_.y() - low_.y()), column, name);
        }
    for (size_t i = 0; i < triangle_count(); ++i) {
        const Eigen::Vector3d middle = (vertex(triangles_[3 * i]) + vertex(triangles_[3 * i + 1]) +
                                        vertex(triangles_[3 * i + 2])) /
                                       3;
        check_column(middle.x(), middle.y(), column, name);
    }
}

void ClosedMesh::check_column(double x, double y, std::vector<Crossing>& column,
                              std::string_view name) const {
    const auto is_wrong = [](int sum) { return sum < 0 || sum > 1; };
    const double reach = BodyMesh::kMinOverlap * BodyMesh::kTolerance * max_coordinate();
    find_column(x, y, column);
    int sum = 0;
    for (size_t i = 0; i + 1 < column.size(); ++i) {
        sum += column[i].sign;
        if (!is_wrong(sum) || column[i].z - column[i + 1].z < 2 * reach) continue;
        // The overlap of parts that touch is as thin as their coordinates are exact.
        const Eigen::Vector3d place(x, y, (column[i].z + column[i + 1].z) / 2);
        bool is_thick = true;
        for (const double dx : {-reach, reach})
            for (const double dy : {-reach, reach})
                is_thick = is_thick && is_wrong(winding(place + Eigen::Vector3d(dx, dy, 0)));
        if (!is_thick) continue;
        if (sum < 0)
            fail(DEFREC_ERROR_ARGUMENT, name, " is inside out at ", text(place),
                 ": a part's triangles are clockwise seen from outside, expected "
                 "counter-clockwise ones");
        fail(DEFREC_ERROR_ARGUMENT, name, " intersects itself: ", text(place), " lies in ", sum,
             " of its parts, expected one at most; the triangles of a cavity are "
             "counter-clockwise seen from the cavity");
    }
}

uint32_t ClosedMesh::Grid::column(double x_from_low) const {
    return static_cast<uint32_t>(std::clamp(x_from_low / side, 0.0, columns - 1.0));
}

uint32_t ClosedMesh::Grid::row(double y_from_low) const {
    return static_cast<uint32_t>(std::clamp(y_from_low / side, 0.0, rows - 1.0));
}

void ClosedMesh::make_grid() {
    const Eigen::Vector3d extent = high_ - low_;
    const auto count = static_cast<double>(triangle_count());
    // Two cells for four triangles, of which about half face up.
    grid_.side = std::max(std::sqrt(extent.x() * extent.y() / (count / 2)),
                          std::max(extent.x(), extent.y()) / count);
    const auto visit_cells = [&](const auto& take) {
        for (size_t i = 0; i < triangle_count(); ++i) {
            std::array<Eigen::Vector2d, 3> corners;
            for (size_t c = 0; c < 3; ++c)
                corners[c] = (vertex(triangles_[3 * i + c]) - low_).head<2>();
            const Eigen::Vector2d least = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
            const Eigen::Vector2d most = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
            const uint32_t first_row = grid_.row(least.y()), last_row = grid_.row(most.y());
            for (uint32_t row = first_row; row <= last_row; ++row) {
                double from = least.x(), to = most.x();
                if (first_row != last_row)
                    std::tie(from, to) = range_in_row(corners, row, grid_.side);
                const uint32_t last = grid_.column(to);
                for (uint32_t column = grid_.column(from); column <= last; ++column)
                    take(size_t{row} * grid_.columns + column, static_cast<uint32_t>(i));
            }
        }
    };
    // Long triangles meet many cells: then these are larger.
    for (;; grid_.side *= 2) {
        grid_.columns = static_cast<uint32_t>(extent.x() / grid_.side) + 1;
        grid_.rows = static_cast<uint32_t>(extent.y() / grid_.side) + 1;
        uint64_t entries = 0;
        visit_cells([&](size_t, uint32_t) { ++entries; });
        if (entries <= kMaxCellsPerTriangle * triangle_count()) break;
    }
    grid_.first.assign(size_t{grid_.columns} * grid_.rows + 1, 0);
    visit_cells([&](size_t cell, uint32_t) { ++grid_.first[cell + 1]; });
    std::partial_sum(grid_.first.begin(), grid_.first.end(), grid_.first.begin());
    grid_.triangles.resize(grid_.first.back());
    std::vector<uint32_t> next(grid_.first.begin(), grid_.first.end() - 1);
    visit_cells([&](size_t cell, uint32_t triangle) { grid_.triangles[next[cell]++] = triangle; });
}

// Calls visit(corners, sign) for each triangle that the line along z at x, y meets.
template <class Visit>
void ClosedMesh::visit_column(double x, double y, const Visit& visit) const {
    if (!(x >= low_.x() && x <= high_.x() && y >= low_.y() && y <= high_.y())) return;
    const size_t cell =
        size_t{grid_.row(y - low_.y())} * grid_.columns + grid_.column(x - low_.x());
    for (uint32_t i = grid_.first[cell]; i < grid_.first[cell + 1]; ++i) {
        const uint32_t* const index = &triangles_[3 * size_t{grid_.triangles[i]}];
        const std::array<Eigen::Vector3d, 3> corners = {vertex(index[0]), vertex(index[1]),
                                                        vertex(index[2])};
        int sign = 0;
        for (size_t from = 0; from < 3; ++from) {
            const size_t to = (from + 1) % 3;
            sign += edge_winding(corners[from], corners[to], index[from] > index[to], x, y);
        }
        if (sign != 0) visit(corners, sign);
    }
}

int ClosedMesh::winding(const Eigen::Vector3d& place) const {
    int sum = 0;
    visit_column(place.x(), place.y(),
                 [&](const std::array<Eigen::Vector3d, 3>& corners, int sign) {
                     if (plane_height(corners, place.x(), place.y()) > place.z()) sum += sign;
                 });
    return sum;
}

bool ClosedMesh::contains(const Eigen::Vector3d& place) const { return winding(place) > 0; }

void ClosedMesh::find_column(double x, double y, std::vector<Crossing>& column) const {
    column.clear();
    visit_column(x, y, [&](const std::array<Eigen::Vector3d, 3>& corners, int sign) {
        column.push_back({plane_height(corners, x, y), sign});
    });
    std::sort(column.begin(), column.end(), [](const Crossing& a, const Crossing& b) {
        return std::pair(-a.z, -a.sign) < std::pair(-b.z, -b.sign);
    });
}

// How much of the line along z at x, y lies inside, mm.
double ClosedMesh::inside_length(double x, double y, double from_z, double to_z,
                                 std::vector<Crossing>& column) const {
    find_column(x, y, column);
    double length = 0;
    int sum = 0;
    for (size_t i = 0; i + 1 < column.size(); ++i) {
        sum += column[i].sign;
        if (sum > 0)
            length +=
                std::max(0.0, std::min(to_z, column[i].z) - std::max(from_z, column[i + 1].z));
    }
    return length;
}

double ClosedMesh::inside_share(const Eigen::Vector3d& centre, double edge) const {
    const Eigen::Vector3d from = centre - Eigen::Vector3d::Constant(edge / 2);
    if ((from.array() > high_.array()).any() || (from.array() + edge < low_.array()).any())
        return 0;
    std::vector<Crossing> column;
    double length = 0;
    for (int y = 0; y < kShareLines; ++y)
        for (int x = 0; x < kShareLines; ++x)
            length += inside_length(from.x() + edge * (x + 0.5) / kShareLines,
                                    from.y() + edge * (y + 0.5) / kShareLines, from.z(),
                                    from.z() + edge, column);
    return std::min(1.0, length / (kShareLines * kShareLines * edge));
}

// Which share of a surface lies in the mesh or near it, were its coordinates that much larger.
double ClosedMesh::share_near(std::span<const defrec_surface_point> surface, double scale) const {
    const double reach = std::max(BodyMesh::kNear / scale, BodyMesh::kNearShare * longest_side());
    const size_t step = (surface.size() + BodyMesh::kMaxNearPoints - 1) / BodyMesh::kMaxNearPoints;
    constexpr int kLines = 2;  // on each side, along x and along y
    std::vector<Crossing> column;
    size_t count = 0, near = 0;
    for (size_t i = 0; i < surface.size(); i += step) {
        const Eigen::Vector3d place =
            Eigen::Map<const Eigen::Vector3f>(surface[i].position).cast<double>() / scale;
        bool is_near = contains(place);
        for (int y = -kLines; y <= kLines; ++y)
            for (int x = -kLines; x <= kLines && !is_near; ++x) {
                const double dx = x * reach / (kLines + 0.5), dy = y * reach / (kLines + 0.5);
                const double squared = reach * reach - dx * dx - dy * dy;
                if (squared < 0) continue;
                const double dz = std::sqrt(squared);
                is_near = inside_length(place.x() + dx, place.y() + dy, place.z() - dz,
                                        place.z() + dz, column) > 0;
            }
        ++count;
        near += is_near;
    }
    return static_cast<double>(near) / static_cast<double>(count);
}

void ClosedMesh::check_meets(std::span<const defrec_surface_point> surface,
                             std::string_view name) const {
    if (surface.empty()) return;
    const double share = share_near(surface, 1);
    if (share >= BodyMesh::kMinNearShare) return;
    // Metres and micrometres have a size that check_size refuses.
    constexpr double kCentimetre = 10;
    std::string hint;
    if (kCentimetre * longest_side() <= BodyMesh::kMaxSide &&
        share_near(surface, kCentimetre) >= BodyMesh::kMinNearShare)
        hint = "; its coordinates look like centimetres: times 10 it would meet the surface";
    Eigen::Vector3d low = Eigen::Map<const Eigen::Vector3f>(surface[0].position).cast<double>();
    Eigen::Vector3d high = low;
    for (const defrec_surface_point& point : surface) {
        const auto place = Eigen::Map<const Eigen::Vector3f>(point.position).cast<double>();
        low = low.cwiseMin(place);
        high = high.cwiseMax(place);
    }
    const double distance = (low - high_).cwiseMax(low_ - high).cwiseMax(0).norm();
    fail(DEFREC_ERROR_ARGUMENT, name, " lies beside the view: ", static_cast<int>(100 * share),
         " % of the surface lie in it or within ",
         rounded(std::max(BodyMesh::kNear, BodyMesh::kNearShare * longest_side())),
         " mm, expected 50 %; its box ", box_text(low_, high_), " is ", rounded(distance),
         " mm from the surface's ", box_text(low, high), hint);
}

}  // namespace defrec
