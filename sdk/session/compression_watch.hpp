// Whether the codec of a recording left too little of its first frames, said while they are
// tracked: a user need not wait for the end to record anew.
#pragma once

#include <string>

#include "include/defrec_c.h"
#include "sdk/input/compression/compression_signs.hpp"
#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

class CompressionWatch {
  public:
    // The frames in order, each with its result. Returns the sentence for the user, once, with the
    // last frame that is looked at; else it is empty.
    std::string add(const StereoFrame& frame, const defrec_result& result);
    // The same at the end of a recording that has fewer frames.
    std::string conclude();
    // Signs in what was looked at.
    CompressionSigns signs() const { return meter_.signs(); }

  private:
    std::string sentence() const;

    CompressionMeter meter_;
    int frames_ = 0;
    double without_depth_ = 0;   // share of the surface, the sum over the frames
    std::uint32_t reasons_ = 0;  // of all of them
};

}  // namespace defrec::cli
