// A reference sequence in memory, with its truth.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::conformance {

struct SequenceRequest {
    std::string scene;  // of docs/program/reference_sequences.md
    uint32_t width = 0, height = 0, frames = 0;
    bool grows = false;  // the template that follows it

    auto operator<=>(const SequenceRequest&) const = default;
};

struct TruePoint {
    double position[3];  // left camera as given, mm
    bool visible;
};

struct FilmedFrame {
    std::vector<uint8_t> left, right;  // BGR
    std::vector<TruePoint> truth;      // one for each point
    bool shows_tissue = true;
};

struct RenderedSequence {
    SequenceRequest request;
    defrec_rig_desc rig;
    std::vector<double> points;  // u, v in the first left image as given, px
    std::vector<FilmedFrame> frames;
};

// Rendered once in a process and kept: every repetition and both devices get the same pixels.
const RenderedSequence& rendered_sequence(const SequenceRequest& request);

}  // namespace defrec::conformance
