// Gray values of colours, docs/stages/rectify.md, section 1.
#pragma once

namespace defrec {

// Weights of ITU-R BT.601 in 1/256.
constexpr int kRedWeight = 77, kGreenWeight = 150, kBlueWeight = 29;
constexpr int gray_of(int red, int green, int blue) {
    return (kRedWeight * red + kGreenWeight * green + kBlueWeight * blue + 128) >> 8;
}

}  // namespace defrec
