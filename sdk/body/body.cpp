// See body.hpp.
#include "sdk/body/body.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/base/util/error.hpp"
#include "sdk/body/body_shape.hpp"
#include "sdk/body/decisions.hpp"

namespace defrec {

std::shared_ptr<const Body> Body::make(const BodySurface& surface,
                                       const BodyDescription& description,
                                       const std::function<bool()>& is_wanted) {
    const double step = handle_step(surface);
    std::vector<std::vector<Handle>> handles = make_handles(surface, step);
    auto body = std::make_shared<Body>();
    body->vertices_ = surface.vertices.size();
    for (size_t piece = 0; piece < surface.pieces; ++piece) {
        if (handles[piece].empty())
            fail(DEFREC_ERROR_UNSUPPORTED, "piece ", piece, " of the surface has no vertex");
        const BodyShape shape(surface, description, handles, piece, step);
        BodyPiece made(handles[piece], Lattice(shape.request(is_wanted)), description.poisson_ratio,
                       shape.support(), is_wanted);
        if (!made.is_complete()) return nullptr;
        body->pieces_.push_back(std::move(made));
        body->steps_.push_back(step);
    }
    return body;
}

BodyPoint Body::find(const Eigen::Vector3d& point, uint8_t piece) const {
    const BodyPiece& part = pieces_[piece];
    const std::span<const Handle> handles = part.handles();
    BodyPoint found;
    found.piece = piece;
    // The nearest handles.
    std::array<double, BodyPoint::kHandles> squared;
    squared.fill(1e30);
    for (size_t i = 0; i < handles.size(); ++i) {
        const double distance = (handles[i].position - point).squaredNorm();
        if (distance >= squared.back()) continue;
        size_t at = squared.size() - 1;
        for (; at > 0 && squared[at - 1] > distance; --at) {
            squared[at] = squared[at - 1];
            found.handle[at] = found.handle[at - 1];
        }
        squared[at] = distance;
        found.handle[at] = static_cast<int32_t>(i);
    }
    const double width = 2 * steps_[piece] * steps_[piece];
    double sum = 0;
    for (size_t k = 0; k < squared.size(); ++k)
        sum += found.weight[k] =
            static_cast<float>(std::exp(std::min(0.0, (squared[0] - squared[k])) / width));
    for (float& weight : found.weight) weight = static_cast<float>(weight / sum);
    found.depth_mm = 0;
    for (size_t k = 0; k < squared.size(); ++k) {
        const Handle& handle = handles[static_cast<size_t>(found.handle[k])];
        found.depth_mm -= found.weight[k] * (point - handle.position).dot(handle.normal);
    }
    found.fade = std::exp(-std::abs(found.depth_mm) / part.lattice().step());
    found.place = part.lattice().find_near(point, decisions::BodyCells::kReach);
    if (found.place.cell >= 0)
        found.beyond_mm = (part.lattice().position(found.place) - point).norm();
    return found;
}

}  // namespace defrec
