// The linear system of stage lm: a symmetric matrix of 6x6 blocks of which the lower half is
// stored, and its solution.
#pragma once
#include "backends/shared/block_pattern.hpp"

namespace defrec::cpu {

// Where the blocks below the diagonal are: row i has blocks start[i] .. start[i + 1] - 1, in
// columns below i, ascending.
struct LowerPattern {
    HostVector<uint32_t> start;
    HostVector<int32_t> column;

    LowerPattern(const BlockPattern& pattern, const Host& host);
    size_t rows() const { return start.size() - 1; }
    size_t blocks() const { return column.size(); }
    // row > column
    size_t find(int32_t row, int32_t column_of_row) const;
};

// Blocks are stored column-major, 36 entries and four that are 0, so that each begins at a multiple
// of the SIMD width.
constexpr size_t kBlockFloats = 40;

struct LmSystem {
    HostVector<float> lower, diagonal;  // kBlockFloats each, in the order of the pattern
    HostVector<float> gradient;         // half the cost's, 6 per row

    LmSystem(const LowerPattern& pattern, const Host& host);
};

// What solving needs besides; made once.
struct LmWorkspace {
    HostVector<float> damped;   // diagonal blocks with damping
    HostVector<float> inverse;  // of them
    HostVector<float> x, residual, direction, product, conditioned;
    HostVector<float> spread;  // direction: each entry six times
    HostVector<float>
        transposed;  // partial sums of the upper half's products, kBlockFloats per row

    LmWorkspace(const LowerPattern& pattern, const Host& host);
};

struct SolveTask {
    const LowerPattern* pattern;
    const LmSystem* system;
    LmWorkspace* workspace;
    float lambda;
    uint32_t iterations;  // of conjugate gradients; 0: every control point by itself
};
// The solution is in workspace->x; false if it is not finite.
bool solve_system(const SolveTask& task);

}  // namespace defrec::cpu
