// Judgement of an evaluation: levenberg_marquardt.hpp after a step was tried. Every work group
// comes to it by itself, from the sums that the evaluation left. Needs lm.glsl, kJudges, the
// invocations of a work group, and kJudgeKeeps: whether this shader is the one that writes the
// state.
layout(std430, set = 0, binding = 0) buffer States { LmState states[2]; };
layout(std430, set = 0, binding = 1) readonly buffer Terms { LmTerm terms[]; };
layout(std430, set = 0, binding = 2) readonly buffer ArapCosts { float arap_costs[]; };
layout(std430, set = 0, binding = 3) readonly buffer Moves { LmMove moves[]; };

const float kMinLambda = 1e-7, kMaxLambda = 1e7;
const float kLambdaDown = 1.0 / 7.5, kLambdaUp = 10.0;
const float kMinStepMm = 0.01;
const float kMinDecrease = 1e-4;

shared LmTerm term_shares[3][kClassifies];
shared float arap_shares[kClassifies];
shared LmMove move_shares[kClassifies];
shared LmState now;
shared bool accepted;  // the trial is the present state

LmTerm share_of_terms(uint me, uint first, uint count) {
    LmTerm sum = kNoTerm;
    for (uint i = me; i < count; i += kClassifies) sum = plus(sum, terms[first + i]);
    return sum;
}

void share_sums(uint me) {
    const uint points = groups_of(push.points), landmarks = groups_of(push.landmarks),
               patches = groups_of(push.patches);
    term_shares[0][me] = share_of_terms(me, 0, points);
    term_shares[1][me] = share_of_terms(me, points, landmarks);
    term_shares[2][me] = share_of_terms(me, points + landmarks, patches);
    float arap = 0.0;
    for (uint i = me; i < groups_of(run.edges); i += kClassifies) arap += arap_costs[i];
    arap_shares[me] = arap;
    LmMove move = LmMove(0, 0);
    if (run.evaluation > 0)
        for (uint i = me; i < groups_of(push.nodes); i += kClassifies)
            move = LmMove(max(move.largest, moves[i].largest), move.bad | moves[i].bad);
    move_shares[me] = move;
}

LmTerm sum_of_shares(uint kind) {
    const uint count = kind == 0 ? push.points : kind == 1 ? push.landmarks : push.patches;
    LmTerm sum = kNoTerm;
    for (uint i = 0; i < min(groups_of(count), kClassifies); ++i)
        sum = plus(sum, term_shares[kind][i]);
    return sum;
}

LmState first_state(LmState there, float missing_cost) {
    LmState state = there;
    state.initial_cost = there.icp.cost + there.match.cost + there.patch_.cost + there.arap +
                         float(there.icp.missing) * missing_cost;
    state.lambda = push.damping;
    state.iterations = 0;
    state.any_step = 0;
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
    state.lambda =
        clamp(state.lambda * (accepted ? kLambdaDown : kLambdaUp), kMinLambda, kMaxLambda);
    return state;
}

// Sets now and accepted. To be called by the whole work group.
void classify(uint me) {
    const bool over = run.evaluation > 0 && stopped(states[(run.evaluation - 1) & 1]);
    if (!over) share_sums(me);
    barrier();
    LmTerm sum = kNoTerm;
    if (!over && me < 3) sum = sum_of_shares(me);
    float arap = 0.0;
    LmMove move = LmMove(0, 0);
    if (!over && me == 3) {
        for (uint i = 0; i < min(groups_of(run.edges), kClassifies); ++i) arap += arap_shares[i];
        for (uint i = 0; i < min(groups_of(push.nodes), kClassifies); ++i)
            move = LmMove(max(move.largest, move_shares[i].largest), move.bad | move_shares[i].bad);
    }
    barrier();
    if (me < 3) term_shares[me][0] = sum;
    if (me == 3) {
        arap_shares[0] = arap;
        move_shares[0] = move;
    }
    barrier();
    if (me == 0) {
        accepted = false;
        if (over) {
            now = states[(run.evaluation - 1) & 1];
        } else {
            LmState there;
            there.icp = term_shares[0][0];
            there.match = term_shares[1][0];
            there.patch_ = term_shares[2][0];
            there.arap = arap_shares[0];
            const float missing_cost = push.icp_weight * push.icp_tukey * push.icp_tukey / 3.0;
            if (run.evaluation == 0) {
                now = first_state(there, missing_cost);
                accepted = true;
            } else {
                now = next_state(states[(run.evaluation - 1) & 1], there, move_shares[0],
                                 missing_cost);
            }
        }
        if (kClassifyKeeps && gl_WorkGroupID.x == 0) states[run.evaluation & 1] = now;
    }
    barrier();
}
