// What the exact stages rest on, computed from numbered inputs: known_answer.cpp computes the same
// on the host.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
layout(local_size_x = 256) in;

const uint kAnswers = 8;
layout(std430, set = 0, binding = 0) writeonly buffer Answers { uint answers[]; };
layout(std430, set = 0, binding = 1) buffer Bytes { uint8_t bytes[]; };
layout(std430, set = 0, binding = 2) buffer Shorts { int16_t shorts[]; };

shared uint tree[256];

uint scrambled(uint x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

// Inverse square root by a bit trick and Newton's method, as in docs/stages/stereo.md.
float inverse_root(float x) {
    precise float y = uintBitsToFloat(0x5f375a86u - (floatBitsToUint(x) >> 1));
    for (int i = 0; i < 2; ++i) {
        precise const float half_x = 0.5 * x;
        precise const float a = half_x * y;
        precise const float b = a * y;
        precise const float c = 1.5 - b;
        y = y * c;
    }
    return y;
}

void main() {
    const uint i = gl_GlobalInvocationID.x, me = gl_LocalInvocationIndex, first = i * kAnswers;
    const uint r0 = scrambled(2 * i), r1 = scrambled(2 * i + 1);
    const int s0 = int(r0), s1 = int(r1);
    const float x = float(s0 >> 8), y = float(s1 >> 10) * 0.00048828125,
                z = float(int(r0 ^ r1) >> 12);

    precise const float product = x * y;
    precise const float sum = product + z;
    precise const float difference = z - product;
    answers[first + 0] = floatBitsToUint(sum) ^ (floatBitsToUint(difference) << 1);

    answers[first + 1] = floatBitsToUint(inverse_root(float((r0 >> 4) | 1)));

    precise const float scaled = sum * 0.0009765625;
    answers[first + 2] = uint(int(floor(scaled)) * 3 + int(scaled));

    const int quotient = s0 / int((r1 & 0xffff) | 1), shifted = s0 >> (r1 & 15);
    answers[first + 3] =
        uint(quotient * 31 + shifted) + uint(bitCount(r0)) * 7 + uint(findLSB(r1 | 0x80000000u));

    uint64_t wide = uint64_t(r0) * uint64_t(r1) + 0x9e3779b97f4a7c15ul;
    wide = (wide ^ (wide >> 30)) * 0xbf58476d1ce4e5b9ul;
    const int64_t narrow = int64_t(s0) * int64_t(s1) >> 7;
    answers[first + 4] = uint(wide >> 32) ^ uint(narrow & 0xffffffffl);

    tree[me] = r0;
    barrier();
    for (uint size = 128; size > 0; size >>= 1) {
        if (me < size) tree[me] = tree[me] * 5 + tree[me + size];
        barrier();
    }
    answers[first + 5] = tree[0] + me;

    // Neighbours write neighbouring bytes of one word.
    bytes[i] = uint8_t(r0 & 0xff);
    shorts[i] = int16_t(s1 >> 16);
    answers[first + 6] = 0;

    uint walk = r0;
    for (uint step = 0; step < 100 + (r1 & 127); ++step)
        walk = walk * 1664525u + ((walk & 0x10000u) != 0 ? 1013904223u : r1);
    answers[first + 7] = walk;
}
