// When a template grows: which frames are keyframes, in which new tissue is looked for, and from
// which frame on it has joined. The work is done on a thread of its own, beside the frames; which
// frames it is taken from and when it is there does not depend on how long it takes.
#pragma once
#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "sdk/template/growth.hpp"
#include "sdk/tracking/stages/pipeline.hpp"

namespace defrec {

// One thread, the tracker's. Outlives the pipeline, whose queue may be reading into its images.
class MapGrowth {
  public:
    explicit MapGrowth(const TrackerSettings& settings);
    ~MapGrowth() { reset(); }

    // Begins with another template.
    void reset();
    // The template has changed otherwise than by growth: what is under way is waited for and
    // forgotten. One that is full stays so.
    void begin_anew();

    // Once for each frame with a template, before it is followed. What joins the template with this
    // frame, or nothing. Throws what the work threw.
    std::optional<Growth> begin_frame();
    // Whether begin_frame() will find nothing to do for the next frame, neither now nor as it is
    // followed.
    bool rests() const;
    // The images of this frame are to be read to there; nullptr: it is no keyframe.
    FrontImages* images() { return is_keyframe_ ? &present_.images : nullptr; }
    // The template has grown by what begin_frame() gave: data.
    void joined(const TemplateData& data, std::span<const NearestNodes> anchors);

    // Once for each such frame, after it. The surface was found: template, its motions and its
    // vertices in the frame. Before the next frame, plan() follows.
    void end_found_frame(const Pipeline& pipeline, const std::shared_ptr<const Template>& surface,
                         const FrameOutput& output);
    // Which frame is the next keyframe, by what the surface leaves uncovered in this one.
    void plan(const TemplateData& data, const FrameOutput& output);
    void end_lost_frame();

    bool is_full() const { return is_full_; }

  private:
    struct Keyframe {
        FrontImages images;
        std::vector<defrec_motion> motions;
    };

    double uncovered_share(const TemplateData& data, const FrameOutput& output);
    void start(const Pipeline& pipeline, std::shared_ptr<const Template> surface);

    const bool is_on_;
    const size_t max_vertices_;
    uint64_t frame_ = 0;        // that is followed, counted from 1
    uint64_t keyframe_at_ = 0;  // the next keyframe; 0: none is planned
    uint64_t due_at_ = 0;       // the frame before which the work is to be there; 0: none
    uint64_t not_before_ = 0;   // no keyframe before this frame
    uint64_t pause_ = 0;        // frames after a keyframe that showed nothing new
    bool is_keyframe_ = false;  // the present frame
    bool has_earlier_ = false;  // earlier_ is the keyframe before this one
    bool is_full_ = false;
    Keyframe earlier_, present_;
    std::vector<uint8_t> covered_;  // cells of the image
    std::future<Growth> work_;
    std::thread worker_;
};

}  // namespace defrec
