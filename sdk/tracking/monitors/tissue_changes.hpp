// What becomes of the tissue itself: it comes apart, slides along itself or leaves its place.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/base/os/services.hpp"
#include "sdk/tracking/monitors/cut_monitor.hpp"
#include "sdk/tracking/monitors/departed_tissue.hpp"
#include "sdk/tracking/monitors/lifted_tissue.hpp"
#include "sdk/tracking/monitors/slip_monitor.hpp"

namespace defrec {

// One thread at a time.
class TissueChanges {
  public:
    // Begins with another template.
    void reset();

    // Where the next frame's left image is to be read to; nullptr: nobody looks at it.
    std::vector<uint8_t>* image() { return slips_.wants_image() ? &image_ : nullptr; }
    bool wants_image() const { return slips_.wants_image(); }
    // Whether they have something to do with the next frame before it is registered.
    bool want_next_frame() const { return found_line() || wants_image(); }

    // Once for each frame in which the surface was found with depth. is_confirmed: per
    // vertex, by checks that are located. helpers: whose threads take part, or nullptr.
    void add_frame(const TemplateData& data, const FrameOutput& output,
                   std::span<const uint8_t> is_confirmed, const Services* helpers) noexcept;

    // A frame that is not added, or before which there was a gap.
    void skip_frame() { lifted_.skip_frame(); }

    // Whether there is a line to release.
    bool found_line() const { return cuts_.found() || slips_.found() || lifted_.found(); }
    // The lines, with the control points that they move.
    Tear found_lines() const;
    // The template was released along them: what is found later is another one.
    void end_release();

    const DepartedTissue& departed() const { return departed_; }
    const LiftedTissue& lifted() const { return lifted_; }
    // SlipMonitor::doubts().
    std::span<const float> slip_doubts() const { return slips_.doubts(); }
    // SlipMonitor::unconfirmed().
    std::span<const uint8_t> unconfirmed() const { return slips_.unconfirmed(); }

  private:
    CutMonitor cuts_;
    SlipMonitor slips_;
    DepartedTissue departed_;
    LiftedTissue lifted_;
    std::vector<uint8_t> image_;  // of a frame, where the slips wanted it
};

}  // namespace defrec
