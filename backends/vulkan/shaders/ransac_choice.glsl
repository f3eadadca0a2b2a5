// Which references are accepted; for the shaders that come after all have been followed.
layout(std430, set = 0, binding = 0) readonly buffer FrameBuffer { RansacFrame frame; };
layout(std430, set = 0, binding = 1) readonly buffer Hypotheses { RansacHypothesis hypotheses[]; };
layout(std430, set = 0, binding = 2) readonly buffer From { vec4 from[]; };
layout(std430, set = 0, binding = 3) readonly buffer To { vec4 to[]; };

shared uint largest_support, first_of_largest;

// The reference with the largest support, of equals the first; 0 without any. To be called by the
// whole work group of `size`.
uint best_reference(uint me, uint size) {
    if (me == 0) largest_support = first_of_largest = 0;
    barrier();
    uint own = 0;
    for (uint k = me; k < frame.references; k += size) own = max(own, hypotheses[k].support);
    atomicMax(largest_support, own);
    if (me == 0) first_of_largest = frame.references;
    barrier();
    for (uint k = me; k < frame.references; k += size)
        if (hypotheses[k].support == largest_support) atomicMin(first_of_largest, k);
    barrier();
    return frame.references > 0 ? first_of_largest : 0;
}

// The support that a reference needs to be accepted.
uint needed_support(uint best) {
    return max(push.min_support + frame.pairs / kChanceDivisor,
               hypotheses[best].support / kBestDivisor);
}

mat3 rotation_of(uint k) {
    return mat3(hypotheses[k].rotation[0].xyz, hypotheses[k].rotation[1].xyz,
                hypotheses[k].rotation[2].xyz);
}
float length_of(vec3 d) { return sqrt(d.x * d.x + d.y * d.y + d.z * d.z); }
