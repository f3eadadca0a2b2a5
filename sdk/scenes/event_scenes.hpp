// The scenes in which something of an operation happens to the tissue or lies on it.
// docs/program/reference_sequences.md describes them.
#pragma once

#include <vector>

#include "sdk/scenes/scene_entry.hpp"

namespace defrec::cli {

std::vector<Entry> event_entries();

}  // namespace defrec::cli
