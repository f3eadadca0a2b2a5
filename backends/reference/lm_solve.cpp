// The two solvers of stage lm: every control point by itself, as the paper does, and all of them
// together by conjugate gradients.
#include <Eigen/Dense>

#include "backends/reference/lm_problem.hpp"

namespace defrec::reference {
namespace {
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
}  // namespace

bool LmProblem::solve(double lambda, double* step) {
    damp(lambda);
    for (size_t i = 0; i < right_.size(); ++i) right_[i] = -present_.gradient[i];
    const bool solved = params_.solver == DEFREC_SOLVER_INDEPENDENT
                            ? solve_blocks(right_.data(), step)
                            : solve_coupled(right_.data(), step);
    return solved &&
           std::all_of(step, step + right_.size(), [](double x) { return std::isfinite(x); });
}

// Marquardt's damping. What has no weight at all gets one, and stays where it is.
void LmProblem::damp(double lambda) {
    for (size_t i = 0; i < surface_.nodes.size(); ++i) {
        const double* block = &present_.blocks[surface_.pattern.find(int32_t(i), int32_t(i)) * 36];
        double trace = 0;
        for (int r = 0; r < 6; ++r) trace += block[7 * r];
        const double minimum = trace > 0 ? kMinDiagonal * trace : 1;
        for (int r = 0; r < 6; ++r)
            diagonal_[i * 6 + size_t(r)] = block[7 * r] * (1 + lambda) + minimum;
    }
}

// The diagonal blocks alone.
bool LmProblem::solve_blocks(const double* right, double* x) const {
    for (size_t i = 0; i < surface_.nodes.size(); ++i) {
        Matrix6 block = Eigen::Map<const Matrix6>(
            &present_.blocks[surface_.pattern.find(int32_t(i), int32_t(i)) * 36]);
        block.diagonal() = Eigen::Map<const Vector6>(&diagonal_[6 * i]);
        const Eigen::LLT<Matrix6> factor(block);
        if (factor.info() != Eigen::Success) return false;
        Eigen::Map<Vector6>(x + 6 * i) = factor.solve(Eigen::Map<const Vector6>(right + 6 * i));
    }
    return true;
}

void LmProblem::multiply(const double* x, double* product) const {
    const BlockPattern& pattern = surface_.pattern;
    for (size_t i = 0; i < pattern.rows(); ++i) {
        Vector6 sum = Vector6::Zero();
        for (size_t b = pattern.row_start(i); b < pattern.row_start(i + 1); ++b) {
            Matrix6 block = Eigen::Map<const Matrix6>(&present_.blocks[b * 36]);
            if (size_t(pattern.column(b)) == i)
                block.diagonal() = Eigen::Map<const Vector6>(&diagonal_[6 * i]);
            sum += block * Eigen::Map<const Vector6>(x + 6 * size_t(pattern.column(b)));
        }
        Eigen::Map<Vector6>(product + 6 * i) = sum;
    }
}

// Conjugate gradients with the diagonal blocks as preconditioner.
bool LmProblem::solve_coupled(const double* right, double* result) {
    using Vector = Eigen::Map<Eigen::VectorXd>;
    const auto size = Eigen::Index(diagonal_.size());
    Vector x(result, size), r(residual_.data(), size), p(direction_.data(), size),
        q(product_.data(), size), z(conditioned_.data(), size);
    x.setZero();
    r = Eigen::Map<const Eigen::VectorXd>(right, size);
    if (!solve_blocks(r.data(), z.data())) return false;
    p = z;
    double rho = r.dot(z);
    const double enough = kConjugateTolerance * kConjugateTolerance * rho;
    for (uint32_t i = 0; i < params_.cg_iterations && rho > enough; ++i) {
        multiply(p.data(), q.data());
        const double curvature = p.dot(q);
        if (!(curvature > 0)) break;
        const double alpha = rho / curvature;
        x += alpha * p;
        r -= alpha * q;
        if (!solve_blocks(r.data(), z.data())) return false;
        const double next = r.dot(z);
        p = z + next / rho * p;
        rho = next;
    }
    return true;
}

}  // namespace defrec::reference
