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

// The blocks above the diagonal likewise, and of which below it each is the transpose.
struct UpperPattern {
    HostVector<uint32_t> start;
    HostVector<int32_t> column;
    HostVector<uint32_t> transposed;

    UpperPattern(const LowerPattern& lower, const Host& host);
};

// Rows [first, last), by one thread at a time. first is a multiple of kPartStep, and so the
// vectors' numbers that belong to it begin at a multiple of 16.
struct LmPart {
    size_t first, last;
    size_t first_number() const { return 6 * first; }
    size_t last_number() const { return (6 * last + 15) / 16 * 16; }
};
// The number of parts is a power of two, which threads mostly share equally; it is largest from
// 1,024 rows on.
constexpr size_t kPartStep = 8, kMinPartRows = 64, kMaxParts = 16;

// What solving needs besides; made once.
struct LmWorkspace {
    HostVector<LmPart> parts;
    UpperPattern upper;
    HostVector<double> sums;     // one per part
    HostVector<float> above;     // blocks above the diagonal
    HostVector<float> damped;    // diagonal blocks with damping
    HostVector<float> inverse;   // of them
    HostVector<float> spread;    // per row a block, of `conditioned` a number down each column
    HostVector<float> products;  // per row a block whose columns are yet to be added up
    // Conjugate gradients; images by the matrix.
    HostVector<float> x, residual, conditioned, conditioned_image, direction, image;

    LmWorkspace(const LowerPattern& pattern, const Host& host);
};

struct SolveTask {
    const LowerPattern* pattern;
    const LmSystem* system;
    LmWorkspace* workspace;
    const Host* host;
    float lambda;
    uint32_t iterations;  // of conjugate gradients; 0: every control point by itself
};
// The solution is in workspace->x; false if it is not finite.
bool solve_system(const SolveTask& task);

}  // namespace defrec::cpu
