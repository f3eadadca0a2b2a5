// See template_stages.hpp.
#include "sdk/tracking/stages/template_stages.hpp"

#include <algorithm>

#include "backends/shared/motion.hpp"
#include "sdk/template/check_patches.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/template/scattered_blend_weights.hpp"
#include "sdk/tracking/frame/decisions.hpp"
#include "sdk/tracking/stages/make_stage.hpp"

namespace defrec {
namespace {

using decisions::StageParameters;

constexpr uint32_t kMinBytes = 16;  // of a buffer, whatever a template lacks

template <class T>
uint64_t bytes_of(const T& values) {
    return std::span(values).size_bytes();
}

template <class T>
uint32_t count_of(const std::vector<T>& values) {
    return static_cast<uint32_t>(values.size());
}

uint32_t node_count(const TemplateData& data) { return count_of(data.nodes) / 3; }

template <class T>
DeviceBuffer buffer_for(const std::shared_ptr<Device>& device, const std::vector<T>& values) {
    return {device, std::max<uint64_t>(bytes_of(values), kMinBytes)};
}

template <class T>
void write_all(Queue& queue, const DeviceBuffer& buffer, const std::vector<T>& values) {
    if (!values.empty()) queue.write(buffer, values.data(), bytes_of(values));
}

std::vector<defrec_patch> rig_patches(const TemplateData& data) {
    std::vector<defrec_patch> patches;
    for (size_t i = 0; i < data.patches.size(); i += rig_patch_step(data))
        patches.push_back(data.patches[i]);
    return patches;
}

// Patches of the first view are strained; those of tissue that joined, whose control points are on
// no such grid, are only turned.
std::vector<defrec_patch_slope> slopes_of(const TemplateData& data,
                                          const std::vector<defrec_patch>& patches) {
    std::vector<defrec_patch_slope> slopes;
    slopes.reserve(patches.size());
    for (const defrec_patch& patch : patches)
        slopes.push_back(patch.view == 0
                             ? grid_slope(data.node_grid, data.piece_of(patch), patch.u, patch.v)
                             : scattered_slope(data.nodes, patch));
    return slopes;
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

TemplateStages::TemplateStages(const std::shared_ptr<Device>& device, Queue& queue, const Rig& rig,
                               const TrackerSettings& settings, const TemplateData& data)
    : device_(device), settings_(settings), camera_(rig.camera()) {
    upload_template(queue, data);
    if (SolveRegion::suits(data)) make_region(data);
    make_buffers(data);

    if (!data.landmarks.empty()) make_matching(queue, data);

    for (const SolverPass& pass : kSolverPasses) {
        Pass& made = passes_.emplace_back(Pass{pass, nullptr, nullptr, nullptr, nullptr, {}});
        made.motions = DeviceBuffer(device_, start_.size());
        if (pass.search) prepare_search(queue, made, data);
        const defrec_lm_params params = solve_params(pass, data);
        made.solve = make_stage<DEFREC_STAGE_LM>(device_, params);
        made.solve->prepare(queue,
                            {&nodes_, &edges_, &sparse_points_, &landmark_points_, &patches_});
        if (region_)
            made.solve_region = make_stage<DEFREC_STAGE_LM>(device_, params_of_region(params));
    }
    if (region_) write_pair(queue);

    check_ = make_check(data);
    check_->prepare(queue, {&check_patches_, &views_, &check_slopes_});

    if (settings_.self_calibration != DEFREC_SELF_CALIBRATION_OFF) {
        right_search_ = make_right_search(data);
        right_search_->prepare(queue, {&rig_patches_, &views_, &rig_slopes_});
    }

    auto warp = make_params<defrec_warp_params>();
    warp.nodes = node_count(data);
    warp.points = count_of(data.vertices);
    warp.width = data.width;
    warp.height = data.height;
    warp.camera = camera_;
    warp_ = make_stage<DEFREC_STAGE_WARP>(device_, warp);
    warp_->prepare(queue, {&points_});
    queue.finish();
}

// Without landmarks a surface is followed by its patches and depth.
void TemplateStages::make_matching(Queue& queue, const TemplateData& data) {
    auto match = make_params<defrec_match_params>();
    match.landmarks = count_of(data.landmarks);
    match.features = settings_.max_features;
    match.width = data.width;
    match.height = data.height;
    match.camera = camera_;
    match_ = make_stage<DEFREC_STAGE_MATCH>(device_, match);
    match_->prepare(queue, {&landmarks_});

    auto ransac = make_params<defrec_ransac_params>();
    ransac.landmarks = count_of(data.landmarks);
    ransac.iterations = StageParameters::kRansacIterations;
    ransac.seed = settings_.seed;
    ransac_ = make_stage<DEFREC_STAGE_RANSAC>(device_, ransac);
    ransac_->prepare(queue, {&landmarks_});
}

void TemplateStages::upload_template(Queue& queue, const TemplateData& data) {
    const auto upload = [&](DeviceBuffer& buffer, const auto& values) {
        buffer = buffer_for(device_, values);
        write_all(queue, buffer, values);
    };
    upload(nodes_, data.nodes);
    upload(edges_, data.edges);
    upload(points_, data.vertices);
    upload(sparse_points_, sparse_vertices(data));
    upload(landmarks_, data.landmarks);
    upload(landmark_points_, data.landmark_points);
    upload(patches_, data.patches);
    upload(check_patches_, data.checks);
    upload(rig_patches_, rig_patches(data));
    upload(slopes_, slopes_of(data, data.patches));
    upload(check_slopes_, slopes_of(data, data.checks));
    upload(rig_slopes_, slopes_of(data, rig_patches(data)));
    upload(views_, data.image);
}

void TemplateStages::make_region(const TemplateData& data) {
    const RegionLists& lists = region_.emplace(data, sparse_vertices(data)).lists();
    region_buffers_ = {buffer_for(device_, lists.nodes), buffer_for(device_, lists.edges),
                       buffer_for(device_, lists.points), buffer_for(device_, lists.landmarks),
                       buffer_for(device_, lists.patches)};
}

defrec_lm_params TemplateStages::params_of_region(defrec_lm_params whole) const {
    const RegionLists& lists = region_->lists();
    whole.nodes = count_of(lists.nodes) / 3;
    whole.edges = count_of(lists.edges);
    whole.points = count_of(lists.points);
    return whole;
}

// Motions of the control points that a region has beyond the template's, which never move.
void TemplateStages::write_pair(Queue& queue) {
    const std::vector<defrec_motion> rest(SolveRegion::kPair,
                                          DualQuaternion<float>::identity().store());
    const uint64_t offset = start_.size() - bytes_of(rest);
    queue.write(start_, rest.data(), bytes_of(rest), offset);
    for (const Pass& pass : passes_) queue.write(pass.motions, rest.data(), bytes_of(rest), offset);
}

// Whether a part of the map is enough for a frame that starts with these motions. Prepares the
// stages anew where it is another part than before.
bool TemplateStages::choose_region(Queue& queue, std::span<const defrec_motion> start) {
    const SolveRegion::Choice choice = region_->choose(start);
    if (choice != SolveRegion::Choice::kOther) return choice == SolveRegion::Choice::kSame;
    const RegionLists& lists = region_->lists();
    const RegionBuffers& buffers = region_buffers_;
    write_all(queue, buffers.nodes, lists.nodes);
    write_all(queue, buffers.edges, lists.edges);
    write_all(queue, buffers.points, lists.points);
    write_all(queue, buffers.landmarks, lists.landmarks);
    write_all(queue, buffers.patches, lists.patches);
    for (const Pass& pass : passes_)
        pass.solve_region->prepare(queue, {&buffers.nodes, &buffers.edges, &buffers.points,
                                           &buffers.landmarks, &buffers.patches});
    return true;
}

void TemplateStages::make_buffers(const TemplateData& data) {
    const auto buffer = [&](uint64_t count, uint64_t size) {
        return DeviceBuffer(device_, std::max<uint64_t>(count * size, kMinBytes));
    };
    const size_t nodes = region_ ? region_->lists().nodes.size() / 3 : node_count(data);
    start_ = buffer(nodes, sizeof(defrec_motion));
    matches_ = buffer(data.landmarks.size(), sizeof(defrec_match));
    weighted_ = buffer(data.landmarks.size(), sizeof(defrec_match));
    ransac_summary_ = buffer(1, sizeof(defrec_ransac_summary));
    lm_summary_ = buffer(1, sizeof(defrec_lm_summary));
    predictions_ = buffer(data.patches.size(), sizeof(defrec_patch_prediction));
    observations_ = buffer(data.patches.size(), sizeof(defrec_patch_observation));
    check_predictions_ = buffer(data.checks.size(), sizeof(defrec_patch_prediction));
    checks_ = buffer(data.checks.size(), sizeof(defrec_patch_observation));
    right_observations_ = buffer(rig_patch_count(data), sizeof(defrec_patch_observation));
    samples_ = buffer(data.vertices.size(), sizeof(defrec_surface_sample));
}

defrec_align_params TemplateStages::align_params(const TemplateData& data, uint32_t patches) const {
    auto align = make_params<defrec_align_params>();
    align.patches = patches;
    align.nodes = node_count(data);
    align.views = static_cast<uint32_t>(data.views());
    align.width = data.width;
    align.height = data.height;
    align.camera = camera_;
    return align;
}

std::unique_ptr<DeviceStage> TemplateStages::make_align(uint32_t level, uint32_t radius,
                                                        const TemplateData& data) const {
    defrec_align_params align = align_params(data, count_of(data.patches));
    align.level = level;
    align.search_radius = radius;
    return make_stage<DEFREC_STAGE_ALIGN>(device_, align);
}

void TemplateStages::prepare_search(Queue& queue, Pass& pass, const TemplateData& data) {
    const PatchSearch& search = *pass.pass.search;
    pass.align = make_align(search.level, search.radius, data);
    pass.align_widely =
        make_align(search.level + check_level(data.width), search.wide_radius, data);
    for (const auto& align : {&pass.align, &pass.align_widely})
        (*align)->prepare(queue, {&patches_, &views_, &slopes_});
}

// Compares rather than searches: what is found lies within a pixel or two of the surface.
std::unique_ptr<DeviceStage> TemplateStages::make_check(const TemplateData& data) const {
    defrec_align_params align = align_params(data, count_of(data.checks));
    align.level = check_level(data.width);
    align.patch_radius = decisions::CheckPatches::kCheckRadius;
    align.search_radius = StageParameters::kCheckSearchRadius - check_level(data.width);
    align.min_score = 1;
    return make_stage<DEFREC_STAGE_ALIGN>(device_, align);
}

// Coarse and wide: it is the rows of a few hundred patches together that count.
std::unique_ptr<DeviceStage> TemplateStages::make_right_search(const TemplateData& data) const {
    defrec_align_params align = align_params(data, static_cast<uint32_t>(rig_patch_count(data)));
    align.level = StageParameters::kRightSearchLevel;
    align.search_radius = StageParameters::kRightSearchRadius;
    align.right_view = 1;
    return make_stage<DEFREC_STAGE_ALIGN>(device_, align);
}

defrec_lm_params TemplateStages::solve_params(const SolverPass& pass,
                                              const TemplateData& data) const {
    auto lm = make_params<defrec_lm_params>();
    lm.nodes = node_count(data);
    lm.edges = count_of(data.edges);
    lm.points = static_cast<uint32_t>(sparse_points_.size() / sizeof(defrec_surface_point));
    lm.landmarks = count_of(data.landmarks);
    lm.patches = count_of(data.patches);
    lm.width = data.width;
    lm.height = data.height;
    lm.camera = camera_;
    lm.node_spacing_mm = static_cast<float>(data.node_spacing_mm);
    // An edge's weight follows the data of its control points, of which each has less the denser
    // they are.
    const double density = default_node_spacing(data.width) / data.node_grid.spacing_u;
    lm.arap_weight = settings_.arap_weight * pass.stiffness * static_cast<float>(density * density);
    lm.rotation_weight = StageParameters::kRotationWeight;
    lm.icp_weight = StageParameters::kIcpWeight;
    lm.cg_iterations = pass.cg_iterations;
    lm.match_threshold_mm = StageParameters::kMatchThreshold;
    lm.iterations = pass.iterations != nullptr ? settings_.*pass.iterations : 1;
    lm.presolve = pass.presolve ? 1 : 0;
    lm.trust_last_step = 1;
    lm.match_weight = pass.match_weight;
    lm.patch_tukey_px = pass.patch_tukey_px;
    lm.icp_tukey_mm = pass.icp_tukey_mm;
    return lm;
}

void TemplateStages::start(Queue& queue, std::span<const defrec_motion> motions,
                           const RegistrationPlan& plan) {
    uses_region_ = region_ && !plan.whole_map && choose_region(queue, motions);
    queue.write(start_, motions.data(), motions.size_bytes());
}

void TemplateStages::enqueue(Queue& queue, const Observation& observed,
                             const RegistrationPlan& plan, const DeviceBuffer* samples,
                             StageTimer& timer, FrameOutput& output) {
    if (samples == nullptr) samples = &samples_;
    // What lies outside of the image follows a whole solution, and in between the rigid motion of
    // the matches alone.
    const bool solves_whole_coarsely = partly_solved_ % decisions::MapPart::kWholeEvery == 0;
    partly_solved_ = uses_region_ ? partly_solved_ + 1 : 0;
    const DeviceBuffer* disparity = plan.uses_depth ? &observed.disparity : nullptr;
    // With positions in depth.
    const DeviceBuffer* matches = plan.uses_depth && match_ != nullptr ? &weighted_ : nullptr;
    if (match_ != nullptr) {
        match_->enqueue(queue, {&observed.feature_count, &observed.features, &observed.disparity},
                        {&matches_});
        timer.end("match");
        ransac_->enqueue(queue, {&matches_}, {&weighted_, &ransac_summary_});
        timer.end("ransac");
    }
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
        solver.enqueue(queue, {motions, matches, observations, disparity}, {&result, &lm_summary_});
        timer.end(pass.time_name);
        motions = &result;
    }
    const bool is_checked = plan.quality_level != QualityLevel::kUnchecked;
    if (is_checked) check_surface(queue, observed, motions, timer);
    warp_->enqueue(queue, {motions, disparity}, {samples});
    timer.end("warp");
    queue.read(*motions, output.motions.data(), bytes_of(output.motions));
    read_back(queue, *samples, is_checked, output);
}

void TemplateStages::check_surface(Queue& queue, const Observation& observed,
                                   const DeviceBuffer* motions, StageTimer& timer) {
    check_->enqueue(queue, {&observed.gray[0], &observed.mask[0], motions, nullptr},
                    {&checks_, &check_predictions_});
    timer.end("check");
    if (!right_search_) return;
    right_search_->enqueue(queue, {&observed.gray[1], &observed.mask[1], motions, nullptr},
                           {&right_observations_, nullptr});
    timer.end("align right");
}

void TemplateStages::read_back(Queue& queue, const DeviceBuffer& samples, bool is_checked,
                               FrameOutput& output) const {
    queue.read(samples, output.samples.data(), bytes_of(output.samples));
    if (is_checked) {
        if (right_search_)
            queue.read(right_observations_, output.right_observations.data(),
                       bytes_of(output.right_observations));
        queue.read(checks_, output.checks.data(), bytes_of(output.checks));
        queue.read(check_predictions_, output.check_predictions.data(),
                   bytes_of(output.check_predictions));
    } else {
        const auto find_none = [](auto records) {
            std::fill(records.begin(), records.end(), typename decltype(records)::value_type{});
        };
        find_none(output.right_observations);
        find_none(output.checks);
        find_none(output.check_predictions);
    }
    queue.read(weighted_, output.matches.data(), bytes_of(output.matches));
    queue.read(observations_, output.observations.data(), bytes_of(output.observations));
    queue.read(predictions_, output.predictions.data(), bytes_of(output.predictions));
    queue.read(ransac_summary_, &output.summary->ransac, sizeof output.summary->ransac);
}

}  // namespace defrec
