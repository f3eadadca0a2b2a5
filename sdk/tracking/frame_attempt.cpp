// See frame_attempt.hpp.
#include "sdk/tracking/frame_attempt.hpp"

#include <algorithm>
#include <atomic>
#include <numeric>

#include "sdk/template/nearest_nodes.hpp"
#include "sdk/tracking/evidence/vertex_runs.hpp"
#include "sdk/tracking/stages/check_output.hpp"

namespace defrec {
namespace {

constexpr size_t kPatchRun = 256;   // patches that one thread measures
constexpr size_t kRecordParts = 4;  // of what the stages gave, each checked by one thread

}  // namespace

void place_nodes(const TemplateData& data, std::span<const defrec_motion> motions,
                 std::span<float> positions, ArrayPart part) {
    for (size_t i = part.begin(motions.size()); i < part.end(motions.size()); ++i)
        store3(node_position(data.nodes, motions, i), &positions[3 * i]);
}

void FrameAttempt::begin(const TrackedSurface& surface, const RegistrationPlan& plan,
                         FrameInput::Clock::time_point time) {
    plan_ = plan;
    time_ = time;
    quality = {};
    given_error_px = 0;
    const TemplateData& data = surface.data();
    result.surface = surface.surface();
    result.vertices.resize(3 * data.vertices.size());
    result.normals.resize(3 * data.vertices.size());
    result.node_positions.resize(data.nodes.size());
    result.motions.resize(data.nodes.size() / 3);
}

void FrameAttempt::prepare_measuring(const TrackedSurface& surface, const RigMonitor& rig) {
    const TemplateData& data = surface.data();
    const size_t runs = vertex_runs(data.vertices.size());
    vertex_evidence_.resize(runs);
    rigid_sums_.resize(runs);
    fast_vertices_.assign(runs, 0);
    patch_px2_.resize(data.patches.size());
    photometric_.make_room(data);
    begin_confidence(surface.model(), result.confidence);
    row_matches_.reserve(rig_patch_count(data));
    const RigState& before = rig.state();
    rig_.monitor = before.monitor;
    rig_.left = before.left;
    rig_.patches.reserve(rig_patch_count(data));
    rig_.disparities = before.disparities;
    rig_.disparities.make_room();
}

// The tasks of measure(), whose threads share them. What a stage gave wrong leads to results that
// nobody sees, and to no undefined operation.
class FrameAttempt::Measuring {
  public:
    Measuring(FrameAttempt& attempt, const TrackedSurface& surface, const RigMonitor& rig,
              const Pipeline& pipeline, const FrameOutput& output)
        : attempt_(attempt),
          surface_(surface),
          data_(surface.data()),
          rig_(rig),
          pipeline_(pipeline),
          output_(output),
          patch_runs_(std::max<size_t>(1, (attempt.patch_px2_.size() + kPatchRun - 1) / kPatchRun)),
          patch_runs_left_(patch_runs_) {}

    size_t tasks() const { return patch_runs_ + 3 + kRecordParts; }
    // First those for whose sums the runs wait.
    void run_task(size_t task) {
        if (task < patch_runs_) return measure_patch_run(task);
        if (task == patch_runs_) return sum_checks();
        if (task == patch_runs_ + 1) return measure_rows();
        if (task == patch_runs_ + 2) return measure_disparities();
        check_records({task - patch_runs_ - 3, kRecordParts});
    }
    void run_vertices(size_t run) {
        check_vertices(run);
        attempt_.measure_run(surface_.model(), output_.samples, run);
        const size_t first = run * kVertexRun;
        wait_for([&] { return sums_left_ == 0; });  // those that add them up have begun
        measure_photometric(data_, output_, first,
                            std::min(first + kVertexRun, output_.samples.size()),
                            attempt_.photometric_);
    }
    bool found_wrong() const { return is_wrong_; }

  private:
    void measure_patch_run(size_t run) {
        const std::span<double> patches(attempt_.patch_px2_);
        const size_t first = run * kPatchRun;
        measure_patches(data_, output_, first,
                        patches.subspan(first, std::min(kPatchRun, patches.size() - first)));
        if (--patch_runs_left_ != 0) return;
        spread_patches(data_, attempt_.patch_px2_, attempt_.photometric_);
        --sums_left_;
    }
    void sum_checks() {
        spread_checks(data_, surface_.model().checked, output_, attempt_.photometric_);
        --sums_left_;
    }
    void measure_rows() {
        if (!rig_.is_on()) return;
        RigState& next = attempt_.rig_;
        match_rows(data_, output_, rig_.state().patches, next.patches, attempt_.row_matches_);
        next.left = next.monitor.update(attempt_.row_matches_);
    }
    void measure_disparities() {
        if (rig_.is_on()) attempt_.rig_.disparities.add_frame(data_, output_.samples);
    }
    void check_records(ArrayPart part) {
        if (pipeline_.any_wrong_record(output_, data_, part)) is_wrong_ = true;
        place_nodes(data_, output_.motions, attempt_.result.node_positions, part);
    }
    void check_vertices(size_t run) {
        const SurfaceSamples samples = vertex_run(SurfaceSamples(output_.samples), run);
        if (any_wrong_sample(samples)) is_wrong_ = true;
        attempt_.vertex_evidence_[run] = weigh_vertices(samples);
        if (surface_.is_tracking())
            attempt_.fast_vertices_[run] = count_moved_farther(
                vertex_run(surface_.samples(), run), samples, attempt_.settings_.fast_motion);
    }

    FrameAttempt& attempt_;
    const TrackedSurface& surface_;
    const TemplateData& data_;
    const RigMonitor& rig_;
    const Pipeline& pipeline_;
    const FrameOutput& output_;
    const size_t patch_runs_;
    std::atomic<size_t> patch_runs_left_, sums_left_ = 2;
    std::atomic<bool> is_wrong_ = false;
};

// This is most of what the host does while the application waits.
void FrameAttempt::measure(const TrackedSurface& surface, const RigMonitor& rig,
                           const Pipeline& pipeline, const FrameOutput& output,
                           const Services* helpers) {
    Measuring measuring(*this, surface, rig, pipeline, output);
    for_tasks_and_runs(
        helpers, measuring.tasks(), [&](size_t task) { measuring.run_task(task); },
        vertex_runs(output.samples.size()), [&](size_t run) { measuring.run_vertices(run); });
    if (measuring.found_wrong()) pipeline.check(output, surface.data());
    result.evidence = weigh_evidence(output, vertex_evidence_, patch_px2_);
    result.evidence.vertices_refuted = photometric_.vertices_refuted;
    quality = classify(surface.data(), result.evidence, settings_, surface.is_tracking(),
                       plan_.uses_depth);
    quality.add(reasons_of(plan_.quality_level));
}

void FrameAttempt::measure_run(const SurfaceModel& model, SurfaceSamples all, size_t run) {
    const size_t first = run * kVertexRun;
    const SurfaceSamples samples = vertex_run(all, run);
    rigid_sums_[run] = sum_for_rigid_motion(model, samples, first);
    const auto of_run = [&](std::vector<float>& values) {
        return std::span(values).subspan(3 * first, 3 * samples.size());
    };
    split_samples(samples, of_run(result.vertices), of_run(result.normals));
}

void FrameAttempt::measure_surface(const TrackedSurface& surface, const FrameOutput& output) {
    rigid_sums_.resize(vertex_runs(output.samples.size()));
    for (size_t run = 0; run < rigid_sums_.size(); ++run)
        measure_run(surface.model(), output.samples, run);
    place_nodes(surface.data(), output.motions, result.node_positions);
}

bool FrameAttempt::is_fast(size_t vertices) const {
    return 2 * std::accumulate(fast_vertices_.begin(), fast_vertices_.end(), size_t{0}) >= vertices;
}

void FrameAttempt::fit_rigid_motion(const SurfaceModel& model) {
    defrec::fit_rigid_motion(model, rigid_sums_, result.rigid_motion.data());
}

void FrameAttempt::measure_again(const SurfaceModel& model, size_t run) {
    const size_t first = run * kVertexRun,
                 count = std::min(kVertexRun, result.vertices.size() / 3 - first);
    rigid_sums_[run] = sum_for_rigid_motion(
        model, std::span<const float>(result.vertices).subspan(3 * first, 3 * count), first);
}

}  // namespace defrec
