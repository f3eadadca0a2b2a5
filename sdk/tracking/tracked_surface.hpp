// The surface that is tracked: its template, and where it was last found.
#pragma once
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "sdk/base/os/beside_thread.hpp"
#include "sdk/tracking/evidence/contradicted_depth.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"
#include "sdk/tracking/monitors/camera_anchor.hpp"
#include "sdk/tracking/monitors/piece_states.hpp"
#include "sdk/tracking/points/unseen_motion.hpp"

namespace defrec {

// One thread, the tracker's.
class TrackedSurface {
  public:
    // has_body: of templates, computed once they are tracked.
    explicit TrackedSurface(bool has_body) : has_body_(has_body) {}

    // The template; null before there is one. Any thread.
    std::shared_ptr<const Template> current() const;

    // Everything that a template needs, made before it takes the place of another one: nothing
    // fails from there on.
    class Next {
      public:
        // Another template, at rest.
        explicit Next(std::shared_ptr<const Template> surface);
        // That of `before` with more or other parts, where it is; motions: of its control points.
        Next(TemplateData changed, std::vector<defrec_motion> motions, TrackedSurface& before);
        const TemplateData& data() const { return surface_->data(); }

      private:
        friend class TrackedSurface;
        std::shared_ptr<const Template> surface_;
        SurfaceModel model_;
        std::vector<defrec_motion> motions_;
        std::vector<defrec_surface_sample> samples_;
        UnseenMotion unseen_;
    };
    // kCapturedAgain: once more from the frame that the last one was captured from, which it
    // improves: its number stays.
    enum class Source { kGiven, kCaptured, kCapturedAgain };
    // Another template.
    void adopt(Next next, Source source);
    // The same one, changed.
    void change(Next next);
    // The template that was adopted last has not come to be known: the next one takes its number.
    void withdraw();

    // There is none any more.
    void give_up();

    // The members below need a template.
    bool has_template() const { return template_ != nullptr; }
    const std::shared_ptr<const Template>& surface() const { return template_; }
    const TemplateData& data() const { return template_->data(); }
    const SurfaceModel& model() const { return *model_; }
    // Where it was last found.
    std::span<const defrec_motion> motions() const { return motions_; }
    SurfaceSamples samples() const { return samples_; }
    const PieceStates& pieces() const { return pieces_; }

    // It was found in the frame before.
    bool is_tracking() const { return is_tracking_; }
    uint32_t epoch() const { return epoch_; }
    uint32_t template_epoch() const { return template_epoch_; }
    // Frames since it was found.
    uint32_t age() const { return age_; }

    // The frame's end: found there, by the motions and the evidence of its pieces; or lost.
    // Returns the frame's state, DEFREC_*. is_degraded: else it is TRACKING.
    uint32_t found(std::span<const defrec_motion> motions, bool is_degraded,
                   const PieceEvidences& pieces, bool uses_depth);
    void lost(const PieceEvidences& pieces, bool uses_depth);
    // The same frame's vertices, once nobody reads those before.
    void keep_samples(SurfaceSamples samples);
    // Moves them to where motions() has them.
    void move_samples();
    // By the samples that were kept.
    const DepthSpeed& depth_speed() const { return depth_speed_; }
    // By the frames that add_depth() was given: as ContradictedDepth::add_frame().
    const ContradictedDepth& contradicted_depth() const { return contradicted_depth_; }
    void add_depth(SurfaceSamples samples, std::span<const uint8_t> is_confirmed,
                   std::span<const uint8_t> status) {
        contradicted_depth_.add_frame(samples, is_confirmed, status);
    }
    // The next frame looks for pieces that are lost where their landmarks' matches say.
    void search_lost_pieces(std::span<const defrec_match> matches);

    // The next frame starts from motions that change(motions) has changed.
    template <class Change>
    void start_from(const Change& change) {
        change(std::span<defrec_motion>(motions_));
    }

    CameraAnchor camera;
    // UnseenMotion::add_frame().
    bool place_unseen(SurfaceSamples samples, std::span<const defrec_piece> pieces,
                      const UnseenMotion::Results& results, const Services* helpers) {
        learning_.wait();
        return unseen_.add_frame(*template_, samples, pieces, results, helpers);
    }
    // UnseenMotion::learn().
    void learn_unseen() noexcept {
        learning_.wait();
        unseen_.learn();
    }
    // The same beside what follows; place_unseen() and another template wait for it.
    void begin_to_learn_unseen() noexcept {
        learning_.wait();
        if (unseen_.has_lesson()) learning_.begin();
    }

  private:
    void take(Next next);
    const UnseenMotion& learnt_unseen() {
        learning_.wait();
        return unseen_;
    }

    const bool has_body_;
    mutable std::mutex mutex_;
    std::shared_ptr<const Template> template_;  // written under the mutex, by the tracker's thread
    std::optional<SurfaceModel> model_;
    std::vector<defrec_motion> motions_;
    std::vector<defrec_surface_sample> samples_;
    PieceStates pieces_;
    UnseenMotion unseen_;
    DepthSpeed depth_speed_;
    ContradictedDepth contradicted_depth_;
    bool uses_depth_ = false;  // the last frame that was found
    bool is_tracking_ = false;
    uint32_t epoch_ = 0, template_epoch_ = 0, age_ = 0;
    BesideThread learning_{[this] { unseen_.learn(); }};  // ends before what it learns
};

}  // namespace defrec
