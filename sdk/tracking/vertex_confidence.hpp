// Where a template's surface is in one frame, and how far to believe it. Pure functions; the
// tracker holds the memory.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

using SurfaceSamples = std::span<const defrec_surface_sample>;

// What the functions below need of a template, worked out once for all its frames. The data must
// outlive it.
struct SurfaceModel {
    explicit SurfaceModel(const TemplateData& data);

    const TemplateData* data;
    // Per vertex:
    std::vector<uint32_t> cell;           // of the template's grid
    Eigen::ArrayXf step_mm;               // a step of the grid
    Eigen::ArrayXf measurement_variance;  // mm^2, of a vertex that is observed
    Eigen::ArrayXf support_error;  // mm: how far the template's own disparity was extrapolated
    Eigen::Matrix4Xf centred;      // position less the centre, and 0
    Eigen::Vector3d centre;        // mean position
};

// How sure a vertex is, from what was observed of it and round it.
struct VertexConfidence {
    std::vector<uint8_t> status;        // DEFREC_POINT_*
    std::vector<uint8_t> evidence;      // DEFREC_EVIDENCE_*
    std::vector<float> covariance;      // xx, xy, xz, yy, yz, zz each, mm^2, rectified camera
    std::vector<float> expected_error;  // mm, root of the covariance's trace
    // Working memory:
    std::vector<float> distance;  // per cell of the grid, steps to the nearest observed vertex
    Eigen::ArrayXf far_mm, residual_mm;  // per vertex
};
// lost: every vertex becomes unknown, with errors growing by age (frames).
void estimate_confidence(const SurfaceModel& model, SurfaceSamples samples, bool lost, uint32_t age,
                         VertexConfidence& confidence);

// What to believe of a point of the template frame, on the surface or off it: that of the vertices
// under its pixel, with an error that grows with the distance (mm) from the surface.
struct SurfaceConfidence {
    uint8_t status = DEFREC_POINT_UNKNOWN;
    uint8_t evidence = 0;  // DEFREC_EVIDENCE_*
    double expected_error = 0;
    double covariance[6] = {};  // as in VertexConfidence
};
SurfaceConfidence confidence_at(const TemplateData& data, const VertexConfidence& confidence,
                                const double xyz[3]);

// Best rigid motion from the template's vertices to the deformed ones, 3x4 row-major (Kabsch).
void fit_rigid_motion(const SurfaceModel& model, SurfaceSamples samples, double motion[12]);

// Whether at least half of the vertices moved farther than that from one frame to another.
bool moved_farther(SurfaceSamples from, SurfaceSamples to, float distance_mm);

// Positions and normals as plain xyz; both have room for 3 values per sample.
void split_samples(SurfaceSamples samples, std::span<float> positions, std::span<float> normals);

}  // namespace defrec
