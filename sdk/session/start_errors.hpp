// Whether expected errors are large after the start, while a late right view cannot be excluded.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::cli {

class StartErrors {
  public:
    // The frames in order, each with its result.
    void add(std::int64_t frame, const defrec_result& result);
    // Which frames, and why; empty where none stands out.
    std::string note() const;

  private:
    struct Frame {
        std::int64_t number;
        double expected_mm;  // median of the observed vertices
    };
    std::vector<Frame> frames_;  // the first in which the surface was found
};

}  // namespace defrec::cli
