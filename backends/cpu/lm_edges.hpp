// The ARAP term of stage lm over all edges.
#pragma once
#include "backends/cpu/blend_clusters.hpp"
#include "backends/cpu/lm_system.hpp"
#include "backends/definition/lm_inputs.hpp"

namespace defrec::cpu {

// Edges first .. last - 1, and the control points that they connect, first_node .. last_node - 1.
struct LmEdgePiece {
    size_t first, last;  // first is a multiple of kLanes
    size_t first_node, last_node;
    size_t offset;  // of the first of these control points in an array with room for every piece's
};

// Edges for SIMD, b > a, in the order of b and then a, and so of the lower half's rows. Lanes after
// the last edge repeat it.
struct LmEdges {
    HostVector<int32_t> a, b;
    HostVector<float> direction_x, direction_y, direction_z, length;
    HostVector<float> share;   // of the ARAP term's weight, as the template has it
    HostVector<float> weight;  // with the data's: set at the start of a run; 0 after the last edge
    HostVector<uint32_t> block;  // in the system's lower half
    size_t count = 0;
    HostVector<LmEdgePiece> pieces;  // each is computed by one thread
    size_t piece_nodes = 0;          // of all pieces

    LmEdges(const LmTemplate& surface, const LowerPattern& pattern, const Host& host);

  private:
    void cut();
};

struct EdgeTask {
    const LmEdges* edges;
    const LmEdgePiece* piece;
    const float* poses;  // 8 per control point: rotation wxyz, position xyz, unused
    float length_weight, angle_weight, rotation_weight;  // the latter two with the squared spacing
    bool linearise;
    float* lower;  // the system's; each edge's block is written
    float* nodes;  // kNodeFloats for each of the piece's control points, set by the caller to 0
};
// Per control point: upper triangle of omega-omega, omega-tau row-major, upper triangle of tau-tau,
// gradient, one unused.
constexpr size_t kNodeFloats = 28;
// Returns the cost of a piece.
double sum_edges(const EdgeTask& task);

}  // namespace defrec::cpu
