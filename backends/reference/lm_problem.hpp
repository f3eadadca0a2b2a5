// The cost of stage lm, its linearised system and its two solvers, in plain double precision
// (docs/stages/lm.md). One frame at a time.
#pragma once
#include "backends/definition/lm_inputs.hpp"
#include "backends/shared/levenberg_marquardt.hpp"
#include "backends/shared/lm_terms.hpp"

namespace defrec::reference {

// The normal equations: blocks in the order of the template's pattern, and half the gradient of the
// cost.
struct LmSystem {
    HostVector<double> blocks;    // 36 each, row-major
    HostVector<double> gradient;  // 6 per control point

    LmSystem(const BlockPattern& pattern, const Host& host)
        : blocks(pattern.blocks() * 36, HostAllocator<double>(host)),
          gradient(pattern.rows() * 6, HostAllocator<double>(host)) {}
};

class LmProblem {
  public:
    // surface: prepared; it and params outlive the problem.
    LmProblem(const defrec_lm_params& params, const LmTemplate& surface, const Host& host);

    void set_frame(const LmFrame& frame) { frame_ = frame; }
    // What levenberg_marquardt asks of a problem.
    LmSums begin(std::span<const NodePose<double>> nodes);
    LmSums evaluate(std::span<const NodePose<double>> nodes, bool linearise);
    void accept() { std::swap(present_, trial_); }
    bool solve(double lambda, double* step);

    // The system of the last evaluation that linearised.
    const LmSystem& linearised() const { return trial_; }

  private:
    void blend_motions(std::span<const NodePose<double>> nodes);
    void add_points(LmSums& sums);
    void add_matches(LmSums& sums);
    void add_patches(LmSums& sums);
    double add_edges(std::span<const NodePose<double>> nodes);
    void measure_data();
    template <class Item>
    void add_sighting(const Item& item, const Sighting<double>& sighting, double weight,
                      double inverse_a, double inverse_c2, double unit, LmSums::Term& term);
    template <class Item>
    void add_rows(const Item& item, std::span<const Row<double>> rows, double weight);
    void add_term(const defrec_edge& edge, const ArapTerm<double>& term);
    void damp(double lambda);
    bool solve_blocks(const double* right, double* x) const;
    bool solve_coupled(const double* right, double* x);
    void multiply(const double* x, double* product) const;

    const defrec_lm_params& params_;
    const LmTemplate& surface_;
    LmFrame frame_{};
    bool linearise_ = false;
    LmSystem present_, trial_;
    HostVector<DualQuaternion<double>> motions_;
    HostVector<NodePose<double>> poses_;
    HostVector<double> data_;        // weight of the data at each control point
    HostVector<double> arap_scale_;  // of each edge
    HostVector<double> diagonal_;    // damped, 6 per control point
    HostVector<double> residual_, direction_, product_, conditioned_, right_;  // of the solvers
};

}  // namespace defrec::reference
