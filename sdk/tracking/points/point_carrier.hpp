// Carries points of the template frame into one frame: on the surface with it, beneath it with the
// elastic body.
#pragma once
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "sdk/body/body_motion.hpp"
#include "sdk/template/template.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"
#include "sdk/tracking/points/point_motion.hpp"

namespace defrec {

// The surface in a frame.
struct CarryingSurface {
    const Template& surface;
    std::span<const defrec_motion> motions;  // of the control points
    std::span<const float> vertices;         // xyz, mm
    const VertexConfidence& confidence;
    bool is_lost, grows;
    const DeepKnowledge& known;
};

struct CarriedPoint {
    Vec3<double> place;  // NaN for a point that is not finite
    SurfaceConfidence confidence;
};

// A point with all that stays the same from frame to frame, with one template and body.
struct PreparedPoint {
    Vec3<double> at_rest;
    double surface_share = 1;  // 1: on the surface or in front of it; 0: beneath it
    NearVertex near;           // of the surface
    PointAnchor anchor;        // where surface_share is above 0
    int32_t vertex = -1;       // as Template::vertex_at
    uint32_t deep = kNotDeep;  // which deep point has the rest
    bool is_finite = false;

    static constexpr uint32_t kNotDeep = UINT32_MAX;
};
// The rest of a point that does not lie on the surface.
struct DeepPoint {
    int32_t vertex = -1;  // the nearest
    double depth_mm = 0;  // beneath the surface; negative: in front of it
    BodyPoint in_body;    // where there is a body
};
struct PreparedPoints {
    std::span<const PreparedPoint> points;
    std::span<const DeepPoint> deep;
};
// As many as there is room for, but for what deep points have; returns how many of these there are.
// helpers: as PointCarrier::carry has it.
size_t prepare_points(const Template& surface, const double* xyz, const Services* helpers,
                      std::span<PreparedPoint> points);
// The rest. body: null where there is none. deep: with room for those.
void prepare_deep_points(const Template& surface, const Body* body, const Services* helpers,
                         std::span<PreparedPoint> points, std::span<DeepPoint> deep);

// Carries the points of a frame; what they share is computed when it is first asked for. Any
// thread.
class PointCarrier {
  public:
    // For another frame; nobody may be asking.
    void reset();
    // body: the one that the points were prepared with. helpers: whose threads take part where
    // there is much to do; may be null. carried: called with each point's index and what became of
    // it, on any thread; must not throw.
    void carry(const CarryingSurface& frame, const PreparedPoints& prepared,
               const std::shared_ptr<const Body>& body, const Services* helpers,
               const std::function<void(size_t, const CarriedPoint&)>& carried) const;

  private:
    struct Shared;
    std::shared_ptr<const Shared> shared(const CarryingSurface& frame,
                                         const std::shared_ptr<const Body>& body,
                                         const Services* helpers) const;

    mutable std::mutex mutex_;
    mutable std::shared_ptr<const Shared> shared_;
};

}  // namespace defrec
