// The stages that follow a template into a frame, and their buffers: all that depends on the
// template's counts.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sdk/rig/rig.hpp"
#include "sdk/template/template.hpp"
#include "sdk/tracking/frame/frame.hpp"
#include "sdk/tracking/stages/solve_region.hpp"
#include "sdk/tracking/stages/solver_passes.hpp"

namespace defrec {

class TemplateStages {
  public:
    // Through the queue, behind its work; when it returns the template's data are on the device.
    TemplateStages(const std::shared_ptr<Device>& device, Queue& queue, const Rig& rig,
                   const TrackerSettings& settings, const TemplateData& data);

    // Before enqueue: the motions to start from. Chooses the part of the map that is solved.
    void start(Queue& queue, std::span<const defrec_motion> motions, const RegistrationPlan& plan);
    // Follows the template into the observed images from there. samples: where the device leaves
    // them, its own memory where it is nullptr.
    void enqueue(Queue& queue, const Observation& observed, const RegistrationPlan& plan,
                 const DeviceBuffer* samples, StageTimer& timer, FrameOutput& output);
    // Whether frames may be solved in part: then each leaves a choice to those after it.
    bool has_region() const { return region_.has_value(); }
    // Whether the last frame was solved in part; whether all that its motions show was.
    bool solved_part() const { return uses_region_; }
    bool solved_all_seen(std::span<const defrec_motion> motions) const {
        return !uses_region_ || region_->covers_image(motions);
    }

  private:
    struct Pass {
        const SolverPass& pass;
        // align, align_widely: null without a search. solve_region: null without a region.
        std::unique_ptr<DeviceStage> align, align_widely, solve, solve_region;
        DeviceBuffer motions;
    };
    // What a pass is prepared with for a part of the map.
    struct RegionBuffers {
        DeviceBuffer nodes, edges, points, landmarks, patches;
    };

    void make_matching(Queue& queue, const TemplateData& data);
    void upload_template(Queue& queue, const TemplateData& data);
    void make_region(const TemplateData& data);
    defrec_lm_params params_of_region(defrec_lm_params whole) const;
    void write_pair(Queue& queue);
    bool choose_region(Queue& queue, std::span<const defrec_motion> start);
    void make_buffers(const TemplateData& data);
    defrec_align_params align_params(const TemplateData& data, uint32_t patches) const;
    std::unique_ptr<DeviceStage> make_align(uint32_t level, uint32_t radius,
                                            const TemplateData& data) const;
    void prepare_search(Queue& queue, Pass& pass, const TemplateData& data);
    std::unique_ptr<DeviceStage> make_check(const TemplateData& data) const;
    std::unique_ptr<DeviceStage> make_right_search(const TemplateData& data) const;
    defrec_lm_params solve_params(const SolverPass& pass, const TemplateData& data) const;
    void check_surface(Queue& queue, const Observation& observed, const DeviceBuffer* motions,
                       StageTimer& timer);
    void read_back(Queue& queue, const DeviceBuffer& samples, bool is_checked,
                   FrameOutput& output) const;

    std::shared_ptr<Device> device_;
    const TrackerSettings settings_;
    const defrec_camera camera_;  // the rig's, of which the template's own may differ by rounding
    DeviceBuffer nodes_, edges_, points_, sparse_points_, landmarks_, landmark_points_, patches_,
        slopes_, views_;
    DeviceBuffer start_, matches_, weighted_, ransac_summary_, lm_summary_, predictions_,
        observations_, samples_, check_patches_, check_slopes_, check_predictions_, checks_,
        rig_patches_, rig_slopes_, right_observations_;
    std::unique_ptr<DeviceStage> match_, ransac_, warp_, check_;
    std::unique_ptr<DeviceStage> right_search_;  // null where the rig is not watched
    std::vector<Pass> passes_;
    std::optional<SolveRegion> region_;  // of a map much larger than an image
    RegionBuffers region_buffers_;
    bool uses_region_ = false;    // in the last frame
    uint32_t partly_solved_ = 0;  // frames since the region was chosen
};

// Every second vertex along rows and columns of the grids: neighbouring disparities share their
// windows, so a denser cloud tells the solver little more.
std::vector<defrec_surface_point> sparse_vertices(const TemplateData& data);

}  // namespace defrec
