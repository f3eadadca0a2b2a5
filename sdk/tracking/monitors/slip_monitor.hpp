// Notices where two sides of a surface slide along each other in contact, without a gap.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sdk/base/os/services.hpp"
#include "sdk/tracking/frame/frame_output.hpp"
#include "sdk/tracking/monitors/band.hpp"

namespace defrec {

// A band of cells that show nothing of the template, between sides that slide.
struct SlidingPart {
    Band band;
    Cell along;       // how they slide, of length 1
    double slip = 0;  // mm, of one side along the other
};

struct Slip {
    CutLine line;
    // Control points beside it and how the side moved that they are on; indices of the template's.
    std::vector<std::pair<size_t, defrec_motion>> motions;
};

// One thread at a time.
class SlipMonitor {
  public:
    // Begins with another template.
    void reset();
    // Goes on after a line was released: what is found later is another one.
    void end_release();

    // Whether add_frame() is to be given the next frame's image.
    bool wants_image() const { return suspected_.has_value(); }

    // Once for each frame in which the surface was found with depth. is_confirmed: photometric
    // evidence, per vertex. image: the left image, width * height, if it was wanted before the
    // frame; else empty. helpers: whose threads take part, or nullptr. Nothing more is looked for
    // once a line was found.
    void add_frame(const TemplateData& data, const FrameOutput& output,
                   std::span<const uint8_t> is_confirmed, std::span<const uint8_t> image,
                   const Services* helpers);

    // A line along which the first view's surface slides: for some frames a band showed nothing of
    // the template although something lay at its depth or behind, what is seen on both sides of it
    // moved along it by different amounts, and each side's motion explains the image up to the
    // line.
    const std::optional<Slip>& found() const { return found_; }

    // Per vertex: mm by which it may be off where sides slide that are not parted yet; empty where
    // none do.
    std::span<const float> doubts() const { return doubts_; }
    // Per cell of the grid: frames without photometric evidence where there was to be some, less
    // those with it; at most Slips::kFrames. Empty before the first frame.
    std::span<const uint8_t> unconfirmed() const { return unconfirmed_; }

  private:
    void doubt(const TemplateData& data, std::span<const SlidingPart> parts);

    std::optional<Slip> found_;
    std::vector<uint8_t> unconfirmed_;
    std::vector<uint8_t> frames_;          // the same since a line was released
    std::vector<uint8_t> is_unconfirmed_;  // this frame's, per cell
    std::optional<SlidingPart> suspected_;
    std::vector<float> doubts_;
};

}  // namespace defrec
