// What the shaders of stage lm are given beside the constants, and what they leave to each other,
// for C++ and GLSL.
#ifdef __cplusplus
#pragma once
#include "backends/stages/lm.hpp"
#include "backends/vulkan/shaders/shader_types.hpp"
namespace defrec::vulkan {
#endif

struct LmRun {
    DisparityGrid image;
    uint edges, blocks;
    uint data_groups;  // work groups of lm_data.comp
    uint given;        // kMatchesGiven ...
    uint evaluation;   // see lm.glsl
    uint step;         // of the conjugate gradients; 0: none before
};

const uint kMatchesGiven = 1, kObservationsGiven = 2,
           kTrustsLastStep = 4;  // of the dispatch that ends the run

const uint kResidualGroup = 128;  // invocations of a work group of residuals, and of edges
const uint kNodeGroup = 64;       // likewise of control points: start, move, finish
const uint kItemVectors =
    6;  // of an item of the template, a point, landmark or patch: position, normal, then for each
        // of its control points what leads from it to the item, and the weight
const uint kRecordVectors =
    3;  // of an item's residual: (Gxx, Gxy, Gxz, weight) (Gyy, Gyz, Gzz, 0) (b, 0), with G the
        // weighted sum of g g^T over its rows of gradient g and value r, b that of r g
const uint kEdgeVectors = 4;    // of an edge now: (direction, length) (a's turned, stretch) (b's
                                // turned, share of the data's weight that S is) (rotation a b*)
const uint kNodeVectors = 3;    // of a control point in motion: rotation, dual part, position
const uint kBlockVectors = 12;  // of a 6x6 block: its 3x3 quarters turn-turn, turn-shift,
                                // shift-turn, shift-shift, each by columns
const uint kBlockGroup = 64;    // invocations of a work group of blocks of the system

// The sums over some residuals of a term.
struct LmTerm {
    float cost, weights, squares;
    uint count;
    uint missing;  // points without a live surface
};

// An edge in a block of the system: its number, twice, and whether the block's control point (in a
// block above the diagonal: its row's) is its second; and the other control point.
struct LmEdgeTerm {
    uint edge, other;
};

// What levenberg_marquardt.hpp keeps from step to step.
struct LmState {
    LmTerm icp, match, patch_;
    float arap;
    float initial_cost, lambda;
    int iterations;
    uint any_step, refused, converged, failed;  // refused: the last step
    float usual;                                // lm_weights.glsl
};

// The farthest any control point of a work group moved, and whether a step was not finite.
struct LmMove {
    float largest;  // squared, mm^2
    uint bad;
};

// What each step of the conjugate gradients begins with.
struct LmGradients {
    float rho, alpha, enough;
    uint over;  // no more steps
};

// Block b < nodes is control point b's own; the others are those above the diagonal.
struct LmBlock {
    uint first_item, last_item;  // of item_terms
    uint first_edge, last_edge;  // of edge_terms
    uint row, column;            // control points
    uint place, transposed;      // where the block and its transpose go in the matrix
};

#ifdef __cplusplus
}  // namespace defrec::vulkan
#endif
