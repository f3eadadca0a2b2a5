// What the kernels of stage lm are given.
#pragma once
#include "backends/cuda/device_code.hpp"
#include "backends/cuda/lm_plan.hpp"
#include "backends/shared/lm_inputs.hpp"
#include "backends/shared/lm_terms.hpp"

namespace defrec::cuda {

struct LmParameters : LmConstants {
    defrec_camera exact_camera;  // in double precision
    DisparityImage image;
    uint32_t iterations,
        steps;  // steps of the conjugate gradients; 0: every control point by itself
};

// The template. Items are points, then landmarks, then patches; from shares on as in LmPlan.
struct LmSurface {
    const float4* rest;  // control points
    const LmShare* shares;
    const uint32_t* known;
    const LmPlace* places;
    const uint32_t* row_places;
    const uint32_t* items;
    const uint4* item_nodes;
    const float4* item_vectors;
    const LmConnection* connections;
    const LmChunk* chunks;
    const LmSum* sums;
    const uint16_t* terms;
    uint32_t rows, max_known, max_places, max_sums;
};

struct LmFrameView {
    const defrec_motion* motions;
    const defrec_match* matches;                   // nullptr: none
    const defrec_patch_observation* observations;  // nullptr: none
    const float4* rigid;  // from presolve: rotation, translation; nullptr: none
};

// Global memory. Of what blocks pass to each other there are two copies, used in turn: a block that
// is ahead never writes what another still reads.
struct LmExchange {
    float* data;        // D of each control point
    float2* data_sums;  // of each block's control points: D, and its square
    float* scales;      // S of each connection, its own block's only
    float* factors;   // 2 x kFactor x nodes: inverse Cholesky factors of the damped diagonal blocks
    float* starts;    // 2 x 6 nodes: the right side, conditioned
    float* products;  // 2 x 6 nodes: of matrix and direction
    float4* dots;     // 2 x blocks: each one's part
    float* sums;      // 2 x blocks x kSums, likewise
    float* local;     // what shared memory does not hold: local_floats for each block
    uint32_t* passed;  // GridBarrier's
    size_t local_floats;
};

struct LmView {
    LmParameters p;
    LmSurface surface;
    LmFrameView frame;
    LmExchange exchange;
    defrec_motion* results;
    defrec_lm_summary* summary;
};

constexpr uint32_t kFactor = 21;     // a lower triangle, row by row
constexpr uint32_t kOwnFactor = 24;  // the same with room between
constexpr uint32_t kOwn = 48;  // of a control point: its diagonal block, half the gradient, and D,
                               // in eight columns of six
constexpr uint32_t kPose =
    3;  // vectors of a control point in motion: rotation, dual part, position
constexpr uint32_t kPresent = 2;  // rotation, position

// A residual as the sums want it, one component after the other for the whole chunk: weighted sums
// over its rows of gradient gradient^T (upper triangle) and value gradient; weight; where it is
// from each of its control points, and their weights.
constexpr uint32_t kSquares = 0, kPull = 6, kWeight = 9, kArms = 10, kSkin = 22, kRecord = 26;
// A connection as the sums want it: i's own block as turn-turn (upper triangle), turn-shift,
// shift-shift (upper triangle), half the gradient.
constexpr uint32_t kTurn = 0, kLever = 6, kShift = 15, kGradient = 21, kConnectionRecord = 27;

}  // namespace defrec::cuda
