// The scenes in which tissue slides along other tissue, closes over itself or rolls.
// docs/program/reference_sequences.md describes them.
#pragma once

#include <vector>

#include "sdk/scenes/scene_entry.hpp"

namespace defrec::cli {

std::vector<Entry> sliding_entries();

}  // namespace defrec::cli
