// Stage orb: its images as the optional outputs want them, without gaps. One invocation per pixel,
// of all levels.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, set = 0, binding = 1) readonly buffer Pyramid { uint8_t pyramid[]; };
layout(std430, set = 0, binding = 2) readonly buffer Smoothed { uint16_t smoothed[]; };
layout(std430, set = 0, binding = 3) readonly buffer Scores { uint8_t scores[]; };
layout(std430, set = 0, binding = 4) writeonly buffer PyramidOut { uint8_t pyramid_out[]; };
layout(std430, set = 0, binding = 5) writeonly buffer SmoothedOut { uint16_t smoothed_out[]; };
layout(std430, set = 0, binding = 6) writeonly buffer ScoresOut { uint8_t scores_out[]; };

void main() {
    const OrbLevel level = levels[gl_GlobalInvocationID.z];
    const int x = int(gl_GlobalInvocationID.x), y = int(gl_GlobalInvocationID.y);
    if (x >= level.width || y >= level.height) return;
    const int from = 4 * word_at(level, 0, y) + x,
              to = int(level.first_pixel) + y * level.width + x;
    if ((given.exported & 1) != 0) pyramid_out[to] = uint8_t(int(pyramid[from]));
    if ((given.exported & 2) != 0) smoothed_out[to] = uint16_t(int(smoothed[from]));
    if ((given.exported & 4) != 0) scores_out[to] = uint8_t(int(scores[from]));
}
