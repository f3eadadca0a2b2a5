// What stereo_search_wide.comp rests on beyond known_answer.comp: signed dot products of four
// bytes, -128 and complements among them. known_answer.cpp computes the same on the host.
#version 450
#extension GL_EXT_spirv_intrinsics : require
layout(local_size_x = 256) in;
layout(std430, set = 0, binding = 0) writeonly buffer Answers { int answers[]; };

spirv_instruction(extensions = ["SPV_KHR_integer_dot_product"], capabilities = [ 6018, 6019 ],
                  id = 4450) int packed_dot(int a, int b, spirv_literal int format);

uint scrambled(uint x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

void main() {
    const uint i = gl_GlobalInvocationID.x;
    // The lowest byte of b is -128; in each fourth pair all bytes of both are.
    const bool lowest = i % 4 == 3;
    const int a = lowest ? int(0x80808080u) : int(scrambled(2 * i)),
              b = lowest ? int(0x80808080u) : int(scrambled(2 * i + 1) & 0xffffff00u | 0x80u);
    answers[3 * i] = packed_dot(a, b, 0);
    answers[3 * i + 1] = packed_dot(a, b ^ int(0xffff0000u), 0);
    answers[3 * i + 2] = packed_dot(a, ~a, 0);
}
