// The linear system of stage lm: a symmetric matrix of 6x6 blocks of which the lower half is
// stored, and its solution.
#pragma once
#include <array>

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

// Rows [first, last) of the lower half. Its blocks are in columns of these rows, and of strips of
// rows before them. first is a multiple of 8, and so the vectors' numbers that belong to it begin
// at a multiple of 16. A part's own arrays have a place for each row of its strips, then for its
// rows.
struct LmPart {
    size_t first, last;
    size_t first_strip, last_strip;  // in LmParts::strips
    size_t offset;                   // of its first place in arrays with room for every part's
    size_t first_number() const { return 6 * first; }
    size_t last_number() const { return (6 * last + 15) / 16 * 16; }
    size_t strips() const { return last_strip - first_strip; }
};
constexpr size_t kMinPartRows = 64, kMaxParts = 16;
constexpr size_t kStripRows = 8, kStripNumbers = 6 * kStripRows;

struct LmParts {
    HostVector<LmPart> parts;
    HostVector<uint32_t> strips;  // each one's first row, a multiple of kStripRows; a part's ascend
    HostVector<uint32_t> places;  // of each block's column in its part

    LmParts(const LowerPattern& pattern, const Host& host);
};

// What solving needs besides; made once.
struct LmWorkspace {
    LmParts cut;
    HostVector<double> sums;    // one per part
    HostVector<float> damped;   // diagonal blocks with damping
    HostVector<float> inverse;  // of them
    HostVector<float> direct;   // each row's products, not yet added up; kBlockFloats per row
    HostVector<float> twice;    // each row's direction two times; 16 per row
    HostVector<float> x, residual, conditioned;
    std::array<HostVector<float>, 2> direction;  // the present one, and that before
    // A part's own, in its places: direction, that with each entry six times, sums of the
    // transposed blocks' products, and products.
    HostVector<float> spread, transposed, part_direction, part_product;

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
