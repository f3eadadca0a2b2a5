// The vectors of the conjugate gradients. A control point has two halves of each, rotation and
// shift. What neighbours read is passed from step to step in two copies in turn; step k reads copy
// (k + 1) & 1 and writes copy k & 1. Needs `vectors`, and lm.glsl.
const uint kConditioned = 0, kConditionedProduct = 1, kConditionedDirection = 2,
           kPassed = 3;  // M^-1 r, M^-1 A M^-1 r, M^-1 A p
const uint kDirection = 0, kDirectionProduct = 1, kSolution = 2, kResidual = 3, kProduct = 4,
           kOwn = 5;  // p, A p, x, r, A M^-1 r

uint passed_vector(uint copy, uint node, uint which, uint h) {
    return ((copy * push.nodes + node) * kPassed + which) * 2 + h;
}
uint own_vector(uint node, uint which, uint h) {
    return 2 * push.nodes * kPassed * 2 + (node * kOwn + which) * 2 + h;
}
