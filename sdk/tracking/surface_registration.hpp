// Registers the surface to each frame: whether its images are of use, whether a template is
// captured, whether the surface was found, and what its results are.
#pragma once
#include <array>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "sdk/base/os/beside_thread.hpp"
#include "sdk/tracking/decisions/rig.hpp"
#include "sdk/tracking/decisions/states.hpp"
#include "sdk/tracking/device_wait.hpp"
#include "sdk/tracking/evidence/tissue_colours.hpp"
#include "sdk/tracking/frame_attempt.hpp"
#include "sdk/tracking/frame_queue.hpp"
#include "sdk/tracking/map/map_growth.hpp"
#include "sdk/tracking/monitors/backoff.hpp"
#include "sdk/tracking/monitors/disparity_check.hpp"
#include "sdk/tracking/monitors/image_check.hpp"
#include "sdk/tracking/monitors/stale_vertices.hpp"
#include "sdk/tracking/monitors/template_trial.hpp"
#include "sdk/tracking/monitors/tissue_changes.hpp"
#include "sdk/tracking/tracked_surface.hpp"

namespace defrec {

// One thread, the one that takes the frames from the queue.
class SurfaceRegistration {
  public:
    // frames: where the frame after the one that is registered is looked for, and which is told
    // when a template that was set is tracked or replaced; outlives the registration.
    SurfaceRegistration(const std::shared_ptr<const Rig>& rig,
                        const std::shared_ptr<Device>& device, const TrackerSettings& settings,
                        FrameQueue& frames);

    // Computes the frame and ends its job. In the order of the frames.
    void compute(TrackerJob& job) noexcept;
    // Ends its job without computing the frame.
    void cancel(TrackerJob& job) noexcept;

    // The template that is tracked, null before there is one. Any thread.
    std::shared_ptr<const Template> current_template() const { return surface_.current(); }

  private:
    // A frame while it is computed.
    struct Frame {
        TrackerJob& job;
        uint32_t reasons = 0;       // DEFREC_REASON_*, so far
        uint32_t faulty_views = 0;  // DEFREC_VIEW_*: of which they speak
        // On the device, unless an attempt has them.
        std::optional<ObservedFrame> images{};
        // What the device is at, or why it is not: an attempt that began before the images were
        // looked at.
        std::optional<std::variant<RegisteredFrame, std::exception_ptr>> begun{};
        const FrameAttempt* last_attempt = nullptr;  // by which its quality level counts
        const FrameAttempt* committed = nullptr;
        RigEstimate rig_estimate{};
        bool captures = false;  // a template
        bool is_first = false;  // there was no template before it
        // One view shows nothing of now, so that nothing is known that takes both.
        bool has_one_view = false;
        bool left_is_frozen = false;  // while the right view is not
        // The views, or the rows of each, are of two times, or one of them shows nothing.
        bool spoils_rows = false;
        // For what follows the end of the job.
        bool shows_cuts = false, may_grow = false;
    };
    // A frame whose job has ended, until what its tissue did is looked at.
    struct Ended {
        FrameOutput output;
        const PhotometricEvidence* photometric;  // nullptr: it shows no cuts
        const Services* helpers;
        bool changes_wanted;   // TissueChanges::want_next_frame(), at its end
        bool is_kept = false;  // by keep_ended()
        bool looking_has_it = false;
    };
    // A frame that was observed while the one before it was computed, or why it could not be.
    struct Prefetched {
        const TrackerJob* job;
        std::variant<ObservedFrame, std::exception_ptr> result;
    };

    void process(Frame& frame);
    void begin(Frame& frame);
    void adopt_set_template(const TrackerJob& job);
    bool prefetch(const RegisteredFrame& registered);
    bool can_begin_speculatively(const TrackerJob& job) const;
    void begin_speculatively(Frame& frame);
    void take_back(Frame& frame);
    void begin_beside_ended(Frame& frame);
    bool look_at_images(Frame& frame);
    void conclude_unusable(Frame& frame);
    static void conclude_without_template(Frame& frame);

    void capture_and_register(Frame& frame);
    bool capture(Frame& frame, TrackedSurface::Source source);
    void refuse_hiding_mask(Frame& frame);
    bool shows_template(const Frame& frame, const FrameAttempt& attempt) const;
    void judge_template(Frame& frame);
    void give_up_template(Frame& frame);
    void forget_template(Frame& frame);
    void forget_course();
    void adopt(std::shared_ptr<const Template> surface, TrackedSurface::Source source);
    void change_template(TemplateData data, std::vector<defrec_motion> motions);
    bool release_cut();
    bool grow();

    FrameAttempt& register_surface(Frame& frame);
    FrameAttempt& begin_attempt(Frame& frame, FrameAttempt& attempt, RegistrationPlan plan);
    FrameAttempt& attempt_first(Frame& frame);
    FrameAttempt& attempt_whole_map(Frame& frame, RegistrationPlan plan);
    FrameAttempt& attempt_without_depth(Frame& frame, const FrameAttempt& before);
    FrameAttempt& attempt_widely(Frame& frame, FrameAttempt& before);
    FrameAttempt& follow(Frame& frame, std::span<const defrec_motion> start, FrameAttempt& attempt);
    FrameAttempt& finish(Frame& frame, RegisteredFrame registered, FrameAttempt& attempt);
    void commit_rig(Frame& frame, FrameAttempt& attempt);
    bool lag_spoils_depth(const TrackerJob& job) const;
    // Disparity of the application against both images.
    void check_given_disparity(Frame& frame, FrameAttempt& attempt);
    bool contradicts_given_disparity(Frame& frame);
    void find_stale_parts(Frame& frame, FrameAttempt& attempt);
    void look_for_swapped_views(Frame& frame);
    bool correct_rig();

    void conclude(Frame& frame, FrameAttempt& attempt);
    void conclude_found(Frame& frame, FrameAttempt& attempt, const PieceEvidences& pieces);
    void conclude_lost(Frame& frame, FrameAttempt& attempt, const PieceEvidences& pieces);
    void place_changed();
    void place_unseen(TrackerJob& job, FrameAttempt& attempt);
    void move_to_placed(std::span<defrec_surface_sample> samples) const;
    void keep_placed(const FrameResult& result);
    void describe_surface(TrackerJob& job, FrameAttempt& attempt);
    // Nothing is known of tissue that left, nor of tissue that was lifted where it is not seen.
    void forget_departed(SurfaceSamples samples, const PhotometricEvidence& photometric,
                         VertexConfidence& confidence) const;
    void end(Frame& frame);
    void learn_from_ended(const Services* helpers);
    void keep_ended();
    void look_for_changes() noexcept;
    void look_at_ended();
    void plan_growth(const TrackerJob& job) noexcept;

    const std::shared_ptr<const Rig> rig_;
    FrameQueue& frames_;
    const uint32_t max_features_;
    MapGrowth growth_;
    Pipeline pipeline_;
    TrackedSurface surface_;
    std::shared_ptr<const Template> to_adopt_;  // one that was set, until that succeeds
    std::optional<Prefetched> prefetched_;
    std::optional<Ended> ended_;  // the frame before

    ImageCheck images_;
    RigMonitor rig_monitor_;
    TissueColours colours_;
    StaleVertices stale_;  // of this frame
    TemplateTrial trial_;
    TissueChanges changes_;         // looking_'s alone from when it begins until look_at_ended()
    bool is_depth_spoilt_ = false;  // in the last frame, by the right view's lag

    std::array<FrameAttempt, 2> attempts_;  // a second one beside the best so far
    AttemptMemory second_memory_;           // of its results, or of those of the first
    Backoff wide_search_{decisions::WideSearch::kLongestPause},
        swapped_search_{decisions::RigRows::kLongestPause};
    QualityLevelTimes level_times_;
    DeviceWait wait_;
    // The surface where it was last found, for frames that are lost. Without motions: the template
    // is another one since, or has changed.
    struct Placed {
        std::vector<defrec_motion> motions;
        bool has_unseen = false;               // lm did not place all
        std::vector<float> vertices, normals;  // only then
    } placed_;
    BesideThread looking_{[this] { look_for_changes(); }};  // ends before what it looks at
};

}  // namespace defrec
