// Gray values of colours, docs/stages/rectify.md, section 1.
#pragma once
#include "backends/shared/rectify_constants.h"

namespace defrec {

constexpr int gray_of(int red, int green, int blue) {
    return (kRedWeight * red + kGreenWeight * green + kBlueWeight * blue + 128) >> 8;
}

}  // namespace defrec
