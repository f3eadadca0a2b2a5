// Stage stereo, section 6: makes all fields that are coarser than push.level, and fills them; the
// finest of these is all that others read. One work group.
#version 450
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "stereo_pyramid.glsl"
const int kInvocations = 1024;
layout(local_size_x = kInvocations) in;

// 2,048 pixels (kOneGroupPixels of stereo.cpp) and half as many again and again, a row of them
// rounded up.
const int kCells = 4112;
shared int cells[kCells];  // the fields, one after the other

int cell(Level level, int x, int y) {
    return cells[level.offset + clamp(y, 0, level.height - 1) * level.width +
                 clamp(x, 0, level.width - 1)];
}

// A level as it stands in cells.
Level level_in_cells(int index, int before) {
    Level level = level_at(index);
    level.offset -= before;
    return level;
}

void main() {
    const int me = int(gl_LocalInvocationIndex);
    const Level finest = level_at(push.level + 1);
    const int before = finest.offset;
    {
        const Level fine = level_at(push.level);
        for (int i = me; i < finest.width * finest.height; i += kInvocations)
            cells[i] = coarser_value(fine, i % finest.width, i / finest.width);
    }
    barrier();
    int last = push.level + 1;
    for (Level fine = level_in_cells(last, before); fine.width > 1 || fine.height > 1;) {
        const Level coarse = level_in_cells(++last, before);
        for (int i = me; i < coarse.width * coarse.height; i += kInvocations) {
            const int x = 2 * (i % coarse.width), y = 2 * (i / coarse.width);
            const bool right = x + 1 < fine.width, below = y + 1 < fine.height;
            cells[coarse.offset + i] =
                mean_of(cell(fine, x, y), right ? cell(fine, x + 1, y) : kNoDisparity,
                        below ? cell(fine, x, y + 1) : kNoDisparity,
                        right && below ? cell(fine, x + 1, y + 1) : kNoDisparity);
        }
        fine = coarse;
        barrier();
    }
    for (int level = last - 1; level > push.level; --level) {
        const Level fine = level_in_cells(level, before),
                    coarse = level_in_cells(level + 1, before);
        for (int i = me; i < fine.width * fine.height; i += kInvocations) {
            if (cells[fine.offset + i] != kNoDisparity) continue;
            const int x = i % fine.width, y = i / fine.width;
            const ivec2 near = ivec2(x >> 1, y >> 1),
                        far = near + ivec2((x & 1) == 0 ? -1 : 1, (y & 1) == 0 ? -1 : 1);
            cells[fine.offset + i] =
                filled(cell(coarse, near.x, near.y), cell(coarse, far.x, near.y),
                       cell(coarse, near.x, far.y), cell(coarse, far.x, far.y));
        }
        barrier();
    }
    for (int i = me; i < finest.width * finest.height; i += kInvocations)
        pyramid[finest.offset + i] = int16_t(cells[i]);
}
