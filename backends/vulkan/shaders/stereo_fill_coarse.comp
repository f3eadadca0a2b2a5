// Stage stereo, section 6: makes all fields that are coarser than push.level, and fills them. One
// work group.
#version 450
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "stereo_pyramid.glsl"
layout(local_size_x = 1024) in;

void main() {
    const int me = int(gl_LocalInvocationIndex);
    int last = push.level;
    for (Level fine = level_at(last); fine.width > 1 || fine.height > 1; fine = level_at(last)) {
        const Level coarse = level_at(++last);
        for (int i = me; i < coarse.width * coarse.height; i += 1024)
            make_coarser(fine, coarse, i % coarse.width, i / coarse.width);
        memoryBarrierBuffer();
        barrier();
    }
    for (int level = last - 1; level > push.level; --level) {
        const Level fine = level_at(level), coarse = level_at(level + 1);
        for (int i = me; i < fine.width * fine.height; i += 1024)
            fill_hole(fine, coarse, i % fine.width, i / fine.width);
        memoryBarrierBuffer();
        barrier();
    }
}
