// FAST's score (docs/stages/orb.md, section 3). Needs orb.glsl. Who includes it defines PIXELS:
// int, or ivec4 for four pixels at once.

// Without threshold. The runs of 9 that start at 2k and at 2k + 1 share 8.
PIXELS corner_score(PIXELS centre, PIXELS circle[16]) {
    PIXELS least2[8], most2[8];
    [[unroll]] for (int k = 0; k < 8; ++k) {
        least2[k] = min(circle[2 * k + 1], circle[(2 * k + 2) & 15]);
        most2[k] = max(circle[2 * k + 1], circle[(2 * k + 2) & 15]);
    }
    PIXELS least4[8], most4[8];
    [[unroll]] for (int k = 0; k < 8; ++k) {
        least4[k] = min(least2[k], least2[(k + 1) & 7]);
        most4[k] = max(most2[k], most2[(k + 1) & 7]);
    }
    PIXELS brightest = PIXELS(0), darkest = PIXELS(255);  // of all runs
    [[unroll]] for (int k = 0; k < 8; ++k) {
        const PIXELS one = circle[2 * k], other = circle[(2 * k + 9) & 15];
        brightest = max(brightest, min(min(least4[k], least4[(k + 2) & 7]), max(one, other)));
        darkest = min(darkest, max(max(most4[k], most4[(k + 2) & 7]), min(one, other)));
    }
    return max(max(brightest - centre, centre - darkest), PIXELS(0));
}
