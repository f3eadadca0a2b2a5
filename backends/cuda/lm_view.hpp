// What the kernels of stage lm are given.
#pragma once
#include "backends/cuda/device/device_code.hpp"
#include "backends/cuda/lm_plan.hpp"
#include "backends/definition/lm_inputs.hpp"
#include "backends/shared/lm_terms.hpp"

namespace defrec::cuda {

struct LmParameters : LmConstants {
    defrec_camera exact_camera;  // in double precision
    DisparityImage image;
    uint32_t iterations,
        steps;  // steps of the conjugate gradients; 0: every control point by itself
    bool trusts_last_step;
};

// The template. Items are points, then landmarks, then patches; from shares on as in LmPlan.
struct LmSurface {
    const float4* rest;  // control points
    const LmShare* shares;
    const uint32_t* known;
    const uint32_t* items;
    const uint4* item_nodes;
    const float4* item_vectors;
    const LmConnection* connections;
    const LmChunk* chunks;
    const LmSum* sums;
    const uint16_t* terms;
    uint32_t blocks, places;  // in all
    uint32_t rows, max_known, max_places, max_items, max_connections, max_terms;
};

// As in LmRowPlan.
struct LmRows {
    const LmRowShare* shares;
    const uint32_t* known;
    const LmPlace* places;
    const uint32_t* row_places;
    uint32_t rows, max_known, max_places;
};

struct LmFrameView {
    const defrec_motion* motions;
    const defrec_match* matches;                   // nullptr: none
    const defrec_patch_observation* observations;  // nullptr: none
    const float4* rigid;  // from presolve: rotation, translation; nullptr: none
};

// What levenberg_marquardt.hpp keeps from step to step.
constexpr uint32_t kSums = 16;  // see LmSumOf
struct LmState {
    double sums[kSums];
    double initial_cost;
    float lambda;
    int32_t iterations;
    uint32_t copy;  // of poses and system, of the two that there are: the present one
    bool any_step, refused, converged, failed;  // refused: the last step
};

// Global memory.
struct LmExchange {
    // Each has two copies, at the present poses and where the step leads.
    float4* poses;     // of each control point rotation and position
    float* diagonals;  // kDiagonal numbers of each control point, one after the other for all
    float* matrix;     // 36 for each place
    // From kernel to kernel.
    float* sums;      // blocks x kSums
    float* scales;    // S of each connection, its own block's only
    float* steps;     // 6 of each control point
    LmState* states;  // 2, used in turn
    // Within a kernel. What the solver's blocks pass to each other in a step has two copies, used
    // in turn: a block that is ahead never writes what another still reads.
    float* data;        // D of each control point
    float2* data_sums;  // of each block's control points: D, and its square
    float* factors;     // kFactorRoom of each control point: see kFactor
    float* starts;      // 6 of each control point: the right side, conditioned
    // For a grid that is no cluster.
    float* products;           // 2 x 6 of each control point: of matrix and direction
    float4* dots;              // 2 x blocks: each one's part
    float *local, *row_local;  // what shared memory does not hold: so many floats for each block
    size_t local_floats, row_local_floats;
    uint32_t *passed, *row_passed;  // GridBarriers'
    uint32_t* finite;  // of each of the solver's blocks: whether its part of a trusted step is
};

struct LmView {
    LmParameters p;
    LmSurface surface;
    LmRows rows;
    LmFrameView frame;
    LmExchange exchange;
    defrec_motion* results;
    defrec_lm_summary* summary;
};

// The inverse of a damped diagonal block's Cholesky factor: a lower triangle, row by row; and the
// room that it has.
constexpr uint32_t kFactor = 21, kFactorRoom = 24;
constexpr uint32_t kDiagonal = 27;  // a diagonal block's lower triangle, and half the gradient
constexpr uint32_t kOwn = 6 * kLmColumns;  // of a control point: its diagonal block, half the
                                           // gradient, and D, in kLmColumns of six
constexpr uint32_t kPose =
    3;  // vectors of a control point in motion: rotation, dual part, position

// A residual as the sums want it, in vectors of four. With S, the weighted sum over its rows of
// gradient gradient^T: for each of its control points where it is from there, times its weight, and
// that weight; S times each axis' motion there by a turn; then S's columns, the weighted sum of
// value gradient, and the residual's weight.
constexpr uint32_t kArms = 0, kTurns = DEFREC_BLEND_NODES,
                   kShifts = kTurns + 3 * DEFREC_BLEND_NODES, kPull = kShifts + 3,
                   kWeight = kPull + 1, kRecord = kWeight + 1;
// A connection as the sums want it, one component after the other for the whole chunk: i's own
// block as turn-turn (upper triangle), turn-shift, shift-shift (upper triangle), half the gradient.
constexpr uint32_t kTurn = 0, kLever = 6, kShift = 15, kGradient = 21, kConnectionRecord = 27;

}  // namespace defrec::cuda
