// Sum over a work group of kResidualGroup invocations. Needs lm.glsl.
shared LmTerm shares[kResidualGroup];

// Gives the sum of every invocation's term to the first.
LmTerm sum_over_group(LmTerm own, uint me) {
    const uint parts = kResidualGroup / kEighths;
    shares[me] = own;
    barrier();
    if (me < parts) {
        for (uint i = parts; i < kResidualGroup; i += parts) own = plus(own, shares[me + i]);
        shares[me] = own;
    }
    barrier();
    if (me == 0)
        for (uint i = 1; i < parts; ++i) own = plus(own, shares[i]);
    return own;
}
