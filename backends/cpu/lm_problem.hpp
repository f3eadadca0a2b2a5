// The cost of stage lm, its linearised system and its solution on the CPU: groups of the surface
// and pieces of the edges in parallel, then the rows of the system, each of which adds their sums
// in one order, so that the number of threads does not show in the result.
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
    static constexpr size_t kTasks = 24;  // that the groups are shared out to
    void set_nodes(std::span<const NodePose<double>> nodes);
    void list_row_groups();
    void sum_surface(size_t task, bool linearise);
    void sum_arap(size_t piece, bool linearise);
    void measure_data();
    void weigh_edges(size_t piece);
    void assemble(size_t part);
    LmSums total() const;

    const defrec_lm_params& params_;
    const LmTemplate& surface_;
    Host host_;
    LowerPattern pattern_;
    LmGroups groups_;
    LmEdges edges_;
    DisparityImage image_{};
    HostVector<GroupPlaces> places_;
    HostVector<uint32_t> unconnected_;  // blocks of the lower half that no edge writes
    HostVector<LmGroupSums> sums_;
    HostVector<uint32_t> row_start_;  // row i's entries of row_groups_ are row_start_[i] .. [i + 1]
    HostVector<RowGroup> row_groups_;
    HostVector<float> scratch_;
    HostVector<int32_t> offsets_;
    HostVector<NodeMotion> motions_;
    HostVector<float> poses_, edge_nodes_;
    HostVector<double> data_;
    double usual_data_ = 0;
    std::array<LmSums, kTasks> task_sums_{};
    HostVector<double> arap_costs_;  // of the pieces
    LmSystem present_, trial_;
    LmWorkspace workspace_;
};

}  // namespace defrec::cpu
