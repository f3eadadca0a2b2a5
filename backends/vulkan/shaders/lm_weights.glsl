// S of the edges, from what lm_data.comp leaves of the weight of the data: D_i of each control
// point, then four sums of each of its work groups. Needs lm.glsl and a buffer `data`.

uint data_sums_at(uint group) { return push.nodes + 4 * group; }
// x: of D_i; y: of its square; z: of D_i E_i / 4; w: of E_i / 4, with E_i the cost that the edges
// of control point i have at the start with their share for S. With U, the usual weight, all edges
// cost z + U w.
vec4 data_sums(uint group) {
    const uint at = data_sums_at(group);
    return vec4(data[at], data[at + 1], data[at + 2], data[at + 3]);
}
float usual_weight(vec2 sums) { return sums.x > 0.0 ? sums.y / sums.x : 0.0; }
float edge_scale(float share, float data_a, float data_b, float usual) {
    return share * (0.5 * (data_a + data_b) + usual) * 0.5;
}
