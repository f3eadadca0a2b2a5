// Contract of stage ransac: constants, buffers and checks, once for all backends.
// docs/stages/ransac.md. Shaders include this file as well, for the part outside __cplusplus.
#ifdef __cplusplus
#pragma once
#endif
#include "backends/shared/ransac_constants.h"
#ifdef __cplusplus
#include "backends/stages/contract.hpp"

namespace defrec {
#endif

struct RansacConstants {
    uint landmarks;  // in the template
    uint references, iterations, min_support;
    float threshold_mm;  // 0: found from the frame
    uint seed_low, seed_high;
};

#ifdef __cplusplus
constexpr RansacConstants constants_of(const defrec_ransac_params& params, uint32_t landmarks) {
    return {
        landmarks,           params.references,     params.iterations,          params.min_support,
        params.threshold_mm, uint32_t(params.seed), uint32_t(params.seed >> 32)};
}

// The parameters with a least support that the arithmetic holds: no larger than one that no
// reference reaches.
constexpr defrec_ransac_params bounded(defrec_ransac_params params) {
    params.min_support = std::min(params.min_support, params.landmarks + 1);
    return params;
}

// The landmarks given to prepare: as many as the buffer holds, at most params.landmarks.
inline std::span<const defrec_landmark> read_template(const defrec_ransac_params& params,
                                                      std::span<const InBuffer> in) {
    return view_records<defrec_landmark>("ransac prepare", params.landmarks, in);
}

struct RansacBuffers {
    static constexpr const char* kName = "ransac";
    const defrec_match* matches;
    defrec_match* weighted;
    defrec_ransac_summary* summary;

    // landmarks: as many as prepare was given; 0 while that is not known.
    template <class List>
    void list(List& list, uint64_t landmarks) {
        list.input("matches", matches, landmarks);
        list.output("weighted matches", weighted, landmarks);
        list.output("summary", summary, 1);
    }
};
inline BufferTable buffer_table(const defrec_ransac_params&) {
    return table_of<RansacBuffers>(uint64_t{0});
}

}  // namespace defrec
#endif
