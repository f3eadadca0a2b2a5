// Whether the views are of one time once they are paired otherwise.
#pragma once

#include <vector>

#include "sdk/doctor/evidence.hpp"
#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

// Where rows or the tracker may show a lag, matches left views with right ones of earlier and later
// frames. The evidence has its probe; frames: all that it is of.
void try_pairings(const std::vector<StereoFrame>& frames, Evidence& evidence);

// The pairing of another number of frames in which the views are of one time; nullptr: none shows.
const Pairing* better_pairing(const std::vector<Pairing>& pairings);

// Where motion is steady, all frames have in common what a lag does to rows, and it passes for an
// error of the calibration. The pairing near a lag, frames, that the tracker measured, in which the
// rows themselves agree clearly best; nullptr: none does.
const Pairing* likely_pairing(double lag, const std::vector<Pairing>& pairings);

// Rows move against each other in the pairs as they are, and no pairing mends that.
bool is_of_no_pairing(const std::vector<Pairing>& pairings);

}  // namespace defrec::cli
