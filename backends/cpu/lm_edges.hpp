// The ARAP term of stage lm over all edges.
#pragma once
#include "backends/cpu/lm_system.hpp"
#include "backends/cpu/skin_clusters.hpp"
#include "backends/shared/lm_inputs.hpp"

namespace defrec::cpu {

// Edges for SIMD, as the template has them. Lanes after the last edge repeat it.
struct LmEdges {
    HostVector<int32_t> a, b;
    HostVector<float> direction_x, direction_y, direction_z, length;
    HostVector<float> weight;  // with the data's: set at the start of a run; 0 after the last edge
    HostVector<uint32_t> block;  // in the system's lower half
    size_t count = 0;

    LmEdges(const LmTemplate& surface, const LowerPattern& pattern, const Host& host);
};

struct EdgeTask {
    const LmEdges* edges;
    const float* poses;  // 8 per control point: rotation wxyz, position xyz, unused
    float length_weight, angle_weight, rotation_weight;  // the latter two with the squared spacing
    bool linearise;
    float* lower;  // the system's; each edge's block is written
    float* nodes;  // kNodeFloats per control point, set by the caller to 0
};
// Per control point: upper triangle of omega-omega, omega-tau row-major, upper triangle of tau-tau,
// gradient, one unused.
constexpr size_t kNodeFloats = 28;
// Returns the cost.
double sum_edges(const EdgeTask& task);

}  // namespace defrec::cpu
