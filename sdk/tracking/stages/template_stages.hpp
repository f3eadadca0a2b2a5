// The stages that follow a template into a frame, and their buffers: all that depends on the
// template's counts.
#pragma once
#include <memory>
#include <optional>
#include <span>

#include "sdk/rig/rig.hpp"
#include "sdk/template/template.hpp"
#include "sdk/tracking/frame/frame.hpp"
#include "sdk/tracking/frame/tracker_settings.hpp"
#include "sdk/tracking/stages/landmark_matching.hpp"
#include "sdk/tracking/stages/surface_check.hpp"
#include "sdk/tracking/stages/surface_solver.hpp"

namespace defrec {

class TemplateStages {
  public:
    // Through the queue, behind its work; when it returns the template's data are on the device.
    TemplateStages(Queue& queue, const Rig& rig, const TrackerSettings& settings,
                   const TemplateData& data);

    // Before enqueue: the motions to start from. Chooses the part of the map that is solved.
    void start(Queue& queue, std::span<const defrec_motion> motions, const RegistrationPlan& plan) {
        solver_.start(queue, motions, plan);
    }
    // Follows the template into the observed images from there. samples: where the device leaves
    // them, its own memory where it is nullptr.
    void enqueue(Queue& queue, const Observation& observed, const RegistrationPlan& plan,
                 const DeviceBuffer* samples, StageTimer& timer, FrameOutput& output);
    // Whether frames may be solved in part: then each leaves a choice to those after it.
    bool has_region() const { return solver_.has_region(); }
    // Whether the last frame was solved in part; whether all that its motions show was.
    bool solved_part() const { return solver_.solved_part(); }
    bool solved_all_seen(std::span<const defrec_motion> motions) const {
        return solver_.solved_all_seen(motions);
    }

  private:
    void read_back(Queue& queue, const DeviceBuffer& samples, bool is_checked,
                   FrameOutput& output) const;

    DeviceBuffer views_;
    LandmarkMatching matching_;
    SurfaceSolver solver_;
    SurfaceCheck check_;
    std::optional<RightViewSearch> right_search_;  // empty where the rig is not watched
    DeviceBuffer points_, samples_;
    std::unique_ptr<DeviceStage> warp_;
};

}  // namespace defrec
