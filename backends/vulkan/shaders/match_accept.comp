// Stage match: what the splits found, put together, then sections 2 and 3. One invocation per
// landmark.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
layout(local_size_x = 64) in;

layout(std430, set = 0, binding = 0) readonly buffer FeatureKeys {
    uint feature_keys[];
};  // three for each landmark and split
layout(std430, set = 0, binding = 1) readonly buffer LandmarkKeys {
    uint landmark_keys[];
};  // for each feature and split
layout(std430, set = 0, binding = 2) readonly buffer Features { Feature features[]; };
layout(std430, set = 0, binding = 3) readonly buffer Disparity { int16_t disparity[]; };
layout(std430, set = 0, binding = 4) writeonly buffer Matches { Match matches[]; };

#define LIVE_DISPARITY(i) int(disparity[i])
#include "live_depth.glsl"
#include "match.glsl"

layout(push_constant) uniform Push {
    MatchSizes sizes;
    MatchConstants push;
};

const uint kAhead =
    16;  // keys that are loaded at a time: on a GPU their latency is what takes time

uvec3 three_nearest(uint landmark) {
    const uint count = 3 * sizes.feature_splits;
    uvec3 best = uvec3(kNoKey);
    for (uint first = 0; first < count; first += kAhead) {
        uint keys[kAhead];
        [[unroll]] for (uint k = 0; k < kAhead; ++k) keys[k] =
            first + k < count ? feature_keys[(first + k) * sizes.landmarks + landmark] : kNoKey;
        [[unroll]] for (uint k = 0; k < kAhead; ++k) {
            const uint behind_first = max(best.x, keys[k]),
                       behind_second = max(best.y, behind_first);
            best = min(best, uvec3(keys[k], behind_first, behind_second));
        }
    }
    return best;
}
uint nearest_landmark(uint feature) {
    uint best = kNoKey;
    for (uint first = 0; first < sizes.landmark_splits; first += kAhead) {
        uint keys[kAhead];
        [[unroll]] for (uint k = 0; k < kAhead; ++k) keys[k] =
            first + k < sizes.landmark_splits
                ? landmark_keys[(first + k) * sizes.features + feature]
                : kNoKey;
        [[unroll]] for (uint k = 0; k < kAhead; ++k) best = min(best, keys[k]);
    }
    return best & 0xffffu;
}
int distance_of(uint key) { return key == kNoKey ? kNoDistance : int(key >> 16); }

// Places are whatever the caller gave.
bool near(int p, int q) { return (p > q ? uint(p) - uint(q) : uint(q) - uint(p)) <= kSamePlace; }

bool at_one_place(uint a, uint b) {
    return near(features[a].x, features[b].x) && near(features[a].y, features[b].y);
}

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= sizes.landmarks) return;
    const uvec3 best = three_nearest(i);
    const uint a = best.x & 0xffffu;
    const int distance = distance_of(best.x);
    const bool same = best.y != kNoKey && at_one_place(a, best.y & 0xffffu);
    const int second = distance_of(same ? best.z : best.y);
    const bool accepted = best.x != kNoKey && distance <= int(push.max_distance) &&
                          kRatioOne * distance <= int(push.ratio) * second &&
                          nearest_landmark(a) == i;
    Match match = Match(accepted ? int(a) : -1, min(distance, kMaxDistance),
                        min(second, kMaxDistance), 0.0, 0.0, float[](0.0, 0.0, 0.0), 0.0, 0);
    if (accepted) {
        const vec2 place = vec2(features[a].x, features[a].y) * (1.0 / float(kFeatureOne));
        const vec2 pixel = clamp(place, vec2(0), vec2(push.image.width - 1, push.image.height - 1));
        match.u = pixel.x;
        match.v = pixel.y;
        const float z = live_depth(push.camera, push.image, pixel);
        if (z > 0.0) {
            match.position = float[]((pixel.x - push.camera.cx) * z / push.camera.fx,
                                     (pixel.y - push.camera.cy) * z / push.camera.fy, z);
            match.weight = 1.0;
        }
    }
    matches[i] = match;
}
