// Stage lm from buffers to buffers; the cost and its solvers are a backend's Problem
// (levenberg_marquardt.hpp), which is made in prepare and told of each frame by set_frame.
#pragma once
#include <memory>

#include "backends/definition/lm_inputs.hpp"
#include "backends/definition/presolve.hpp"
#include "backends/shared/levenberg_marquardt.hpp"

namespace defrec {

template <class Problem>
class LmStage : public Stage {
  public:
    LmStage(const defrec_lm_params& params, const Host& host)
        : params_(params),
          host_(host),
          motions_(params.nodes, HostAllocator<DualQuaternion<double>>(host)),
          nodes_(params.nodes, HostAllocator<NodePose<double>>(host)),
          trial_(params.nodes, HostAllocator<NodePose<double>>(host)),
          step_(params.nodes * size_t(6), HostAllocator<double>(host)),
          deformed_(params.landmarks, HostAllocator<Vec3<double>>(host)),
          squared_errors_(params.landmarks, HostAllocator<double>(host)) {}

    void prepare(std::span<const InBuffer> in) override {
        auto prepared = std::make_unique<Prepared>(params_, in, host_);  // keeps the one before
        prepared_ = std::move(prepared);
        const size_t nodes = prepared_->surface.nodes.size();
        motions_.resize(nodes);
        nodes_.resize(nodes);
        trial_.resize(nodes);
        step_.resize(6 * nodes);
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!prepared_) throw StageError(DEFREC_ERROR_STATE, "lm: run before prepare");
        const LmTemplate& surface = prepared_->surface;
        Problem& problem = prepared_->problem;
        const auto given = view_buffers<LmBuffers>(params_, in, out);
        const LmFrame frame = frame_of(params_, given);

        for_each_item(host_, nodes_.size(), [&](size_t i) {
            motions_[i] = usable_motion<double>(frame.motions[surface.given_node[i]]);
            nodes_[i] = {motions_[i].real, apply(motions_[i], surface.nodes[i])};
        });
        auto rigid = DualQuaternion<double>::identity();
        if (params_.presolve != 0 && frame.matches != nullptr) rigid = move_rigidly(frame.matches);
        problem.set_frame(frame);
        *given.summary = levenberg_marquardt(problem, params_, host_, std::span(nodes_),
                                             std::span(trial_), std::span(step_));
        if (nodes_.size() < params_.nodes)
            for (size_t i = 0; i < params_.nodes; ++i) {
                const auto motion = usable_motion<double>(frame.motions[i]);
                given.results[i] =
                    (given.summary->failed ? motion : compose(rigid, motion)).store();
            }
        for_each_item(host_, nodes_.size(), [&](size_t i) {
            const NodePose<double>& node = nodes_[i];
            if (!given.summary->failed)
                motions_[i] = from_rigid(node.rotation,
                                         node.position - rotate(node.rotation, surface.nodes[i]));
            given.results[surface.given_node[i]] = motions_[i].store();
        });
    }

  private:
    DualQuaternion<double> move_rigidly(const defrec_match* matches) {
        for_each_item(host_, deformed_.size(), [&](size_t i) {
            if (!preselected(matches[i])) return;
            const defrec_surface_point& landmark = prepared_->surface.landmarks[i];
            deformed_[i] = apply(blend<double>(motions_.data(), landmark.node, landmark.weight),
                                 load3<double>(landmark.position));
        });
        const auto motion =
            presolve(host_, matches, deformed_, double(params_.match_tukey_mm), squared_errors_);
        for (NodePose<double>& node : nodes_)
            node = {motion.real * node.rotation, apply(motion, node.position)};
        return motion;
    }

    // What nothing refers to is left out and stays where it is; of a large map that may be the
    // most.
    struct Prepared {
        Prepared(const defrec_lm_params& params, std::span<const InBuffer> in, const Host& host)
            : surface(host), problem(params, (surface.read(params, in, true), surface), host) {}
        LmTemplate surface;
        Problem problem;  // of the surface
    };

    defrec_lm_params params_;
    Host host_;
    HostVector<DualQuaternion<double>> motions_;  // as given
    HostVector<NodePose<double>> nodes_, trial_;
    HostVector<double> step_;
    HostVector<Vec3<double>> deformed_;  // landmarks
    HostVector<double> squared_errors_;  // of them
    std::unique_ptr<Prepared> prepared_;
};

}  // namespace defrec
