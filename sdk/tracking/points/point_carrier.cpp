// See point_carrier.hpp.
#include "sdk/tracking/points/point_carrier.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sdk/base/os/helped_loop.hpp"
#include "sdk/base/os/services.hpp"
#include "sdk/body/decisions.hpp"
#include "sdk/body/deep_motion.hpp"
#include "sdk/template/nearest_surface.hpp"
#include "sdk/tracking/decisions/points.hpp"
#include "sdk/tracking/evidence/vertex_runs.hpp"

namespace defrec {
namespace {

using decisions::BeneathSurface;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Eigen::Vector3d as_eigen(const Vec3<double>& v) { return {v.x, v.y, v.z}; }
Vec3<double> as_vec(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

double smooth_step(double x) {
    const double t = std::clamp(x, 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

// By threads that help, where there are at least `fewest`.
template <class Function>
void for_each_point(size_t count, size_t fewest, const Services* helpers,
                    const Function& function) {
    constexpr size_t kRun = 128;
    helped_runs(count >= fewest ? helpers : nullptr, count, kRun, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) function(i);
    });
}

double step_mm(const TemplateData& data, int32_t vertex) {
    return data.grid.spacing *
           static_cast<double>(data.vertices[static_cast<size_t>(vertex)].position[2]) /
           data.camera.fx;
}

int32_t nearest_vertex(const Template& surface, const Body* body, const BodyPoint& in_body,
                       const Vec3<double>& at) {
    const TemplateData& data = surface.data();
    if (body == nullptr) {
        const double xyz[3] = {at.x, at.y, at.z};
        const int32_t under = surface.vertex_at(xyz);
        return under >= 0 ? under
                          : static_cast<int32_t>(surface.nearest_surface().beside(data, at).vertex);
    }
    // Squares of what is very far away are not finite: any vertex does then.
    const std::span<const Handle> handles = body->pieces()[in_body.piece].handles();
    auto best = static_cast<int32_t>(handles[0].vertices[0]);
    double least = std::numeric_limits<double>::infinity();
    for (const int32_t handle : in_body.handle)
        for (const uint32_t vertex : handles[static_cast<size_t>(handle)].vertices) {
            const Vec3<double> d = load3<double>(data.vertices[vertex].position) - at;
            if (dot(d, d) >= least) continue;
            least = dot(d, d);
            best = static_cast<int32_t>(vertex);
        }
    return best;
}

}  // namespace

namespace {

constexpr size_t kFewestToPrepare = 256;

double depth_under(const TemplateData& data, int32_t vertex, const Vec3<double>& at) {
    const defrec_surface_point& over = data.vertices[static_cast<size_t>(vertex)];
    return -dot(at - load3<double>(over.position), load3<double>(over.normal));
}

bool is_on_surface(const TemplateData& data, int32_t vertex, const Vec3<double>& at) {
    if (vertex < 0) return false;
    const double step = step_mm(data, vertex);
    const Vec3<double> d = at - load3<double>(data.vertices[static_cast<size_t>(vertex)].position);
    return dot(d, d) <= BeneathSurface::kNearSteps * BeneathSurface::kNearSteps * step * step &&
           std::abs(depth_under(data, vertex, at)) <=
               BeneathSurface::kOnSurfaceSteps * step + BeneathSurface::kOnSurface;
}

// All but what a deep point has; false: it is one.
bool prepare_point(const Template& surface, const double xyz[3], PreparedPoint& point) {
    point = {};
    point.is_finite = std::isfinite(xyz[0]) && std::isfinite(xyz[1]) && std::isfinite(xyz[2]);
    if (!point.is_finite) return true;
    point.at_rest = {xyz[0], xyz[1], xyz[2]};
    point.vertex = surface.vertex_at(xyz);
    point.near = near_vertex(surface, point.vertex, xyz);
    if (!is_on_surface(surface.data(), point.vertex, point.at_rest)) return false;
    point.anchor = surface.anchor_of(xyz);
    return true;
}

DeepPoint prepare_deep_point(const Template& surface, const Body* body, PreparedPoint& point) {
    const TemplateData& data = surface.data();
    const double xyz[3] = {point.at_rest.x, point.at_rest.y, point.at_rest.z};
    DeepPoint deep;
    if (body != nullptr) deep.in_body = body->find(as_eigen(point.at_rest), surface.piece_at(xyz));
    deep.vertex = nearest_vertex(surface, body, deep.in_body, point.at_rest);
    deep.depth_mm = depth_under(data, deep.vertex, point.at_rest);
    if (point.vertex >= 0) {
        const double under = depth_under(data, point.vertex, point.at_rest);
        if (!(std::abs(deep.depth_mm) < std::abs(under))) deep.depth_mm = under;
    }
    const double beneath =
        deep.depth_mm -
        (BeneathSurface::kOnSurfaceSteps * step_mm(data, deep.vertex) + BeneathSurface::kOnSurface);
    point.surface_share = 1 - smooth_step(beneath / BeneathSurface::kBlend);
    if (point.surface_share > 0) point.anchor = surface.anchor_of(xyz);
    return deep;
}

}  // namespace

size_t prepare_points(const Template& surface, const double* xyz, const Services* helpers,
                      std::span<PreparedPoint> points) {
    for_each_point(points.size(), kFewestToPrepare, helpers, [&](size_t i) {
        const bool is_whole = prepare_point(surface, xyz + 3 * i, points[i]);
        points[i].deep = is_whole ? PreparedPoint::kNotDeep : 0;
    });
    uint32_t deep = 0;
    for (PreparedPoint& point : points)
        if (point.deep != PreparedPoint::kNotDeep) point.deep = deep++;
    return deep;
}

void prepare_deep_points(const Template& surface, const Body* body, const Services* helpers,
                         std::span<PreparedPoint> points, std::span<DeepPoint> deep) {
    if (deep.empty()) return;
    for_each_point(points.size(), kFewestToPrepare, helpers, [&](size_t i) {
        if (points[i].deep != PreparedPoint::kNotDeep)
            deep[points[i].deep] = prepare_deep_point(surface, body, points[i]);
    });
}

namespace {

// Beneath a surface without a body: points move as the least deformed part of what is seen, and
// near the surface with that.
class RigidBeneath {
  public:
    explicit RigidBeneath(const CarryingSurface& frame) {
        const TemplateData& data = frame.surface.data();
        constexpr double kNothing = 1e-6;
        for (size_t piece = 0; piece < data.pieces(); ++piece) {
            std::vector<size_t> own;
            for (size_t i = 0; i < data.vertices.size(); ++i)
                if (frame.surface.vertex_pieces()[i] == piece) own.push_back(i);
            const size_t step = std::max<size_t>(1, own.size() / BeneathSurface::kRigidVertices),
                         count = own.size() / step;
            Eigen::Matrix3Xd rest(3, count), now(3, count);
            Eigen::VectorXd weight(count);
            for (size_t k = 0; k < count; ++k) {
                const size_t i = own[k * step];
                const auto column = static_cast<Eigen::Index>(k);
                rest.col(column) =
                    Eigen::Map<const Eigen::Vector3f>(data.vertices[i].position).cast<double>();
                now.col(column) =
                    Eigen::Map<const Eigen::Vector3f>(&frame.vertices[3 * i]).cast<double>();
                weight[column] =
                    evidence_of(static_cast<double>(frame.confidence.seen_errors()[i]));
            }
            if (!(weight.sum() > kNothing)) weight.setOnes();  // the surface stays where it was
            motions_.push_back(fit_rigid_robust(rest, now, weight, decisions::DeepMotion::kFloor));
        }
    }
    BodyMotion::Moved move(const CarryingSurface& frame, const DeepPoint& point,
                           const Vec3<double>& at_rest) const {
        const auto vertex = static_cast<size_t>(point.vertex);
        const Eigen::Isometry3d& motion = motions_[frame.surface.vertex_pieces()[vertex]];
        const Eigen::Vector3d
            rest = Eigen::Map<const Eigen::Vector3f>(frame.surface.data().vertices[vertex].position)
                       .cast<double>(),
            left = Eigen::Map<const Eigen::Vector3f>(&frame.vertices[3 * vertex]).cast<double>() -
                   motion * rest;
        const double error = static_cast<double>(frame.confidence.seen_errors()[vertex]),
                     evidence = evidence_of(error);
        BodyMotion::Moved moved;
        moved.place =
            motion * as_eigen(at_rest) +
            evidence * std::exp(-std::max(0.0, point.depth_mm) / BeneathSurface::kRigidFade) * left;
        moved.surface_mm2 = error * error;
        moved.deformation_mm2 = left.squaredNorm();
        moved.evidence = evidence;
        moved.activity_mm2 = left.squaredNorm();
        return moved;
    }

  private:
    std::vector<Eigen::Isometry3d> motions_;
};

}  // namespace

struct PointCarrier::Shared {
    std::shared_ptr<const Body> body;
    std::optional<BodyMotion> in_body;
    std::optional<RigidBeneath> rigid;
};

void PointCarrier::reset() { shared_.reset(); }

std::shared_ptr<const PointCarrier::Shared> PointCarrier::shared(
    const CarryingSurface& frame, const std::shared_ptr<const Body>& body,
    const Services* helpers) const {
    const std::lock_guard lock(mutex_);
    if (shared_ != nullptr && shared_->body == body) return shared_;
    auto made = std::make_shared<Shared>();
    made->body = body;
    if (body != nullptr)
        made->in_body.emplace(body, SurfaceNow{frame.vertices, frame.confidence.seen_errors()},
                              frame.known, helpers);
    else
        made->rigid.emplace(frame);
    shared_ = made;
    return made;
}

namespace {

CarriedPoint carry_on_surface(const CarryingSurface& frame, const PreparedPoint& point) {
    if (frame.grows && point.vertex < 0) {
        const PointMotion moves =
            point_motion(frame.surface, frame.motions, point.at_rest, frame.grows);
        if (moves.is_near) {
            const Vec3<double> place = apply(moves.motion, point.at_rest);
            return {place,
                    confidence_beside(frame.confidence, moves.vertex, moves.distance_mm, place)};
        }
    }
    return {apply(frame.surface.motion_of(point.anchor, frame.motions.data()), point.at_rest),
            confidence_at(frame.confidence, point.near)};
}

SurfaceConfidence beneath_confidence(const CarryingSurface& frame, const DeepPoint& point,
                                     const BodyMotion::Moved& moved) {
    using Share = decisions::BeneathError;
    const auto vertex = static_cast<size_t>(point.vertex);
    const double unseen = 1 - moved.evidence;
    const double depths = std::clamp(point.depth_mm, 0.0, Share::kDeepest) / Share::kDepth;
    const double of_model =
        (Share::kConstant + depths * depths) *
            (Share::kDeformation * moved.deformation_mm2 + Share::kShift * moved.shift_mm2) +
        Share::kChoice * moved.choice_mm2 + Share::kFloor +
        unseen * unseen * (Share::kActivity * moved.activity_mm2 + Share::kUnseen) +
        Share::kBeyond * point.in_body.beyond_mm * point.in_body.beyond_mm;
    const auto common = static_cast<double>(frame.confidence.common_at(vertex));
    const double of_surface =
        (frame.is_lost ? 1 : Share::kSurface) * std::max(0.0, moved.surface_mm2 - common) + common;
    const double seen = static_cast<double>(frame.confidence.seen_errors()[vertex]),
                 expected = static_cast<double>(frame.confidence.expected_error[vertex]),
                 of_lag = std::max(0.0, expected * expected - seen * seen);
    SurfaceConfidence at;
    at.evidence = 0;
    at.expected_error = std::sqrt(of_surface + of_model + of_lag);
    const float* covariance = &frame.confidence.covariance[6 * vertex];
    const double trace = static_cast<double>(covariance[0]) + static_cast<double>(covariance[3]) +
                         static_cast<double>(covariance[5]);
    for (size_t i = 0; i < 6; ++i)
        at.covariance[i] =
            static_cast<double>(covariance[i]) * (of_surface + of_lag) / std::max(trace, 1e-9) +
            (i == 0 || i == 3 || i == 5 ? of_model / 3 : 0);
    at.status =
        !frame.is_lost && moved.evidence >= BeneathSurface::kMinEvidence &&
                of_surface + of_model <= BeneathSurface::kMaxError * BeneathSurface::kMaxError &&
                point.in_body.beyond_mm <= BeneathSurface::kMaxBeyond
            ? DEFREC_POINT_EXTRAPOLATED
            : DEFREC_POINT_UNKNOWN;
    return at;
}

SurfaceConfidence mixed(const SurfaceConfidence& a, const SurfaceConfidence& b, double share) {
    SurfaceConfidence at;
    at.status = std::max(a.status, b.status);
    at.evidence = 0;
    for (size_t i = 0; i < 6; ++i)
        at.covariance[i] = (1 - share) * a.covariance[i] + share * b.covariance[i];
    at.expected_error = std::sqrt(at.covariance[0] + at.covariance[3] + at.covariance[5]);
    return at;
}

CarriedPoint unknown_point() {
    CarriedPoint carried;
    carried.place = {kNaN, kNaN, kNaN};
    return carried;
}

}  // namespace

void PointCarrier::carry(const CarryingSurface& frame, const PreparedPoints& prepared,
                         const std::shared_ptr<const Body>& body, const Services* helpers,
                         const std::function<void(size_t, const CarriedPoint&)>& carried) const {
    const auto needs_shared = [&](const PreparedPoint& point) {
        return point.is_finite && point.surface_share < 1;
    };
    const std::span<const PreparedPoint> points = prepared.points;
    std::shared_ptr<const Shared> common;
    if (!prepared.deep.empty() && std::any_of(points.begin(), points.end(), needs_shared))
        common = shared(frame, body, helpers);
    const auto carry_one = [&](const PreparedPoint& point) -> CarriedPoint {
        if (!point.is_finite) {
            CarriedPoint unknown = unknown_point();
            const double nowhere[3] = {kNaN, kNaN, kNaN};
            unknown.confidence = confidence_at(frame.surface, frame.confidence, nowhere);
            std::fill_n(unknown.confidence.covariance, 6, kNaN);
            return unknown;
        }
        const double share = point.surface_share;
        CarriedPoint on_surface, beneath;
        if (share > 0) {
            on_surface = carry_on_surface(frame, point);
            if (share >= 1) return on_surface;
        }
        const DeepPoint& deep = prepared.deep[point.deep];
        const BodyMotion::Moved moved =
            common->in_body ? common->in_body->move(deep.in_body, as_eigen(point.at_rest))
                            : common->rigid->move(frame, deep, point.at_rest);
        beneath.place = as_vec(moved.place);
        beneath.confidence = beneath_confidence(frame, deep, moved);
        if (share <= 0) return beneath;
        return {share * on_surface.place + (1 - share) * beneath.place,
                mixed(on_surface.confidence, beneath.confidence, 1 - share)};
    };
    constexpr size_t kFewest = 1024;
    for_each_point(points.size(), kFewest, helpers,
                   [&](size_t i) { carried(i, carry_one(points[i])); });
}

}  // namespace defrec
