// Which reference sequences the suite tracks, and how long.
#pragma once
#include <span>

#include "conformance/cases/sequence/rendered_sequence.hpp"

namespace defrec::conformance {

struct SequenceEntry {
    SequenceRequest sequence;
    const char* title;
    bool smoke = false;  // in the short list
    // Little texture and a veil: decisions amplify rounding far more than elsewhere, so that such
    // scenes have limits of their own.
    bool hazy = false;
};

std::span<const SequenceEntry> sequence_list();

}  // namespace defrec::conformance
