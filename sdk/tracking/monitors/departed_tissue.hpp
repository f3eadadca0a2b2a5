// Notices where tissue left the place at which the surface has it: a flap that is lifted, a piece
// that is carried away.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/tracking/frame/frame_output.hpp"

namespace defrec {

// Control points of tissue that was lifted, and is gone whenever it is not seen.
struct LiftedNodes {
    std::span<const uint8_t> is_lifted;  // per control point; those beyond its end are not
    bool are_seen = false;               // in this frame
};

// One thread at a time.
class DepartedTissue {
  public:
    // Begins with another template. One that grows or is cut stays the same.
    void reset();

    // Once for each frame in which the surface was found with depth. is_confirmed: photometric
    // evidence, per vertex.
    void add_frame(const TemplateData& data, const FrameOutput& output,
                   std::span<const uint8_t> is_confirmed, const LiftedNodes& lifted = {});

    // Whether any tissue is gone: it was seen, and its image is then seen at another depth, in some
    // frames; what is not seen beside it went with it. It is back once it is seen again.
    bool any() const { return any_; }
    // The same at a point: at the control point that moves it most. 0 where that joined since the
    // last frame that was added.
    uint32_t age_of(const defrec_surface_point& point) const;
    // Share of the vertices inside the image at which it is.
    double share() const { return share_; }

  private:
    struct Node {
        float weight = 0, seen = 0, elsewhere = 0;  // of vertices, as it moves them
        bool shows(float part) const;
    };
    void weigh(const TemplateData& data, const FrameOutput& output,
               std::span<const uint8_t> is_confirmed);
    void find_leaving(const TemplateData& data);
    void spread(const TemplateData& data);
    void set_lifted(const LiftedNodes& lifted);
    void count_vertices(const TemplateData& data, const FrameOutput& output);

    std::vector<Node> nodes_;
    std::vector<uint8_t> is_leaving_;  // per control point, in this frame
    std::vector<uint8_t> was_seen_;    // per control point
    std::vector<uint8_t> elsewhere_;   // frames in a row, per control point
    std::vector<uint8_t> seen_again_;  // likewise
    std::vector<uint32_t> ages_;  // frames that it has been gone, per control point; 0: it is not
    uint32_t frames_ = 0;
    bool any_ = false;
    double share_ = 0;
};

}  // namespace defrec
