// See surface_solver.hpp.
#include "sdk/tracking/stages/surface_solver.hpp"

#include <algorithm>

#include "backends/shared/motion.hpp"
#include "sdk/template/check_patches.hpp"
#include "sdk/tracking/decisions/stages.hpp"
#include "sdk/tracking/stages/make_stage.hpp"
#include "sdk/tracking/stages/template_buffers.hpp"
#include "sdk/tracking/stages/template_patches.hpp"

namespace defrec {
namespace {

using decisions::StageParameters;

std::unique_ptr<DeviceStage> make_align(const Queue& queue, defrec_align_params align,
                                        uint32_t level, uint32_t radius) {
    align.level = level;
    align.search_radius = radius;
    return make_stage<DEFREC_STAGE_ALIGN>(queue.device(), align);
}

// points: that are compared with depth.
defrec_lm_params solve_params(const SolverPass& pass, const defrec_camera& camera,
                              const TrackerSettings& settings, const TemplateData& data,
                              uint64_t points) {
    auto lm = make_params<defrec_lm_params>();
    lm.nodes = node_count(data);
    lm.edges = count_of(data.edges);
    lm.points = static_cast<uint32_t>(points);
    lm.landmarks = count_of(data.landmarks);
    lm.patches = count_of(data.patches);
    lm.width = data.width;
    lm.height = data.height;
    lm.camera = camera;
    lm.node_spacing_mm = static_cast<float>(data.node_spacing_mm);
    // An edge's weight follows the data of its control points, of which each has less the denser
    // they are.
    const double density = default_node_spacing(data.width) / data.node_grid.spacing_u;
    lm.arap_weight = settings.arap_weight * pass.stiffness * static_cast<float>(density * density);
    lm.rotation_weight = StageParameters::kRotationWeight;
    lm.icp_weight = StageParameters::kIcpWeight;
    lm.cg_iterations = pass.cg_iterations;
    lm.match_threshold_mm = StageParameters::kMatchThreshold;
    lm.iterations = pass.iterations != nullptr ? settings.*pass.iterations : 1;
    lm.presolve = pass.presolve ? 1 : 0;
    lm.trust_last_step = 1;
    lm.match_weight = pass.match_weight;
    lm.patch_tukey_px = pass.patch_tukey_px;
    lm.icp_tukey_mm = pass.icp_tukey_mm;
    return lm;
}

}  // namespace

std::vector<defrec_surface_point> sparse_vertices(const TemplateData& data) {
    std::vector<defrec_surface_point> points;
    for (int y = 0; y < data.grid.rows; y += StageParameters::kSparseStep)
        for (int x = 0; x < data.grid.columns; x += StageParameters::kSparseStep) {
            const int32_t vertex = data.grid.vertex[static_cast<size_t>(y * data.grid.columns + x)];
            if (vertex >= 0) points.push_back(data.vertices[static_cast<size_t>(vertex)]);
        }
    for (const SurfacePatch& part : data.parts)
        for (int y = 0; y < part.rows; y += StageParameters::kSparseStep)
            for (int x = 0; x < part.columns; x += StageParameters::kSparseStep) {
                const int32_t vertex = part.vertex[static_cast<size_t>(y * part.columns + x)];
                if (vertex >= static_cast<int64_t>(part.before.vertices))
                    points.push_back(data.vertices[static_cast<size_t>(vertex)]);
            }
    return points;
}

SurfaceSolver::SurfaceSolver(Queue& queue, const defrec_camera& camera,
                             const TrackerSettings& settings, const TemplateData& data,
                             const DeviceBuffer& views)
    : map_{uploaded(queue, data.nodes), uploaded(queue, data.edges),
           uploaded(queue, sparse_vertices(data)), uploaded(queue, data.landmark_points),
           uploaded(queue, data.patches)},
      slopes_(uploaded(queue, slopes_of(data, data.patches))),
      predictions_(buffer_of<defrec_patch_prediction>(queue, data.patches.size())),
      observations_(buffer_of<defrec_patch_observation>(queue, data.patches.size())),
      summary_(buffer_of<defrec_lm_summary>(queue, 1)) {
    if (SolveRegion::suits(data)) make_region(queue, data);
    start_ = buffer_of<defrec_motion>(
        queue, region_ ? region_->lists().nodes.size() / 3 : node_count(data));
    const defrec_align_params align = align_params(camera, data, count_of(data.patches));
    for (const SolverPass& pass : kSolverPasses) {
        Pass& made = passes_.emplace_back(Pass{pass, nullptr, nullptr, nullptr, nullptr, {}});
        made.motions = DeviceBuffer(queue.device(), start_.size());
        if (pass.search) {
            const PatchSearch& search = *pass.search;
            const uint32_t level = std::max(search.level, data.texture_level);
            made.align = make_align(queue, align, level, search.radius);
            made.align_widely = make_align(
                queue, align, std::max(search.level + fine_check_level(data.width), level),
                search.wide_radius);
            for (const auto& stage : {&made.align, &made.align_widely})
                (*stage)->prepare(queue, {&map_.patches, &views, &slopes_});
        }
        const defrec_lm_params params = solve_params(
            pass, camera, settings, data, map_.points.size() / sizeof(defrec_surface_point));
        made.solve = make_stage<DEFREC_STAGE_LM>(queue.device(), params);
        map_.prepare(queue, *made.solve);
        if (region_)
            made.solve_region =
                make_stage<DEFREC_STAGE_LM>(queue.device(), params_of_region(params));
    }
    if (region_) write_pair(queue);
}

void SurfaceSolver::make_region(Queue& queue, const TemplateData& data) {
    const RegionLists& lists = region_.emplace(data, sparse_vertices(data)).lists();
    region_buffers_ = {buffer_for(queue, lists.nodes), buffer_for(queue, lists.edges),
                       buffer_for(queue, lists.points), buffer_for(queue, lists.landmarks),
                       buffer_for(queue, lists.patches)};
}

defrec_lm_params SurfaceSolver::params_of_region(defrec_lm_params whole) const {
    const RegionLists& lists = region_->lists();
    whole.nodes = count_of(lists.nodes) / 3;
    whole.edges = count_of(lists.edges);
    whole.points = count_of(lists.points);
    return whole;
}

// Motions of the control points that a region has beyond the template's, which never move.
void SurfaceSolver::write_pair(Queue& queue) {
    const std::vector<defrec_motion> rest(SolveRegion::kPair,
                                          DualQuaternion<float>::identity().store());
    const uint64_t offset = start_.size() - bytes_of(rest);
    queue.write(start_, rest.data(), bytes_of(rest), offset);
    for (const Pass& pass : passes_) queue.write(pass.motions, rest.data(), bytes_of(rest), offset);
}

// Whether a part of the map is enough for a frame that starts with these motions. Prepares the
// stages anew where it is another part than before.
bool SurfaceSolver::choose_region(Queue& queue, std::span<const defrec_motion> start) {
    const SolveRegion::Choice choice = region_->choose(start);
    if (choice != SolveRegion::Choice::kOther) return choice == SolveRegion::Choice::kSame;
    const RegionLists& lists = region_->lists();
    const MapBuffers& buffers = region_buffers_;
    write_all(queue, buffers.nodes, lists.nodes);
    write_all(queue, buffers.edges, lists.edges);
    write_all(queue, buffers.points, lists.points);
    write_all(queue, buffers.landmarks, lists.landmarks);
    write_all(queue, buffers.patches, lists.patches);
    for (const Pass& pass : passes_) buffers.prepare(queue, *pass.solve_region);
    return true;
}

void SurfaceSolver::start(Queue& queue, std::span<const defrec_motion> motions,
                          const RegistrationPlan& plan) {
    uses_region_ = region_ && !plan.whole_map && choose_region(queue, motions);
    queue.write(start_, motions.data(), motions.size_bytes());
}

const DeviceBuffer& SurfaceSolver::enqueue(Queue& queue, const Observation& observed,
                                           const RegistrationPlan& plan,
                                           const DeviceBuffer* matches, StageTimer& timer) {
    // Tissue outside of the image follows a whole solution, and in between the rigid motion of
    // the matches alone.
    const bool solves_whole_coarsely = partly_solved_ % decisions::MapPart::kWholeEvery == 0;
    partly_solved_ = uses_region_ ? partly_solved_ + 1 : 0;
    const DeviceBuffer* disparity = plan.uses_depth ? &observed.disparity : nullptr;
    const DeviceBuffer* motions = &start_;
    const size_t passes = passes_.size() - (plan.quality_level == QualityLevel::kFull ? 0 : 1);
    for (const auto& [pass, align, align_widely, solve, solve_region, result] :
         std::span(passes_).first(passes)) {
        if (pass.search) {
            const DeviceBuffer* predictions =
                &pass == &passes_[passes - 1].pass ? &predictions_ : nullptr;
            DeviceStage& search = plan.searches_widely ? *align_widely : *align;
            search.enqueue(queue, {&observed.gray[0], &observed.mask[0], motions, nullptr},
                           {&observations_, predictions});
            timer.end(pass.search->time_name);
        }
        const DeviceBuffer* observations = pass.search ? &observations_ : nullptr;
        const bool solves_part = uses_region_ && (pass.search || !solves_whole_coarsely);
        DeviceStage& solver = solves_part ? *solve_region : *solve;
        solver.enqueue(queue, {motions, matches, observations, disparity}, {&result, &summary_});
        timer.end(pass.time_name);
        motions = &result;
    }
    return *motions;
}

void SurfaceSolver::read_back(Queue& queue, FrameOutput& output) const {
    queue.read(observations_, output.observations.data(), bytes_of(output.observations));
    queue.read(predictions_, output.predictions.data(), bytes_of(output.predictions));
}

}  // namespace defrec
