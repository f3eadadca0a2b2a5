// One track held against the truth and against another track.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "conformance/cases/sequence/tracking.hpp"
#include "conformance/worker/record.hpp"

namespace defrec::conformance {

// The value that this share of all does not exceed; 0 without values, NaN if one is NaN.
double quantile(std::vector<double> values, double share);

struct TruthErrors {
    std::vector<double> errors;    // mm, of visible points that the tracker trusts in
    std::vector<double> observed;  // mm, of all points that it calls observed
    uint64_t visible = 0, lost = 0;

    double lost_share() const {
        return visible > 0 ? static_cast<double>(lost) / static_cast<double>(visible) : 0;
    }
};
TruthErrors errors_to_truth(const Track& track, const RenderedSequence& sequence);

struct StateDifference {
    std::string other_state;  // the first frame that is lost in one and not in the other, or has
                              // another epoch or number of vertices, of a template that has grown
                              // another by more than 2 %
    // Frames that are followed alike for other reasons, of which degraded follows; the first.
    uint32_t other_reasons = 0;
    std::string reasons_message;
    // Frames of which one alone has DEFREC_REASON_CONTRADICTED: many checks, each with a threshold
    // of its own, are counted against a share.
    uint32_t other_contradicted = 0;
};
StateDifference state_difference(const Track& expected, const Track& found);

struct TrackDistance {
    std::vector<double> observed;      // mm, of vertices that both call observed
    std::vector<double> extrapolated;  // of the others that both trust
    uint64_t vertices = 0, other_status = 0;
    size_t worst_frame = 0;  // where the largest distance is

    double other_status_share() const {
        return vertices > 0 ? static_cast<double>(other_status) / static_cast<double>(vertices) : 0;
    }
};
// Distances in frames that both trust, of the vertices that the first frame had: what joins later
// is decided by where the surface was. The tracks must have the same states.
TrackDistance distance_between(const Track& expected, const Track& found);

// A frame's vertices where they are seen: expected depth, found depth, and the distance between the
// two up to full_scale mm.
std::vector<Picture> distance_pictures(const Track& expected, const Track& found,
                                       const RenderedSequence& sequence, size_t frame,
                                       double full_scale);

}  // namespace defrec::conformance
