// Whether left and right are the same images.
#pragma once

#include "sdk/doctor/evidence.hpp"

namespace defrec::cli {

// How far the views of a pair differ on average, gray levels.
double difference_of_views(const GrayPair& pair);

// As is found, and what to do.
inline constexpr char kOneViewTwice[] = "left and right are the same images.";
inline constexpr char kOneViewRemedy[] =
    "Give the other view's recording as --right, or check that both video inputs are not fed by "
    "one camera.";

}  // namespace defrec::cli
