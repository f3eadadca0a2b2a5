// What the shaders of stage lm share. docs/stages/lm.md. They run in this order, all recorded
// before:
//   presolve or start, residuals beside edges, data, then for each iteration: system, step ...,
//   move, residuals beside edges; at the end finish. The move of a trusted last step ends the run.
// Evaluation e (0: of the start, then one for each iteration's trial) is classified by what comes
// after it: by system, or by finish. Judgement e is written to states[e & 1]; what follows in the
// iteration looks there whether anything is left to do.
#include "records.glsl"
#include "motion.glsl"
#ifndef LIVE_DISPARITY
#define LIVE_DISPARITY(i) 0  // only the residuals of points look at the image
#endif
#include "live_depth.glsl"
#include "backends/stages/lm.hpp"

#include "lm_structs.h"
layout(push_constant) uniform Push {
    LmConstants push;
    LmRun run;
};

// What terms of the cost are sums of, in the order of what work groups leave of them.
const uint kPoints = 0, kLandmarks = 1, kPatches = 2, kEdges = 3, kTerms = 4;
uint count_of(uint kind) {
    return uint[kTerms](push.points, push.landmarks, push.patches, run.edges)[kind];
}
uint groups_of(uint kind) { return (count_of(kind) + kResidualGroup - 1) / kResidualGroup; }
uint groups_before(uint kind) {
    uint before = 0;
    for (uint k = 0; k < kind; ++k) before += groups_of(k);
    return before;
}
uint node_groups() { return (push.nodes + kNodeGroup - 1) / kNodeGroup; }

// Sums over a work group go by eighths: partial sums of every eighth (or sixteenth) invocation's,
// then of these. Loops of constant length, whose loads a GPU has under way at the same time.
const uint kEighths = 8;

const LmTerm kNoTerm = LmTerm(0, 0, 0, 0, 0);
LmTerm plus(LmTerm a, LmTerm b) {
    return LmTerm(a.cost + b.cost, a.weights + b.weights, a.squares + b.squares, a.count + b.count,
                  a.missing + b.missing);
}

bool stopped(LmState state) { return state.converged != 0 || state.failed != 0; }

bool finite(float v) { return (floatBitsToUint(v) & 0x7f800000u) != 0x7f800000u; }
bool finite(vec3 v) { return finite(vec4(v, 0)); }

// A match that says where its landmark is now.
bool has_depth(Match match) {
    const vec3 p = load3(match.position);
    return p.z > 0.0 && finite(vec4(p, match.weight)) && finite(vec4(p.xy / p.z, 0, 0));
}
bool preselected(Match match) { return has_depth(match) && match.weight > 0.0; }

struct Robust {  // a residual's share of the cost, and the weight of its square in the linearised
                 // system
    float cost, weight;
};
Robust tukey(float squared, float inverse_c2) {
    const float rest = squared * inverse_c2 < 1.0 ? 1.0 - squared * inverse_c2 : 0.0;
    return Robust((1.0 - rest * rest * rest) / (3.0 * inverse_c2), rest * rest);
}
