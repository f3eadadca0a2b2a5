// See stale_vertices.hpp.
#include "sdk/tracking/monitors/stale_vertices.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "sdk/base/util/median.hpp"
#include "sdk/tracking/decisions/images.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"

namespace defrec {
void StaleVertices::find(const Rig& rig, std::array<FrozenRegions, 2>& blocks,
                         const std::array<bool, 2>& is_rectified,
                         std::span<const defrec_surface_sample> before,
                         std::span<const defrec_surface_sample> now,
                         std::span<const uint8_t> seen_left) {
    clear();
    if (!blocks[0].any() && !blocks[1].any()) return;
    steps_.clear();
    size_t inside = 0;
    const auto in_blocks = [&](size_t vertex, auto&& is_so) {
        bool is_so_in[2] = {};
        for (int view = 0; view < (seen_left.empty() ? 2 : 1); ++view) {
            const std::optional<Eigen::Vector2d> at =
                rig.pixel_of(view, now[vertex].position, is_rectified[static_cast<size_t>(view)]);
            is_so_in[view] = at && is_so(blocks[static_cast<size_t>(view)], *at);
        }
        return static_cast<uint8_t>((is_so_in[0] ? kLeftView : 0) | (is_so_in[1] ? kRightView : 0));
    };
    for (size_t i = 0; i < now.size(); ++i) {
        if (now[i].observation == DEFREC_OUTSIDE) continue;
        ++inside;
        const bool is_seen =
            seen_left.empty() ? now[i].observation == DEFREC_OBSERVED : seen_left[i] != 0;
        if (is_seen && in_blocks(i, [](const FrozenRegions& of_view, const Eigen::Vector2d& at) {
                           return of_view.is_frozen(at.x(), at.y());
                       }) == 0)
            steps_.push_back(squared_step(rig.camera(), before[i], now[i]));
    }
    if (static_cast<double>(steps_.size()) <=
        decisions::FrozenImages::kMinSeen * static_cast<double>(inside))
        return;
    const float moved = std::sqrt(median_in_place(steps_));
    for (FrozenRegions& of_view : blocks) of_view.others_moved(moved);
    size_t stale = 0;
    views_.resize(now.size());
    for (size_t i = 0; i < now.size(); ++i) {
        views_[i] = in_blocks(i, [](const FrozenRegions& of_view, const Eigen::Vector2d& at) {
            return of_view.is_stale(at.x(), at.y());
        });
        stale += views_[i] != 0 && now[i].observation != DEFREC_OUTSIDE;
    }
    share_ = static_cast<double>(stale) / static_cast<double>(inside);
    if (stale == 0) views_.clear();
}

void StaleVertices::set_all(size_t vertices) {
    views_.assign(vertices, kBothViews);
    share_ = 1;
}

void StaleVertices::clear() {
    views_.clear();
    share_ = 0;
}

}  // namespace defrec
