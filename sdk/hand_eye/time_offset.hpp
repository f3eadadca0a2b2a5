// The offset between the clocks of a camera and of a tracking system, from how fast both turn: the
// angle of a relative motion is the same for everything that is fixed to the camera (M. Ackerman,
// A. Cheng, B. Shiffman, E. Boctor, G. Chirikjian, "Sensor calibration with unknown
// correspondence: solving AX=XB using Euclidean-group invariants", IROS 2013).
#pragma once
#include <string>

#include "sdk/hand_eye/pose_stream.hpp"

namespace defrec {

struct OffsetSearch {
    bool is_found = false;
    std::string reason;      // one sentence, where it is not
    double offset_s = 0;     // tracking system's time = camera's time + offset
    double correlation = 0;  // of rotation speeds at that offset
};

// Looks at offsets up to max_offset_s, all at once: an hour of both streams and offsets of up to an
// hour take seconds.
OffsetSearch find_offset(const PoseStream& camera, const PoseStream& tracker, double max_offset_s);

}  // namespace defrec
