// Stage lm: the control points' motions that fit a frame best (docs/stages/lm.md).
#include <optional>

#include "backends/reference/lm_problem.hpp"
#include "backends/reference/stages.hpp"
#include "backends/shared/presolve.hpp"

namespace defrec::reference {
namespace {

class Lm : public Stage {
  public:
    Lm(const defrec_lm_params& params, const Host& host)
        : params_(params),
          host_(host),
          surface_(host),
          nodes_(params.nodes, HostAllocator<NodePose<double>>(host)),
          trial_(params.nodes, HostAllocator<NodePose<double>>(host)),
          step_(params.nodes * size_t(6), HostAllocator<double>(host)),
          deformed_(params.landmarks, HostAllocator<Vec3<double>>(host)) {}

    void prepare(std::span<const InBuffer> in) override {
        problem_.reset();
        surface_.read(params_, in);
        problem_.emplace(params_, surface_, host_);
    }

    void run(std::span<const InBuffer> in, std::span<const OutBuffer> out) override {
        if (!problem_) throw StageError(DEFREC_ERROR_STATE, "lm: run before prepare");
        const LmFrame frame = LmFrame::read(params_, in);
        expect_buffers("lm out", out, 2);
        auto* motions = take<defrec_motion>("lm motions", out[0], params_.nodes);
        auto* summary = take<defrec_lm_summary>("lm summary", out[1], 1);

        for (size_t i = 0; i < params_.nodes; ++i) {
            const auto motion = usable_motion<double>(frame.motions[i]);
            nodes_[i] = {motion.real, apply(motion, surface_.nodes[i])};
        }
        problem_->set_frame(frame);
        if (params_.presolve != 0 && frame.matches != nullptr) move_rigidly(frame.matches);
        *summary = levenberg_marquardt(*problem_, params_, std::span(nodes_), std::span(trial_), std::span(step_));
        write_motions(frame, summary->failed != 0, motions);
    }

  private:
    void move_rigidly(const defrec_match* matches) {
        problem_->deform_landmarks(nodes_, deformed_);
        const auto motion = presolve(matches, deformed_, double(params_.match_tukey_mm));
        for (NodePose<double>& node : nodes_) node = {motion.real * node.rotation, apply(motion, node.position)};
    }

    void write_motions(const LmFrame& frame, bool failed, defrec_motion* motions) const {
        for (size_t i = 0; i < params_.nodes; ++i) {
            const NodePose<double>& node = nodes_[i];
            const auto motion = failed ? usable_motion<double>(frame.motions[i])
                                       : from_rigid(node.rotation, node.position - rotate(node.rotation, surface_.nodes[i]));
            motions[i] = motion.store();
        }
    }

    defrec_lm_params params_;
    Host host_;
    LmTemplate surface_;
    HostVector<NodePose<double>> nodes_, trial_;
    HostVector<double> step_;
    HostVector<Vec3<double>> deformed_;
    std::optional<LmProblem> problem_;
};

}  // namespace

std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, const Host& host) { return std::make_unique<Lm>(params, host); }

}  // namespace defrec::reference
