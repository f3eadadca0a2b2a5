// What follows from a step for the next one, and for a step that is trusted. Needs lm.glsl.

LmMove farther(LmMove a, LmMove b) { return LmMove(max(a.largest, b.largest), a.bad | b.bad); }

void damp_next(inout LmState state, bool accepted) {
    state.refused = accepted ? 0 : 1;
    state.lambda =
        clamp(state.lambda * (accepted ? kLambdaDown : kLambdaUp), kMinLambda, kMaxLambda);
}

// Whether the last step is made, by the state before it.
bool trusts_step(LmState state) { return !stopped(state) && state.refused == 0; }
LmState after_trusted(LmState state, bool accepted) {
    ++state.iterations;
    if (accepted) state.any_step = 1;
    damp_next(state, accepted);
    return state;
}
