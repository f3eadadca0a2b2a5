// Where a control point starts, as the first trial. Needs lm.glsl, `motions`, `rest` and `trial`.
void store_trial(uint i, DualQuaternion motion, vec3 position) {
    trial[kNodeVectors * i] = motion.real;
    trial[kNodeVectors * i + 1] = motion.dual;
    trial[kNodeVectors * i + 2] = vec4(position, 0);
}

void start(uint i) {
    const DualQuaternion motion = usable_motion(motions[i]);
    store_trial(i, motion, apply(motion, rest[i].xyz));
}
// Moved rigidly first.
void start(uint i, vec4 turn, vec3 shift) {
    const vec3 at = rest[i].xyz;
    const DualQuaternion motion = usable_motion(motions[i]);
    const vec3 position = rotate(turn, apply(motion, at)) + shift;
    const vec4 rotation = multiply(turn, motion.real);
    store_trial(i, from_rigid(rotation, position - rotate(rotation, at)), position);
}
