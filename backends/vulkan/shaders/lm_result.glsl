// What a run ends with. Needs lm.glsl.
bool has_failed(LmState state) {
    return state.failed != 0 || (state.iterations > 0 && state.any_step == 0);
}

float rms(LmTerm term) { return term.weights > 0.0 ? sqrt(term.squares / term.weights) : 0.0; }

LmSummary summary_of(LmState state) {
    const float missing =
        float(state.icp.missing) * (push.icp_weight * push.icp_tukey * push.icp_tukey / 3.0);
    const float cost = state.icp.cost + state.match.cost + state.patch_.cost + state.arap + missing;
    return LmSummary(state.initial_cost, cost, state.icp.cost, state.match.cost, state.patch_.cost,
                     state.arap, state.iterations, int(state.icp.count), int(state.match.count),
                     int(state.patch_.count), rms(state.icp), rms(state.match), rms(state.patch_),
                     state.lambda, has_failed(state) ? 1 : 0, 0);
}
