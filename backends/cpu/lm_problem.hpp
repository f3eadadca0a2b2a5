// The cost of stage lm, its linearised system and its solution on the CPU: groups of the surface
// and the edges in parallel, then their sums added in one order, so that the number of threads does
// not show in the result.
#pragma once
#include "backends/cpu/lm_edges.hpp"
#include "backends/cpu/lm_groups.hpp"
#include "backends/cpu/lm_system.hpp"

namespace defrec::cpu {

class LmProblem {
  public:
    // surface: prepared; it and params outlive the problem.
    LmProblem(const defrec_lm_params& params, const LmTemplate& surface, const Host& host);

    void set_frame(const LmFrame& frame);

    // What levenberg_marquardt asks of a problem.
    LmSums begin(std::span<const NodePose<double>> nodes);
    LmSums evaluate(std::span<const NodePose<double>> nodes, bool linearise);
    void accept() { std::swap(present_, trial_); }
    bool solve(double lambda, double* step);

  private:
    static constexpr size_t kTasks = 12;

    void set_nodes(std::span<const NodePose<double>> nodes);
    void sum_surface(size_t task, bool linearise);
    void sum_arap(bool linearise);
    void measure_data();
    void assemble();
    LmSums total() const;

    const defrec_lm_params& params_;
    const LmTemplate& surface_;
    Host host_;
    LowerPattern pattern_;
    LmGroups groups_;
    LmEdges edges_;
    DisparityImage image_{};
    HostVector<std::array<uint32_t, LmGroupSums::kPairs>>
        places_;  // of each group's blocks: in the lower half, or a control point
    HostVector<uint32_t> unconnected_;  // blocks of the lower half that no edge writes
    HostVector<LmGroupSums> sums_;
    HostVector<float> scratch_;
    HostVector<NodeMotion> motions_;
    HostVector<float> poses_, edge_nodes_;
    HostVector<double> data_;
    double arap_cost_ = 0;
    LmSystem present_, trial_;
    LmWorkspace workspace_;
};

}  // namespace defrec::cpu
