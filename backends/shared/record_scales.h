// What the fixed-point numbers of the records of defrec_c.h take for 1, for C++ and GLSL.
#ifndef DEFREC_SHARED_RECORD_SCALES
#define DEFREC_SHARED_RECORD_SCALES
#include "backends/shared/glsl.h"
#ifdef __cplusplus
#include "include/defrec_c.h"
namespace defrec {
#endif

constexpr int kDisparityOne = 16;       // px of a disparity
constexpr int kFeatureOne = 16;         // px of a feature's position
constexpr int kPatchOne = 256;          // px of a patch's position, predicted or observed
constexpr int kPatchMatrixOne = 65536;  // of view_from_live
constexpr int kScoreOne = 4096;         // ZNCC 1

#ifdef __cplusplus
static_assert(kDisparityOne == DEFREC_DISPARITY_ONE);
}  // namespace defrec
#endif
#endif
