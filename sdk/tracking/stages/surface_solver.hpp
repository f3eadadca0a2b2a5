// The solver's passes over a frame and the searches of patches between them: stages lm and align.
// The finer passes over a map much larger than an image solve a part of it.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"
#include "sdk/tracking/frame/frame.hpp"
#include "sdk/tracking/stages/solve_region.hpp"
#include "sdk/tracking/stages/solver_passes.hpp"

namespace defrec {

class SurfaceSolver {
  public:
    // views: the template's images, on the device.
    SurfaceSolver(Queue& queue, const defrec_camera& camera, const TrackerSettings& settings,
                  const TemplateData& data, const DeviceBuffer& views);

    // Before enqueue: the motions to start from. Chooses the part of the map that is solved.
    void start(Queue& queue, std::span<const defrec_motion> motions, const RegistrationPlan& plan);
    // matches: with positions in depth; nullptr without. Returns the motions of the control points.
    const DeviceBuffer& enqueue(Queue& queue, const Observation& observed,
                                const RegistrationPlan& plan, const DeviceBuffer* matches,
                                StageTimer& timer);
    // The last search's observations and predictions.
    void read_back(Queue& queue, FrameOutput& output) const;

    // As TemplateStages has them.
    bool has_region() const { return region_.has_value(); }
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
    // The buffers that stage lm is prepared with, for a map or a part of it.
    struct MapBuffers {
        DeviceBuffer nodes, edges, points, landmarks, patches;

        void prepare(Queue& queue, DeviceStage& stage) const {
            stage.prepare(queue, {&nodes, &edges, &points, &landmarks, &patches});
        }
    };

    void make_region(Queue& queue, const TemplateData& data);
    defrec_lm_params params_of_region(defrec_lm_params whole) const;
    void write_pair(Queue& queue);
    bool choose_region(Queue& queue, std::span<const defrec_motion> start);

    MapBuffers map_;
    DeviceBuffer slopes_;
    DeviceBuffer start_, predictions_, observations_, summary_;
    std::vector<Pass> passes_;
    std::optional<SolveRegion> region_;  // of a map much larger than an image
    MapBuffers region_buffers_;
    bool uses_region_ = false;    // in the last frame
    uint32_t partly_solved_ = 0;  // frames since the region was chosen
};

// Every second vertex along rows and columns of the grids: neighbouring disparities share their
// windows, so a denser cloud tells the solver little more.
std::vector<defrec_surface_point> sparse_vertices(const TemplateData& data);

}  // namespace defrec
