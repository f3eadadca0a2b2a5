// What the shaders of stage lm share. docs/stages/lm.md. They run in this order, all recorded before:
//   [presolve] start, residuals, data, edges, then for each iteration: system, step ..., move, residuals beside edges; at the end finish.
// Evaluation e (0: of the start, then one for each iteration's trial) is classified by what comes after it: by system, or by finish.
// Judgement e is written to states[e & 1]; what follows in the iteration looks there whether anything is left to do.
#include "records.glsl"
#include "motion.glsl"
#ifndef LIVE_DISPARITY
#define LIVE_DISPARITY(i) 0  // only the residuals of points look at the image
#endif
#include "live_depth.glsl"

layout(push_constant) uniform Push {
    Camera camera;
    DisparityImage image;
    uint nodes, points, landmarks, patches, edges, blocks;
    float icp_weight, match_weight, patch_weight;
    float icp_tukey, match_tukey, patch_tukey;  // mm, mm, px
    float association, match_slope;             // mm; 1 / (5 H)
    float length_weight, angle_weight, rotation_weight;  // the last two times the squared node spacing
    float spacing2, damping;
    uint given;       // kMatchesGiven ...
    uint evaluation;  // see above
    uint step;        // of the conjugate gradients; 0: none before
} push;

const uint kMatchesGiven = 1, kObservationsGiven = 2, kPresolve = 4;

const uint kResidualGroup = 64;  // invocations of a work group of residuals, edges, and move
const uint kItemVectors = 6;    // of an item of the template, a point, landmark or patch: position, normal, then for each of its control
                                // points what leads from it to the item, and the weight
const uint kRecordVectors = 3;  // of an item's residual: (Gxx, Gxy, Gxz, weight) (Gyy, Gyz, Gzz, 0) (b, 0), with G the weighted sum of
                                // g g^T over its rows of gradient g and value r, b that of r g
const uint kEdgeVectors = 4;    // of an edge now: (direction, length) (a's turned, stretch) (b's turned, scale) (rotation a b*)
const uint kNodeVectors = 3;    // of a control point in motion: rotation, dual part, position
const uint kBlockVectors = 12;  // of a 6x6 block: its 3x3 quarters turn-turn, turn-shift, shift-turn, shift-shift, each by columns

uint groups_of(uint count) { return (count + kResidualGroup - 1) / kResidualGroup; }

// The sums over some residuals of a term.
struct Term {
    float cost, weights, squares;
    uint count;
    uint missing;  // points without a live surface
};
const Term kNoTerm = Term(0, 0, 0, 0, 0);
Term plus(Term a, Term b) {
    return Term(a.cost + b.cost, a.weights + b.weights, a.squares + b.squares, a.count + b.count, a.missing + b.missing);
}

// What levenberg_marquardt.hpp keeps from step to step.
struct State {
    Term icp, match, patch_;
    float arap;
    float initial_cost, lambda;
    int iterations;
    uint any_step, converged, failed;
};
bool stopped(State state) { return state.converged != 0 || state.failed != 0; }

// The farthest any control point of a work group moved, and whether a step was not finite.
struct Move {
    float largest;  // squared, mm^2
    uint bad;
};

bool finite(float v) { return (floatBitsToUint(v) & 0x7f800000u) != 0x7f800000u; }
bool finite(vec3 v) { return finite(vec4(v, 0)); }

// A match that says where its landmark is now.
bool has_depth(Match match) {
    return match.position[2] > 0.0 && finite(vec4(load3(match.position), match.weight));
}
bool preselected(Match match) { return has_depth(match) && match.weight > 0.0; }

struct Robust {  // a residual's share of the cost, and the weight of its square in the linearised system
    float cost, weight;
};
Robust tukey(float squared, float inverse_c2) {
    const float rest = squared * inverse_c2 < 1.0 ? 1.0 - squared * inverse_c2 : 0.0;
    return Robust((1.0 - rest * rest * rest) / (3.0 * inverse_c2), rest * rest);
}
