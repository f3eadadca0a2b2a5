// One try to find the surface in a frame: how, what it showed, and what the frame becomes if it is
// the try that counts. A frame has one, seldom two or three. One is committed, the others are
// dropped, but for the rig: it is as the first try measured it, or the one of the whole map.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/base/util/array_part.hpp"
#include "sdk/tracking/frame/frame.hpp"
#include "sdk/tracking/frame_result.hpp"
#include "sdk/tracking/monitors/rig_monitor.hpp"
#include "sdk/tracking/stages/pipeline.hpp"
#include "sdk/tracking/tracked_surface.hpp"

namespace defrec {

// Frame coordinates of the control points, of a part of them.
void place_nodes(const TemplateData& data, std::span<const defrec_motion> motions,
                 std::span<float> positions, ArrayPart part = {});

// Its memory serves the attempts of later frames.
class FrameAttempt {
  public:
    FrameAttempt(const TrackerSettings& settings, const RigState& rig)
        : settings_(settings), rig_(rig) {}

    // Begins a try to find the surface, and makes room for its results.
    void begin(const TrackedSurface& surface, const RegistrationPlan& plan,
               FrameInput::Clock::time_point time);
    const RegistrationPlan& plan() const { return plan_; }
    // Since when its frame is computed by this plan.
    FrameInput::Clock::time_point time() const { return time_; }

    // What measuring needs and does not wait for the device.
    void prepare_measuring(const TrackedSurface& surface, const RigMonitor& rig);
    // Checks what the stages gave, works out what follows from it alone, in tasks that helpers'
    // threads share (nullptr: none), and classifies the frame by it. Throws
    // Error(DEFREC_ERROR_PLUGIN) where a stage gave what it never gives.
    void measure(const TrackedSurface& surface, const RigMonitor& rig, const Pipeline& pipeline,
                 const FrameOutput& output, const Services* helpers);
    // Measures a frame that is lost: the surface as it is in output again.
    void measure_surface(const TrackedSurface& surface, const FrameOutput& output);

    // At least half of the vertices have moved fast since the frame before.
    bool is_fast(size_t vertices) const;
    // As the rig's monitors would be after this frame.
    RigState& rig() { return rig_; }
    const PhotometricEvidence& photometric() const { return photometric_; }
    std::span<const double> patch_px2() const { return patch_px2_; }
    // Best rigid motion of the samples.
    void fit_rigid_motion(const SurfaceModel& model);
    // Takes what fit_rigid_motion() needs of a run's vertices whose results were changed since.
    void measure_again(const SurfaceModel& model, size_t run);

    FrameQuality quality;
    FrameResult result;
    float given_error_px = 0;  // of DisparityCheck

  private:
    class Measuring;
    void measure_run(const SurfaceModel& model, SurfaceSamples samples, size_t run);

    const TrackerSettings settings_;
    RegistrationPlan plan_;
    FrameInput::Clock::time_point time_;
    RigState rig_;
    std::vector<RowMatch> row_matches_;
    PhotometricEvidence photometric_;
    std::vector<double> patch_px2_;  // of measure_patches
    // Per run of vertices.
    std::vector<VertexEvidence> vertex_evidence_;
    std::vector<RigidSums> rigid_sums_;
    std::vector<size_t> fast_vertices_;  // since the frame before, in which the surface was found
};

}  // namespace defrec
