// Judgement of an evaluation: levenberg_marquardt.hpp after a step was tried. Every work group
// comes to it by itself, from the sums that the evaluation left. Needs lm.glsl and kClassifies, the
// invocations of a work group, which are 64.
layout(std430, set = 0, binding = 0) buffer States { LmState states[2]; };
layout(std430, set = 0, binding = 1) readonly buffer Terms { LmTerm terms[]; };
layout(std430, set = 0, binding = 2) readonly buffer Moves { LmMove moves[]; };

#include "lm_decide.glsl"

shared LmTerm term_shares[kTerms][kClassifies];
shared LmMove move_shares[kClassifies];
shared LmState now;
shared bool accepted;  // the trial is the present state

void share_moves(uint me) {
    LmMove move = LmMove(0, 0);
    if (run.evaluation > 0)
        for (uint i = me; i < node_groups(); i += kClassifies) move = farther(move, moves[i]);
    move_shares[me] = move;
}

void share_sums(uint me) {
    for (uint kind = 0; kind < kTerms; ++kind) {
        const bool left = kind != kEdges || run.evaluation > 0;
        const uint first = groups_before(kind), groups = left ? groups_of(kind) : 0;
        LmTerm sum = kNoTerm;
        for (uint i = me; i < groups; i += kClassifies) sum = plus(sum, terms[first + i]);
        term_shares[kind][me] = sum;
    }
    share_moves(me);
}

// Adds the shares from `first` on in steps of `step` to the first; one invocation each for the
// terms and the moves.
void add_shares(uint sum_of, uint first, uint step) {
    if (sum_of < kTerms) {
        LmTerm sum = term_shares[sum_of][first];
        for (uint i = 1; i < kEighths; ++i) sum = plus(sum, term_shares[sum_of][first + i * step]);
        term_shares[sum_of][first] = sum;
    } else if (sum_of == kTerms) {
        LmMove move = move_shares[first];
        for (uint i = 1; i < kEighths; ++i) move = farther(move, move_shares[first + i * step]);
        move_shares[first] = move;
    }
}

LmState first_state(LmState there, float missing_cost) {
    LmState state = there;
    state.initial_cost = there.icp.cost + there.match.cost + there.patch_.cost + there.arap +
                         float(there.icp.missing) * missing_cost;
    state.lambda = push.damping;
    state.iterations = 0;
    state.any_step = 0;
    state.refused = 0;
    state.converged = there.icp.count + there.match.count + there.patch_.count > 0 ? 0 : 1;
    state.failed = finite(state.initial_cost) ? 0 : 1;
    return state;
}

// The state after a step to `there`.
LmState next_state(LmState state, LmState there, LmMove move, float missing_cost) {
    ++state.iterations;
    accepted = false;
    if (move.bad == 0) {
        state.any_step = 1;
        state.converged = move.largest < kMinStepMm * kMinStepMm ? 1 : 0;
        const float present = there.icp.cost + there.match.cost + there.patch_.cost + there.arap;
        // Term by term, so that what is common to both costs, the points without a live surface
        // above all, does not drown the difference.
        const float decrease =
            (state.icp.cost - there.icp.cost) + (state.match.cost - there.match.cost) +
            (state.patch_.cost - there.patch_.cost) + (state.arap - there.arap) +
            float(int(state.icp.missing) - int(there.icp.missing)) * missing_cost;
        accepted = finite(present) && decrease > 0.0;
        if (accepted) {
            if (decrease < kMinDecrease * present) state.converged = 1;
            state.icp = there.icp;
            state.match = there.match;
            state.patch_ = there.patch_;
            state.arap = there.arap;
        }
    }
    damp_next(state, accepted);
    return state;
}

// Sets now and accepted. To be called by the whole work group, after share_sums, and not once it
// has stopped. first_arap: of evaluation 0, whose edges leave no sums.
void classify(uint me, float first_arap) {
    LmState before;
    if (me == 0 && run.evaluation > 0) before = states[(run.evaluation - 1) & 1];
    barrier();
    add_shares(me / kEighths, me % kEighths, kEighths);
    barrier();
    if (me % kEighths == 0) add_shares(me / kEighths, 0, 1);
    barrier();
    if (me == 0) {
        LmState there;
        there.icp = term_shares[kPoints][0];
        there.match = term_shares[kLandmarks][0];
        there.patch_ = term_shares[kPatches][0];
        there.arap = run.evaluation == 0 ? first_arap : term_shares[kEdges][0].cost;
        const float missing_cost = push.icp_weight * push.icp_tukey * push.icp_tukey / 3.0;
        if (run.evaluation == 0) {
            now = first_state(there, missing_cost);
            accepted = true;
        } else {
            now = next_state(before, there, move_shares[0], missing_cost);
        }
    }
    barrier();
}

// Likewise for a trusted step.
void trust(uint me) {
    share_moves(me);
    barrier();
    if (me < kEighths) add_shares(kTerms, me, kEighths);
    barrier();
    if (me == 0) {
        add_shares(kTerms, 0, 1);
        now = states[(run.evaluation - 1) & 1];
        accepted = trusts_step(now) && move_shares[0].bad == 0;
        if (trusts_step(now)) now = after_trusted(now, accepted);
    }
    barrier();
}

bool stopped_before() { return run.evaluation > 0 && stopped(states[(run.evaluation - 1) & 1]); }
