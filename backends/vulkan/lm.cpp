// Stage lm in shaders: a fixed sequence of them for all iterations; what decides lies on the
// device. docs/stages/lm.md.
#include "backends/vulkan/lm.hpp"

#include <algorithm>

#include "backends/shared/plain_host.hpp"
#include "backends/vulkan/lm_blocks.hpp"
#include "backends/vulkan/shaders/lm_structs.h"
#include "backends/vulkan/stages.hpp"
#include "shaders.hpp"

namespace defrec::vulkan {
namespace {

struct LmPush {
    LmConstants constants;
    LmRun run;
};
constexpr uint32_t kPresolveGroup = 256, kWidePresolveGroup = 512;
constexpr uint64_t kVector = 16;
constexpr uint64_t kDiagonalVectors = kBlockVectors + 2, kGradientVectors = 2 * (2 * 3 + 5);

constexpr uint64_t kMaxDispatches = 65536;  // recorded: each has a descriptor set
// lavapipe ends loops, those of one invocation together, after 65,535 rounds.
constexpr size_t kLongestLoop = 50000;
constexpr uint32_t kMaxPresolveLandmarks = 2000 * kPresolveGroup;  // 17 times over all, and once
                                                                   // over the control points
constexpr uint32_t kMaxItems = 1u << 28;                           // lm_blocks.glsl

// The template, and everything that a run of it writes.
struct Surface {
    uint32_t edges, blocks, data_groups;
    Buffer rest, items, item_nodes, edge_list, block_list, item_terms, edge_terms, row_starts,
        columns;
    Buffer trial, present, records, edge_records, edge_costs, data, terms, moves, states;
    Buffer matrix, diagonal, inverses, vectors, progress, products;
    Buffer deformed;

    Surface(Device& device, const LmBlocks& lists, const defrec_lm_params& p,
            const LmSplits& splits)
        : edges(uint32_t(lists.edges.size())),
          blocks(uint32_t(lists.blocks.size())),
          data_groups(cover(uint64_t{p.nodes} * splits.data, kBlockGroup)),
          rest(device.upload(lists.rest)),
          items(device.upload(lists.items)),
          item_nodes(device.upload(lists.item_nodes)),
          edge_list(device.upload(lists.edges)),
          block_list(device.upload(lists.blocks)),
          item_terms(device.upload(lists.item_terms)),
          edge_terms(device.upload(lists.edge_terms)),
          row_starts(device.upload(lists.row_starts)),
          columns(device.upload(lists.columns)),
          trial(device, kVector * kNodeVectors * p.nodes),
          present(device, trial.size()),
          records(device, kVector * kRecordVectors * lists.item_nodes.size()),
          edge_records(device, kVector * kEdgeVectors * edges),
          edge_costs(device, sizeof(float) * edges),
          data(device, sizeof(float) * (p.nodes + 4 * uint64_t{data_groups})),
          terms(device, sizeof(LmTerm) * residual_groups(p, edges)),
          moves(device, 2 * sizeof(float) * cover(p.nodes, kNodeGroup)),
          states(device, 2 * sizeof(LmState)),
          matrix(device, kVector * kBlockVectors * lists.columns.size()),
          diagonal(device, kVector * kDiagonalVectors * p.nodes),
          inverses(device, kVector * kBlockVectors * p.nodes),
          vectors(device, kVector * kGradientVectors * p.nodes),
          progress(device, 2 * sizeof(LmGradients)),
          products(device, 4 * sizeof(float) * cover(uint64_t{p.nodes} * splits.row, kBlockGroup)),
          deformed(device, kVector * p.landmarks) {}

    static uint32_t residual_groups(const defrec_lm_params& p, size_t edges) {
        return cover(p.points, kResidualGroup) + cover(p.landmarks, kResidualGroup) +
               cover(p.patches, kResidualGroup) + cover(edges, kResidualGroup);
    }
};

class Lm final : public Stage {
  public:
    Lm(const defrec_lm_params& params, Device& device, const LmSplits& splits)
        : p_(params),
          device_(device),
          splits_(splits),
          presolve_(device.kernel(shaders::lm_presolve,
                                  {device.wide() ? kWidePresolveGroup : kPresolveGroup})),
          start_(device.kernel(shaders::lm_start)),
          points_(device.kernel(shaders::lm_residuals, {0})),
          landmarks_(device.kernel(shaders::lm_residuals, {1})),
          patches_(device.kernel(shaders::lm_residuals, {2})),
          data_(device.kernel(shaders::lm_data, {splits.data})),
          edges_(device.kernel(shaders::lm_edges)),
          diagonal_(device.kernel(shaders::lm_system, {splits.own, 1})),
          above_(device.kernel(shaders::lm_system, {splits.above, 0})),
          step_(device.kernel(shaders::lm_step, {splits.row})),
          move_(device.kernel(shaders::lm_move, {splits.row})),
          finish_(device.kernel(shaders::lm_finish)) {}

    void prepare(std::span<const InBuffer> in) override {
        const Host host(&plain_host());
        LmTemplate surface(host);
        surface.read(p_, in);
        const LmBlocks lists(p_, surface);
        check_size(
            "lm", "residuals of a control point", lists.longest,
            kLongestLoop * std::min({splits_.data, splits_.own, splits_.above, splits_.row}));
        const uint64_t max_groups = device_.limits().maxComputeWorkGroupCount[0];
        check_size("lm", "control points", p_.nodes,
                   max_groups * kBlockGroup / std::max({splits_.data, splits_.own, splits_.row}));
        check_size("lm", "connected pairs of control points", lists.blocks.size(),
                   max_groups * kBlockGroup / splits_.above);
        check_size("lm", "work groups of residuals",
                   Surface::residual_groups(p_, lists.edges.size()), max_groups);
        surface_ = std::make_unique<Surface>(device_, lists, p_, splits_);
    }

    void record(Recorder& recorder, Buffers in, Buffers out) override {
        if (!surface_) throw StageError(DEFREC_ERROR_STATE, "lm: run before prepare");
        const auto given = view_buffers<LmBuffers>(p_, sizes_of_inputs(in), sizes_of_outputs(out));
        const FrameBuffers frame{
            .motions = in[0],
            .matches = given.matches != nullptr ? in[1] : nullptr,
            .observations = given.observations != nullptr ? in[2] : nullptr,
            .disparity = given.disparity != nullptr ? in[3] : nullptr,
            .moved = out[0],
            .summary = out[1],
        };
        LmPush push = first_push(frame);
        record_start(recorder, frame, push);
        record_residuals(recorder, frame, push);
        record_data_weights(recorder, push);
        for (uint32_t i = 0; i < p_.iterations; ++i) {
            push.run.evaluation = i;
            record_system(recorder, push);
            record_gradients(recorder, push);
            const bool trusts = p_.trust_last_step != 0 && i + 1 == p_.iterations;
            const bool ends = trusts && gradient_steps(p_) > 0;
            if (ends) push.run.given |= kTrustsLastStep;
            record_move(recorder, frame, push);
            if (ends) return;
            push.run.evaluation = i + 1;
            push.run.step = 0;
            if (trusts) {
                push.run.given |= kTrustsLastStep;
                break;
            }
            record_residuals(recorder, frame, push);
        }
        record_finish(recorder, frame, push);
    }

  private:
    // The buffers that a run is given, nullptr for the absent ones, and those that it fills.
    struct FrameBuffers {
        const Buffer *motions, *matches, *observations, *disparity;
        const Buffer *moved, *summary;
    };

    // Without control points, too, somebody gives out the summary.
    Groups node_groups() const { return {std::max(cover(p_.nodes, kNodeGroup), 1u)}; }
    Groups shared_groups(uint32_t split) const {
        return {std::max(cover(uint64_t{p_.nodes} * split, kBlockGroup), 1u)};
    }

    void record_start(Recorder& recorder, const FrameBuffers& frame, const LmPush& push) const {
        const Surface& s = *surface_;
        if (p_.presolve != 0 && frame.matches != nullptr)
            recorder.dispatch(
                presolve_,
                {frame.motions, s.items, s.item_nodes, frame.matches, s.deformed, s.rest, s.trial},
                push, {1});
        else
            recorder.dispatch(start_, {frame.motions, s.rest, s.trial}, push, node_groups());
    }

    // Each waits only for what it looks at.
    void record_residuals(Recorder& recorder, const FrameBuffers& frame, const LmPush& push) const {
        const Surface& s = *surface_;
        recorder.dispatch(points_,
                          {frame.disparity, s.items, s.item_nodes, s.trial, nullptr, nullptr,
                           s.records, s.terms, s.states},
                          push, {cover(p_.points, kResidualGroup)});
        recorder.beside(landmarks_,
                        {nullptr, s.items, s.item_nodes, s.trial, frame.matches, nullptr, s.records,
                         s.terms, s.states},
                        push, {cover(p_.landmarks, kResidualGroup)});
        recorder.beside(patches_,
                        {nullptr, s.items, s.item_nodes, s.trial, nullptr, frame.observations,
                         s.records, s.terms, s.states},
                        push, {cover(p_.patches, kResidualGroup)});
        recorder.beside(
            edges_, {s.edge_list, s.trial, s.data, s.edge_costs, s.edge_records, s.terms, s.states},
            push, {cover(s.edges, kResidualGroup)});
    }

    void record_data_weights(Recorder& recorder, const LmPush& push) const {
        const Surface& s = *surface_;
        recorder.dispatch(
            data_,
            {s.block_list, s.item_terms, s.items, s.records, s.edge_terms, s.edge_costs, s.data},
            push, {s.data_groups});
    }

    void record_system(Recorder& recorder, const LmPush& push) const {
        const Surface& s = *surface_;
        const std::initializer_list<Binding> buffers = {
            s.states,   s.terms,    s.moves,        s.block_list, s.item_terms, s.edge_terms,
            s.items,    s.records,  s.edge_records, s.trial,      s.present,    s.matrix,
            s.diagonal, s.inverses, s.vectors,      s.data};
        recorder.dispatch(diagonal_, buffers, push, shared_groups(splits_.own));
        recorder.beside(above_, buffers, push,
                        {cover(uint64_t{s.blocks - p_.nodes} * splits_.above, kBlockGroup)});
    }

    // Leaves the number of steps in the push constants.
    void record_gradients(Recorder& recorder, LmPush& push) const {
        const Surface& s = *surface_;
        const uint32_t steps = gradient_steps(p_);
        for (push.run.step = 0; push.run.step < steps; ++push.run.step)
            recorder.dispatch(step_,
                              {s.states, s.progress, s.products, s.vectors, s.matrix, s.row_starts,
                               s.columns, s.inverses},
                              push, shared_groups(splits_.row));
    }

    void record_move(Recorder& recorder, const FrameBuffers& frame, const LmPush& push) const {
        const Surface& s = *surface_;
        recorder.dispatch(move_,
                          {s.states, s.progress, s.products, s.vectors, s.rest, s.present, s.trial,
                           s.moves, frame.motions, frame.moved, frame.summary},
                          push, node_groups());
    }

    void record_finish(Recorder& recorder, const FrameBuffers& frame, const LmPush& push) const {
        const Surface& s = *surface_;
        recorder.dispatch(finish_,
                          {s.states, s.terms, s.moves, frame.motions, s.present, s.trial,
                           frame.moved, frame.summary},
                          push, node_groups());
    }

    LmPush first_push(const FrameBuffers& frame) const {
        const uint32_t given = (frame.matches != nullptr ? kMatchesGiven : 0) |
                               (frame.observations != nullptr ? kObservationsGiven : 0);
        return {constants_of(p_),
                {.image = disparity_grid(p_, frame.disparity != nullptr),
                 .edges = surface_->edges,
                 .blocks = surface_->blocks,
                 .data_groups = surface_->data_groups,
                 .given = given,
                 .evaluation = 0,
                 .step = 0}};
    }

    defrec_lm_params p_;
    Device& device_;
    LmSplits splits_;
    std::shared_ptr<const Kernel> presolve_, start_, points_, landmarks_, patches_, data_, edges_,
        diagonal_, above_, step_, move_, finish_;
    std::unique_ptr<Surface> surface_;
};

}  // namespace

std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, Device& device) {
    const LmSplits splits = device.physical().software && !device.wide() ? LmSplits{} : kGpuSplits;
    return make_lm(params, device, splits);
}

std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, Device& device,
                               const LmSplits& splits) {
    check_params(params);
    const uint64_t steps = gradient_steps(params);
    if (params.iterations * (steps + 7) > kMaxDispatches)
        throw StageError(DEFREC_ERROR_UNSUPPORTED,
                         "lm: at most " + std::to_string(kMaxDispatches) +
                             " shaders in a run; each iteration has cg_iterations + 7");
    check_size("lm", "points, landmarks and patches",
               uint64_t{params.points} + params.landmarks + params.patches, kMaxItems);
    if (params.presolve != 0)
        check_size("lm", "landmarks to move rigidly onto matches", params.landmarks,
                   kMaxPresolveLandmarks);
    return std::make_unique<Lm>(params, device, splits);
}

}  // namespace defrec::vulkan
