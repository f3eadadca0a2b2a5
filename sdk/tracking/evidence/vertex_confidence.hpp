// Where a template's surface is in one frame, and how far to believe it. Pure functions; the
// tracker holds the memory.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "backends/shared/motion.hpp"
#include "sdk/tracking/evidence/depth_speed.hpp"
#include "sdk/tracking/evidence/map_distance.hpp"
#include "sdk/tracking/evidence/photometric_evidence.hpp"
#include "sdk/tracking/evidence/sliding_sides.hpp"
#include "sdk/tracking/evidence/tissue_colours.hpp"
#include "sdk/tracking/frame/given_disparity.hpp"
#include "sdk/tracking/frame/rig_estimate.hpp"

namespace defrec {

using SurfaceSamples = std::span<const defrec_surface_sample>;

// What the functions below need of a template, worked out once for all its frames. The data must
// outlive it.
struct SurfaceModel {
    explicit SurfaceModel(const TemplateData& data);

    const TemplateData* data;
    MapGrids grids;
    // Per vertex:
    std::vector<float> step_mm;     // a step of the grid that it came with
    std::vector<float> support_mm;  // how far the template's own disparity was extrapolated
    CheckedVertices checked;
    std::vector<uint8_t> is_at_edge;  // beside a cut, or another piece of the first view
    // How far the vertices of another piece beside it lie in depth, whose border is known to some
    // pixels only; mm, 0 where there are none.
    std::vector<float> border_mm;
    SurfaceShear shear;
    CutSides cut_sides;
    Eigen::Matrix4Xf centred;  // position less the centre, and 0
    Eigen::Vector3d centre;    // mean position
};

// How sure a vertex is, from what was observed of it and round it.
struct VertexConfidence {
    std::vector<uint8_t> status;        // DEFREC_POINT_*
    std::vector<uint8_t> evidence;      // DEFREC_EVIDENCE_*
    std::vector<float> covariance;      // xx, xy, xz, yy, yz, zz each, mm^2, rectified camera
    std::vector<float> expected_error;  // mm, root of the covariance's trace
    // Whether the image has another colour there than the tissue; of no vertex: it is not known.
    std::vector<uint8_t> covered;
    // Working memory, per cell of the grids: steps to the nearest vertex with photometric evidence,
    // and to the nearest one with depth that agrees as well.
    std::vector<float> to_photometric, to_observed;
    MapGrids::Workspace spreading[2];
    std::vector<float> rig_px2;  // working memory, per vertex: disparity that the rig gets wrong
    std::vector<float> cut_side_mm;  // working memory, per vertex: CutSides::expect()
    // Working memory, per vertex: SurfaceShear's at(), spread(), and error_between() where nothing
    // shows where it is.
    std::vector<Shear> sheared, beside_sheared;
    std::vector<float> between_mm;
    // expected_error without what add_unseen_lag() added; empty: that added nothing.
    std::vector<float> seen_error;

    // The part of the squared expected error, mm^2, that is alike at all vertices: a mean of many
    // errs by it as each does. Empty: there is none.
    std::vector<float> common_mm2;

    float common_at(size_t vertex) const { return common_mm2.empty() ? 0 : common_mm2[vertex]; }
    // Estimates from the surface go by these: a lag errs alike everywhere.
    const std::vector<float>& seen_errors() const {
        return seen_error.empty() ? expected_error : seen_error;
    }
};

// Bits of FrameEvidence::stale_views.
inline constexpr uint8_t kLeftView = DEFREC_VIEW_LEFT, kRightView = DEFREC_VIEW_RIGHT,
                         kBothViews = kLeftView | kRightView;
// What a frame says of the surface. Disparity is what a rig that is late or out of calibration gets
// wrong.
struct FrameEvidence {
    const FrameOutput& output;
    const PhotometricEvidence& photometric;
    float mean_residual_mm;  // of live depth, of its absolute values
    const RigEstimate& rig;
    SurfaceSamples last_samples;   // of the frame before; empty where there is none
    bool uses_depth = true;        // else the surface was followed by the left image alone
    bool is_interlaced = false;    // rows of an image are of two times
    double baseline_drift_px = 0;  // by which disparities are off
    // Per vertex, kLeftView and kRightView: that view shows it as it was. Empty: none does.
    std::span<const uint8_t> stale_views = {};
    // Per vertex, mm: SlipMonitor::doubts(). Shorter in the frame in which tissue joins.
    std::span<const float> slip_doubts = {};
    std::span<const uint8_t> unconfirmed = {};  // SlipMonitor::unconfirmed()
    // Disparity of the application, by which the surface was followed; and how far off the images
    // show it, px.
    KeptDisparity given_disparity = {};
    float given_error_px = 0;
    // ContradictedDepth::doubt_mm(); empty: nothing was contradicted.
    std::span<const float> contradicted_mm = {};
    const DepthSpeed* depth_speed = nullptr;  // of the frames before; nullptr: there are none
    // nullptr: no vertex is covered.
    const TissueColours* colours = nullptr;
};
// How far a vertex moved in the image, px^2.
float squared_step(const defrec_camera& camera, const defrec_surface_sample& from,
                   const defrec_surface_sample& to);

// Adds what a lag of the right view that cannot be seen yet (RigEstimate::unseen_lag_frames) would
// do to the depth of each vertex that is not unknown. before: the samples of the frame before.
void add_unseen_lag(const defrec_camera& camera, float lag_frames, SurfaceSamples before,
                    SurfaceSamples now, VertexConfidence& confidence);

// Once before each estimate, which it spares what does not wait for a frame's results.
void begin_confidence(const SurfaceModel& model, VertexConfidence& confidence);
// helpers: whose threads take part; nullptr: none. beside: called once on the way, by any of them,
// where most would have nothing to do; must not throw.
void estimate_confidence(const SurfaceModel& model, const FrameEvidence& evidence,
                         const Services* helpers, const std::function<void()>& beside,
                         VertexConfidence& confidence);
// Confidence of a frame in which the surface was not found: every vertex is unknown, with errors
// that grow by age (frames).
void forget_confidence(uint32_t age, VertexConfidence& confidence, size_t vertices);
// The same of one vertex.
void forget_vertex(uint32_t age, size_t vertex, VertexConfidence& confidence);
// The same of the vertices of the pieces that are lost. vertex_pieces: per vertex.
void forget_lost_pieces(std::span<const defrec_piece> pieces,
                        std::span<const uint8_t> vertex_pieces, VertexConfidence& confidence);
// Sets each piece's observed_share; returns how many vertices are observed in all.
uint32_t share_observed(std::span<const uint8_t> vertex_pieces, const VertexConfidence& confidence,
                        std::span<defrec_piece> pieces);

// What to believe of a point of the template frame, on the surface or off it: that of the vertex
// under its pixel, or nearest to it on tissue that joined, with an error that grows with the
// distance (mm) from the surface.
struct SurfaceConfidence {
    uint8_t status = DEFREC_POINT_UNKNOWN;
    uint8_t evidence = 0;  // DEFREC_EVIDENCE_*
    double expected_error = 0;
    double covariance[6] = {};  // as in VertexConfidence
};
SurfaceConfidence confidence_at(const Template& surface, const VertexConfidence& confidence,
                                const double xyz[3]);
// The same in two steps, of which the first is the same in all frames.
struct NearVertex {
    int32_t vertex = -1;   // -1: nothing is known there
    bool is_off = false;   // so far from the surface that it is not observed
    double growth_mm = 0;  // of the expected error
};
NearVertex near_vertex(const Template& surface, int32_t vertex, const double xyz[3]);
SurfaceConfidence confidence_at(const VertexConfidence& confidence, const NearVertex& near);

// Confidence of a place beside the surface, that far from a vertex. place: in the frame.
SurfaceConfidence confidence_beside(const VertexConfidence& confidence, size_t vertex,
                                    double distance_mm, const Vec3<double>& place);

// What a run of vertices says of the best rigid motion: deformed positions, and their products with
// those in the template, less the mean of all. The fourth components mean nothing.
struct RigidSums {
    Eigen::Matrix<double, 4, 3> products = Eigen::Matrix<double, 4, 3>::Zero();
    Eigen::Vector4d positions = Eigen::Vector4d::Zero();
};
// first: of the vertices whose samples are given.
RigidSums sum_for_rigid_motion(const SurfaceModel& model, SurfaceSamples samples, size_t first);
// vertices: x, y, z of each.
RigidSums sum_for_rigid_motion(const SurfaceModel& model, std::span<const float> vertices,
                               size_t first);
// Best rigid motion from the template's vertices to the deformed ones, 3x4 row-major (Kabsch).
// runs: of all vertices, in their order.
void fit_rigid_motion(const SurfaceModel& model, std::span<const RigidSums> runs,
                      double motion[12]);

// How many vertices moved farther than that from one frame to another.
size_t count_moved_farther(SurfaceSamples from, SurfaceSamples to, float distance_mm);

// Positions and normals as plain xyz; both have room for 3 values per sample.
void split_samples(SurfaceSamples samples, std::span<float> positions, std::span<float> normals);

}  // namespace defrec
