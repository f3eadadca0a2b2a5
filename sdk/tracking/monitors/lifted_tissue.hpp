// Follows tissue that is lifted off its place and hangs on the rest, as a flap on its hinge: it is
// parted from what it came off, and looked for where its motion goes on.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sdk/tracking/frame/frame_output.hpp"
#include "sdk/tracking/map/local_fit.hpp"

namespace defrec {

// What a template is released along, and how control points start from there.
struct Tear {
    std::vector<CutLine> lines;
    std::vector<std::pair<size_t, defrec_motion>> motions;
};

// One thread at a time.
class LiftedTissue {
  public:
    // Begins with another template. One that grows or is cut stays the same.
    void reset();

    // Once for each frame in which the surface was found with depth. is_confirmed: photometric
    // evidence, per vertex.
    void add_frame(const TemplateData& data, const FrameOutput& output,
                   std::span<const uint8_t> is_confirmed);

    // A frame that is not added: how tissue moves on is not told across it.
    void skip_frame() { seen_.clear(); }

    // Tissue that was lifted, to be parted from the rest; nothing more is looked for until it was.
    const std::optional<Tear>& found() const { return found_; }
    // The template was released along what was found.
    void end_release();

    // Per control point, 1: it was parted. Those beyond the end were not; empty: none was.
    std::span<const uint8_t> nodes() const { return is_lifted_; }
    bool any() const { return !is_lifted_.empty(); }
    // Whether any of them moves the point.
    bool moves(const defrec_surface_point& point) const;
    // Whether enough of what they move is seen where the surface has it. is_confirmed: per vertex.
    bool is_seen(const TemplateData& data, std::span<const defrec_surface_sample> samples,
                 std::span<const uint8_t> is_confirmed) const;
    // The same in the last frame that was added.
    bool was_seen() const { return was_seen_; }
    // Sets the motions from which the next frame starts to look for it.
    void place(std::span<defrec_motion> motions) const;

  private:
    void look(const TemplateData& data, const FrameOutput& output,
              std::span<const uint8_t> is_confirmed);
    void follow(const TemplateData& data, const FrameOutput& output,
                std::span<const uint8_t> is_confirmed);
    void hold(const TemplateData& data, const FrameOutput& output);

    void remember(const TemplateData& data, const FrameOutput& output,
                  std::span<const uint8_t> is_confirmed);
    std::vector<PointPair> steps_of(const TemplateData& data, const FrameOutput& output,
                                    std::span<const uint8_t> is_confirmed,
                                    std::span<const uint8_t> moves) const;

    std::optional<Tear> found_;
    std::vector<uint8_t> is_lifted_;
    // The motions of all control points in the frame before, of lifted ones where they were last
    // seen.
    std::vector<defrec_motion> last_;
    std::vector<defrec_motion> next_;  // where the next frame starts; of those that are lifted
    // A vertex as it was seen in the frame before; its z is 0 where it was not.
    struct Seen {
        float position[3], residual;
    };
    std::vector<Seen> seen_;
    std::vector<Vec3<double>> positions_;  // working memory, of control points
    uint32_t frames_ = 0;                  // since the first was parted
    bool was_seen_ = false;
};

}  // namespace defrec
