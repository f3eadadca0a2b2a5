// What the tracker decides about each frame: whether its images are of use, whether a template is
// captured, whether the surface was found, and what its results are.
#pragma once
#include <array>
#include <chrono>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "sdk/tracking/frame_queue.hpp"
#include "sdk/tracking/map/map_growth.hpp"
#include "sdk/tracking/monitors/backoff.hpp"
#include "sdk/tracking/monitors/camera_anchor.hpp"
#include "sdk/tracking/monitors/cut_watch.hpp"
#include "sdk/tracking/monitors/disparity_watch.hpp"
#include "sdk/tracking/monitors/piece_states.hpp"
#include "sdk/tracking/monitors/rig_monitor.hpp"
#include "sdk/tracking/monitors/stale_vertices.hpp"
#include "sdk/tracking/monitors/standing_blocks.hpp"
#include "sdk/tracking/monitors/stream_check.hpp"
#include "sdk/tracking/points/outside_motion.hpp"
#include "sdk/tracking/stages/pipeline.hpp"

namespace defrec {

// One thread, the one that takes the frames from the queue.
class SurfaceFollower {
  public:
    // frames: where the frame after the one that is followed is looked for, and which is told when
    // a template that was set is followed or replaced; outlives the follower.
    SurfaceFollower(std::shared_ptr<const Rig> rig, const std::shared_ptr<Device>& device,
                    const TrackerSettings& settings, FrameQueue& frames);

    // Computes the frame and ends its job. In the order of the frames.
    void compute(TrackerJob& job) noexcept;
    // Ends its job without computing the frame.
    void cancel(TrackerJob& job) noexcept;

    // The template that is followed, null before there is one. Any thread.
    std::shared_ptr<const Template> current_template() const;

  private:
    // A frame that was observed while the one before it was followed, or why it could not be.
    struct Ahead {
        const TrackerJob* job;
        std::variant<ObservedFrame, std::exception_ptr> result;
    };
    // A frame that is followed before its images were looked at, or why it could not be.
    struct Unseen {
        Following following;
        std::variant<FollowedFrame, std::exception_ptr> result;
    };
    // Of the template, and where its surface was last found.
    struct Surface {
        SurfaceModel model;
        std::vector<defrec_motion> motions;
        std::vector<defrec_surface_sample> samples;
    };

    // What is computed of a frame, and from when on.
    struct Chosen {
        Effort effort;
        FrameInput::Clock::time_point time;
    };

    void process(TrackerJob& job);
    std::optional<Unseen> begin(TrackerJob& job, std::optional<ObservedFrame>& frame);
    void adopt_set_template(const TrackerJob& job);
    bool observe_ahead(const FollowedFrame& followed);
    bool can_follow_unseen(const TrackerJob& job) const;
    Unseen follow_unseen(TrackerJob& job, std::optional<ObservedFrame>& frame);
    static FollowedFrame followed_of(Unseen unseen);
    void take_back(std::optional<Unseen>& unseen, std::optional<ObservedFrame>& frame);
    void check_images(TrackerJob& job);
    GraySums look_at(const TrackerJob& job, size_t view, size_t part);
    void capture(TrackerJob& job, ObservedFrame& frame);
    void adopt(std::shared_ptr<const Template> surface, bool is_observed);
    void keep(std::shared_ptr<const Template> surface);
    bool release_cut();
    bool grow();
    void change_template(TemplateData data, std::vector<defrec_motion> motions);
    bool prepare_results(TrackerJob& job);
    Chosen choose_effort(const TrackerJob& job) const;
    Effort begin_effort(const TrackerJob& job);
    Verdict follow(TrackerJob& job, std::optional<ObservedFrame>& frame,
                   std::span<const defrec_motion> start, const Following& following);
    Verdict judge(TrackerJob& job, std::optional<ObservedFrame>& frame, FollowedFrame followed,
                  const Following& following);
    void begin_measuring(TrackerJob& job);
    ObservedFrame finish(TrackerJob& job, FollowedFrame followed);
    void measure(TrackerJob& job);
    void measure_run(TrackerJob& job, size_t run);
    void search_widely(TrackerJob& job, std::optional<ObservedFrame>& frame, Following following,
                       Verdict& verdict);
    void look_for_swapped_views(TrackerJob& job, ObservedFrame& frame);
    void watch_rig(TrackerJob& job, Verdict& verdict, bool uses_depth);
    void find_stale_parts(const TrackerJob& job, Verdict& verdict);
    bool lag_spoils_depth(const TrackerJob& job) const;
    bool correct_rig();
    void conclude(TrackerJob& job, const Verdict& verdict, bool uses_depth);
    void place_outside(TrackerJob& job);
    void search_lost_pieces(const TrackerJob& job);
    void describe_surface(TrackerJob& job, bool uses_depth);
    void watch_for_cuts(const TrackerJob& job) noexcept;
    void plan_growth(const TrackerJob& job) noexcept;

    std::shared_ptr<const Rig> rig_;
    FrameQueue& frames_;
    MapGrowth growth_;
    Pipeline pipeline_;

    mutable std::mutex template_mutex_;
    std::shared_ptr<const Template> template_;  // written under the mutex, by this thread

    std::shared_ptr<const Template> to_adopt_;  // one that was set, until that succeeds
    std::optional<Ahead> ahead_;
    bool is_depth_spoilt_ = false;  // in the last frame, by the right view's lag
    std::optional<Surface> last_;   // with the template
    PieceStates pieces_;
    CameraAnchor camera_;
    OutsideMotion outside_;
    CutWatch cut_watch_;
    std::optional<CutLine> cut_;  // that is released with the next frame
    StreamCheck stream_;
    std::array<StandingBlocks, 2> blocks_;  // of the views
    StaleVertices stale_;                   // of this frame
    uint32_t frozen_frames_ = 0;            // up to this one
    RigMonitor rig_monitor_;                // of what is left after the shift
    RigEstimate rig_left_;                  // its last estimate
    DisparityWatch disparities_;
    // The same if this frame is found.
    RigMonitor rig_after_;
    RigEstimate rig_left_after_;
    DisparityWatch disparities_after_;
    Rig::ViewShift shift_;  // that the right view is corrected by
    const bool has_body_, watches_rig_, corrects_rig_;
    // Of this frame: of measure_patches, and per run of vertices.
    std::vector<double> patch_px2_;
    std::vector<VertexEvidence> vertex_evidence_;
    std::vector<RigidSums> rigid_sums_;
    std::vector<defrec_surface_sample> placed_;  // with what is not in the image
    std::vector<size_t> fast_vertices_;          // since the frame before, in which it was found
    Backoff wide_search_{8}, swapped_search_{32};
    std::vector<std::byte> before_;  // a wide search: what following the template gave
    std::vector<RowMatch> row_matches_;
    // Of the patches of the rig in the left view, in the frame before and in this one; NaN: not
    // found.
    std::vector<float> last_rows_, rows_;
    std::optional<Chosen> chosen_;  // for this frame; none: it is not followed
    EffortTimes effort_times_;
    std::chrono::nanoseconds usual_wait_{0};  // for the device, from when the host is ready
    bool is_tracking_ = false;                // the surface was found in the frame before
    bool shows_cuts_ = false;                 // this frame, in which it was found with depth
    bool may_grow_ = false;                   // likewise, with all its pieces
    uint32_t epoch_ = 0, template_epoch_ = 0, age_ = 0;
};

}  // namespace defrec
