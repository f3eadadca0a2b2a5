// Which reference sequences the suite tracks, and how long.
#pragma once
#include <span>
#include <string>

#include "conformance/cases/sequence/rendered_sequence.hpp"

namespace defrec::conformance {

struct SequenceEntry {
    SequenceRequest sequence;
    const char* title;
    bool smoke = false;  // in the short list
    // Little texture and a veil: decisions amplify rounding far more than elsewhere, so that such
    // scenes have limits of their own.
    bool hazy = false;
    // Frames without depth: errors, which are reported, have limits of their own.
    bool late = false;
    uint32_t since = 1;   // the suite version that brought it
    uint32_t reason = 0;  // that some of its frames must have, DEFREC_REASON_*

    // The last part of the names of the tolerances that hold: of errors, and of the distance from
    // the reference.
    std::string error_limits() const;
    std::string spread_limits() const { return hazy ? "_hazy" : ""; }
};

std::span<const SequenceEntry> sequence_list();

}  // namespace defrec::conformance
