// The stages in the order of DEFREC_STAGE_*: the one list from which makers, names and tables are
// made; and what holds of all of them.
#pragma once
#include <cstddef>
#include <iterator>

#include "include/defrec_c.h"

// By scripts/contract/generate.py: X(name, NAME) for each stage, with SEPARATOR() between.
#define DEFREC_STAGES(X, SEPARATOR) \
    X(rectify, RECTIFY)             \
    SEPARATOR()                     \
    X(stereo, STEREO)               \
    SEPARATOR()                     \
    X(orb, ORB)                     \
    SEPARATOR()                     \
    X(match, MATCH)                 \
    SEPARATOR()                     \
    X(align, ALIGN)                 \
    SEPARATOR()                     \
    X(ransac, RANSAC)               \
    SEPARATOR()                     \
    X(lm, LM)                       \
    SEPARATOR()                     \
    X(warp, WARP)
// End of what is generated.
#define DEFREC_NOTHING()
#define DEFREC_COMMA() ,
#define DEFREC_STAGE_NAME(name, NAME) #name
#define DEFREC_STAGE_PARAMS(name, NAME) defrec_##name##_params
#define DEFREC_STAGE_MAKER(name, NAME) make_##name  // of the namespace it is used in
namespace defrec {

inline constexpr const char* kStageNames[] = {DEFREC_STAGES(DEFREC_STAGE_NAME, DEFREC_COMMA)};
static_assert(std::size(kStageNames) == DEFREC_STAGE_COUNT_V1);

// "stereo" for DEFREC_STAGE_STEREO; "unknown stage" for others.
constexpr const char* stage_name(uint32_t stage) {
    return stage < std::size(kStageNames) ? kStageNames[stage] : "unknown stage";
}

constexpr size_t kMaxStageBuffers = 24;  // inputs, and outputs, that a stage may have

// From this one on stages have inputs that stay the same from run to run.
constexpr uint32_t kFirstPreparedStage = DEFREC_STAGE_MATCH;

}  // namespace defrec
