// The scenes in which a piece of the tissue comes off what lies beneath it.
// docs/program/reference_sequences.md describes them.
#pragma once

#include <vector>

#include "sdk/scenes/scene_entry.hpp"

namespace defrec::cli {

std::vector<Entry> piece_entries();

}  // namespace defrec::cli
