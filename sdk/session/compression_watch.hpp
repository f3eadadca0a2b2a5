// Whether the codec of a recording left too little of its first frames, said while they are
// tracked: a user need not wait for the end to record anew.
#pragma once

#include <algorithm>
#include <optional>
#include <string>

#include "include/defrec_c.h"
#include "sdk/input/compression/copied_blocks.hpp"
#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

class CompressionWatch {
  public:
    // The frames in order, each with its result. Returns the sentence for the user, once, with the
    // last frame that is looked at; else it is empty.
    std::string add(const StereoFrame& frame, const defrec_result& result);
    // The same at the end of a recording that has fewer frames.
    std::string conclude();
    // The share of blocks that are copies in what was looked at, of the view that has more of them;
    // empty where too little tells.
    std::optional<double> copied() const { return std::max(left_.share(), right_.share()); }

  private:
    std::string sentence() const;

    CopiedBlocks left_, right_;
    int frames_ = 0;
    double without_depth_ = 0;  // share of the surface, the sum over the frames
};

}  // namespace defrec::cli
