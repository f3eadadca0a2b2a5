// What pairs say of a registration by a surface.
#pragma once

#include <string>

#include "sdk/registration/program/register_calls.hpp"

namespace defrec::cli {

// How exactly the pairs alone hold each motion that the surface leaves open: "0.35 degrees, 0.2
// mm". by_pairs: an accepted registration by them.
std::string held_by_pairs(const Registered& by_surface, const PairsFile& pairs,
                          const Registered& by_pairs);

}  // namespace defrec::cli
