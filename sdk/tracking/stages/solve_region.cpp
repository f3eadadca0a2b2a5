// See solve_region.hpp.
#include "sdk/tracking/stages/solve_region.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backends/shared/motion.hpp"
#include "sdk/template/nearest_nodes.hpp"

namespace defrec {
namespace {

using decisions::MapPart;

// How much more a first view without holes would have.
double fullness(const TemplateData& data) {
    const auto cells = static_cast<double>(data.node_grid.cells());
    return cells / static_cast<double>(std::max<uint64_t>(1, data.first_counts().nodes));
}

size_t edge_room(const TemplateData& data) {
    return static_cast<size_t>(MapPart::kRoom * fullness(data) *
                               static_cast<double>(data.first_counts().edges));
}

size_t point_room(const TemplateData& data, size_t points) {
    return static_cast<size_t>(MapPart::kRoom * fullness(data) * static_cast<double>(points) *
                               static_cast<double>(data.first_counts().vertices) /
                               static_cast<double>(std::max<size_t>(1, data.vertices.size())));
}

// Moved by one control point alone.
template <class Item>
Item moved_by(Item item, int32_t node) {
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
        item.node[k] = node;
        item.weight[k] = k == 0 ? 1.f : 0.f;
    }
    return item;
}

}  // namespace

bool SolveRegion::suits(const TemplateData& data) {
    return !data.parts.empty() && MapPart::kSuits.numerator * edge_room(data) <
                                      MapPart::kSuits.denominator * data.edges.size();
}

SolveRegion::SolveRegion(const TemplateData& data, std::span<const defrec_surface_point> points)
    : camera_(data.camera),
      width_(data.width),
      height_(data.height),
      spacing_mm_(data.node_spacing_mm),
      nodes_(data.nodes.size() / 3),
      edges_(data.edges),
      points_(points.begin(), points.end()),
      landmarks_(data.landmark_points),
      patches_(data.patches),
      solved_(nodes_, 0) {
    for (const defrec_edge& edge : edges_) edge_weights_ += double{edge.weight};
    lists_.nodes = data.nodes;
    for (size_t i = 0; i < kPair; ++i)
        lists_.nodes.insert(lists_.nodes.end(),
                            {static_cast<float>(static_cast<double>(i) * spacing_mm_), 0, 100});
    lists_.edges.resize(edge_room(data));
    lists_.points.resize(std::min(points.size(), point_room(data, points.size())));
    lists_.landmarks = landmarks_;
    lists_.patches = patches_;
}

// Visits the control points at most so far outside of the image until one visit returns false.
template <class Function>
void SolveRegion::near_image(std::span<const defrec_motion> motions, const Margin& margin,
                             const Function& visit) const {
    const std::span<const float> rest(lists_.nodes);
    const double share_px = margin.share * (width_ + height_) / 2;
    for (size_t i = 0; i < nodes_; ++i) {
        const Vec3<double> p = node_position(rest, motions, i);
        if (!(p.z > 1)) continue;
        const double u = camera_.fx * p.x / p.z + camera_.cx,
                     v = camera_.fy * p.y / p.z + camera_.cy;
        const double aside = margin.spacings * spacing_mm_ * camera_.fx / p.z + share_px;
        if (u < -aside || v < -aside || u > width_ + aside || v > height_ + aside) continue;
        if (!visit(i)) return;
    }
}

bool SolveRegion::covers(std::span<const defrec_motion> motions, const Margin& margin) const {
    bool all = true;
    near_image(motions, margin, [&](size_t node) { return all = solved_[node] != 0; });
    return all;
}

// Control points near the image move what lies in it or may come into it: a frame begins with them.
// More are taken when a part is chosen, as there is room. Choosing may take half as long as a
// frame; the wider, the rarer: wider where a part did not last, narrower where it lasted.
SolveRegion::Choice SolveRegion::choose(std::span<const defrec_motion> motions) {
    ++frames_;
    if (is_chosen_ && covers(motions, {MapPart::kNeededSpacings, MapPart::kNeededShare}))
        return Choice::kSame;
    if (is_chosen_ && frames_ < MapPart::kShort)
        slack_ = std::min(slack_ + 1, MapPart::kSlack.size() - 1);
    if (is_chosen_ && frames_ > MapPart::kLong) slack_ = std::max<size_t>(slack_, 2) - 1;
    frames_ = 0;
    for (size_t left = slack_ + 1; left-- > 0;) {
        std::fill(solved_.begin(), solved_.end(), uint8_t{0});
        const Margin margin{MapPart::kNeededSpacings,
                            MapPart::kNeededShare + MapPart::kSlack[left]};
        near_image(motions, margin, [&](size_t node) {
            solved_[node] = 1;
            return true;
        });
        is_chosen_ = fill();
        if (is_chosen_) return Choice::kOther;
    }
    return Choice::kTooLarge;
}

template <class Item>
bool SolveRegion::is_solved(const Item& item) const {
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
        if (item.weight[k] > 0 && solved_[static_cast<size_t>(item.node[k])] == 0) return false;
    return true;
}

// What is left out of a list without room for fewer follows a control point near it that is solved:
// a match of it may still be given.
template <class Item>
void SolveRegion::fill_items(const std::vector<Item>& all, std::span<const int32_t> followed,
                             std::vector<Item>& items) const {
    for (size_t i = 0; i < all.size(); ++i)
        items[i] = is_solved(all[i])
                       ? all[i]
                       : moved_by(all[i], followed[static_cast<size_t>(all[i].node[0])]);
}

// Per control point: the nearest of a sample of those that are solved.
std::vector<int32_t> SolveRegion::followed_nodes() const {
    constexpr size_t kSample = 128;
    std::vector<int32_t> sample;
    for (size_t i = 0; i < nodes_; ++i)
        if (solved_[i] != 0) sample.push_back(static_cast<int32_t>(i));
    const size_t step = sample.size() / kSample + 1;
    std::vector<int32_t> followed(nodes_);
    for (size_t i = 0; i < nodes_; ++i) {
        float least = std::numeric_limits<float>::infinity();
        const Vec3<float> place = load3<float>(&lists_.nodes[3 * i]);
        for (size_t k = 0; k < sample.size(); k += step) {
            const Vec3<float> d =
                load3<float>(&lists_.nodes[3 * static_cast<size_t>(sample[k])]) - place;
            if (dot(d, d) >= least) continue;
            least = dot(d, d);
            followed[i] = sample[k];
        }
    }
    return followed;
}

// False where there is too much.
bool SolveRegion::fill() {
    size_t count = 0;
    double weights = 0;
    for (const defrec_edge& edge : edges_) {
        if (solved_[static_cast<size_t>(edge.a)] == 0 || solved_[static_cast<size_t>(edge.b)] == 0)
            continue;
        if (count + 1 >= lists_.edges.size()) return false;
        lists_.edges[count++] = edge;
        weights += double{edge.weight};
    }
    const auto nodes = static_cast<double>(nodes_);
    const double left = edge_weights_ * (nodes + kPair) / nodes - weights;
    const auto room = static_cast<double>(lists_.edges.size() - count);
    std::fill(lists_.edges.begin() + static_cast<std::ptrdiff_t>(count), lists_.edges.end(),
              defrec_edge{static_cast<int32_t>(nodes_), static_cast<int32_t>(nodes_ + 1),
                          static_cast<float>(left / room)});

    count = 0;
    for (const defrec_surface_point& point : points_) {
        if (!is_solved(point)) continue;
        if (count == lists_.points.size()) return false;
        lists_.points[count++] = point;
    }
    // The rest of the room: behind the camera, spread over what is solved.
    defrec_surface_point behind{};
    behind.position[2] = -1000;
    behind.normal[2] = -1;
    for (size_t node = 0; count < lists_.points.size(); node = (node + 1) % nodes_)
        if (solved_[node] != 0)
            lists_.points[count++] = moved_by(behind, static_cast<int32_t>(node));

    const std::vector<int32_t> followed = followed_nodes();
    fill_items(landmarks_, followed, lists_.landmarks);
    fill_items(patches_, followed, lists_.patches);
    return true;
}

}  // namespace defrec
