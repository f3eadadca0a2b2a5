// Contract of stage match: constants, buffers and checks, once for all backends.
// docs/stages/match.md. Shaders include this file as well, for the part outside __cplusplus.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/match_constants.h"
#include "backends/stages/surface.hpp"
#ifdef __cplusplus
#include <algorithm>

namespace defrec {
#endif

struct MatchConstants {
    FloatCamera camera;
    DisparityGrid image;
    uint max_distance, ratio;
};

// What a run compares, and in how many parts side by side.
struct MatchSizes {
    uint landmarks, features;  // features: max number of live ones
    uint feature_splits, landmark_splits;
};

#ifdef __cplusplus
constexpr MatchConstants constants_of(const defrec_match_params& params) {
    return {float_camera(params.camera), disparity_grid(params, true), params.max_distance,
            params.ratio};
}

// The landmarks given to prepare: as many as the buffer holds, at most params.landmarks.
inline std::span<const defrec_landmark> read_template(const defrec_match_params& params,
                                                      std::span<const InBuffer> in) {
    return view_records<defrec_landmark>("match prepare", params.landmarks, in);
}

struct MatchBuffers {
    static constexpr const char* kName = "match";
    const uint32_t* count;  // of live features
    const defrec_feature* features;
    const int16_t* disparity;
    defrec_match* matches;

    // landmarks: as many as prepare was given; 0 while that is not known.
    struct Sizes {
        const defrec_match_params& params;
        uint64_t landmarks = 0;
    };
    template <class List>
    void list(List& list, const Sizes& sizes) {
        list.input("feature count", count, 1);
        list.input("features", features, 0);  // as many as the count says
        list.input("disparity", disparity, disparity_elements(sizes.params));
        list.output("matches", matches, sizes.landmarks);
    }
};
// How many live features there are, at most params.features. The buffers are in host memory.
inline uint32_t live_features(const defrec_match_params& params, const MatchBuffers& given,
                              std::span<const InBuffer> in) {
    const uint32_t count = std::min(*given.count, params.features);
    take<defrec_feature>("match: features", in[1], count);
    return count;
}
// How many live features the buffer has room for, at most params.features: where only the device
// knows the count.
inline uint32_t room_for_features(const defrec_match_params& params, const InBuffer& features) {
    if (features.data == nullptr)
        throw StageError(DEFREC_ERROR_ARGUMENT, "match: features is not given");
    return uint32_t(std::min<uint64_t>(params.features, features.size / sizeof(defrec_feature)));
}
inline BufferTable buffer_table(const defrec_match_params& params) {
    return table_of<MatchBuffers>(MatchBuffers::Sizes{params});
}

}  // namespace defrec
#endif
