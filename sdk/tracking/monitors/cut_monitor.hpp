// Notices where a surface has come apart.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

// One thread at a time.
class CutMonitor {
  public:
    // Begins with another template, or with the same one after a cut was released.
    void reset() {
        frames_.clear();
        found_.reset();
    }

    // Once for each frame in which the surface was found with depth. samples and is_confirmed
    // (photometric evidence) per vertex. Nothing more is looked for once a line was found.
    void add_frame(const TemplateData& data, std::span<const defrec_surface_sample> samples,
                   std::span<const uint8_t> is_confirmed);

    // A line along which the first view's surface has come apart: for some frames the live surface
    // lay behind it there, it showed nothing of the template, and what is seen on both sides lies
    // farther apart than at rest.
    const std::optional<CutLine>& found() const { return found_; }

  private:
    std::optional<CutLine> found_;
    std::vector<uint8_t> frames_;  // per cell of the grid: with a gap there, at most Cuts::kFrames
};

}  // namespace defrec
