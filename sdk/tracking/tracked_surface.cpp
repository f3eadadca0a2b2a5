// See tracked_surface.hpp.
#include "sdk/tracking/tracked_surface.hpp"

#include <algorithm>

#include "backends/shared/motion.hpp"
#include "sdk/tracking/map/piece_search.hpp"

namespace defrec {
namespace {

defrec_surface_sample at_rest(const defrec_surface_point& point) {
    defrec_surface_sample sample{};
    std::copy(std::begin(point.position), std::end(point.position), sample.position);
    std::copy(std::begin(point.normal), std::end(point.normal), sample.normal);
    sample.observation = DEFREC_NO_DEPTH;
    return sample;
}

defrec_surface_sample moved(const defrec_surface_point& point,
                            std::span<const defrec_motion> motions) {
    defrec_surface_sample sample = at_rest(point);
    const auto motion = blend<double>(motions.data(), point.node, point.weight);
    store3(apply(motion, load3<double>(point.position)), sample.position);
    store3(rotate(motion, load3<double>(point.normal)), sample.normal);
    return sample;
}

}  // namespace

TrackedSurface::Next::Next(std::shared_ptr<const Template> surface)
    : surface_(std::move(surface)),
      model_(data()),
      motions_(data().nodes.size() / 3, DualQuaternion<float>::identity().store()),
      samples_(data().vertices.size()),
      unseen_(*surface_) {
    std::transform(data().vertices.begin(), data().vertices.end(), samples_.begin(), at_rest);
}

TrackedSurface::Next::Next(TemplateData changed, std::vector<defrec_motion> motions,
                           TrackedSurface& before)
    : surface_(std::make_shared<const Template>(std::move(changed), *before.template_)),
      model_(data()),
      motions_(std::move(motions)),
      samples_(before.samples_),
      unseen_(*surface_, before.learnt_unseen()) {
    for (size_t i = samples_.size(); i < data().vertices.size(); ++i)
        samples_.push_back(moved(data().vertices[i], motions_));
}

std::shared_ptr<const Template> TrackedSurface::current() const {
    const std::lock_guard lock(mutex_);
    return template_;
}

void TrackedSurface::take(Next next) {
    learning_.wait();
    model_.emplace(std::move(next.model_));
    motions_ = std::move(next.motions_);
    samples_ = std::move(next.samples_);
    unseen_ = std::move(next.unseen_);
    if (has_body_) next.surface_->start_body();
    const std::lock_guard lock(mutex_);
    template_ = std::move(next.surface_);
}

void TrackedSurface::adopt(Next next, Source source) {
    is_tracking_ = source != Source::kGiven;
    pieces_.reset(next.data().pieces(), is_tracking_);
    camera.reset();
    age_ = 0;
    take(std::move(next));
    depth_speed_.begin(samples_.size());
    contradicted_depth_.begin(samples_.size());
    if (source == Source::kCapturedAgain) return;
    ++epoch_;
    ++template_epoch_;
}

void TrackedSurface::change(Next next) {
    take(std::move(next));
    depth_speed_.grow(samples_.size());
    contradicted_depth_.grow(samples_.size());
    ++template_epoch_;
}

void TrackedSurface::withdraw() {
    --epoch_;
    --template_epoch_;
    give_up();
}

void TrackedSurface::give_up() {
    is_tracking_ = false;
    const std::lock_guard lock(mutex_);
    template_.reset();
}

uint32_t TrackedSurface::found(std::span<const defrec_motion> motions, bool is_degraded,
                               const PieceEvidences& pieces, bool uses_depth) {
    uint32_t state = !is_tracking_ ? DEFREC_RELOCALISED
                     : is_degraded ? DEFREC_DEGRADED
                                   : DEFREC_TRACKING;
    if (!is_tracking_) ++epoch_;
    is_tracking_ = true;
    uses_depth_ = uses_depth;
    age_ = 0;
    std::copy(motions.begin(), motions.end(), motions_.begin());
    pieces_.end_frame(state, pieces, uses_depth);
    if (pieces_.misses_one() && state == DEFREC_TRACKING) state = DEFREC_DEGRADED;
    return state;
}

void TrackedSurface::lost(const PieceEvidences& pieces, bool uses_depth) {
    is_tracking_ = false;
    depth_speed_.interrupt();
    learning_.wait();
    unseen_.add_lost_frame();
    ++age_;
    pieces_.end_frame(DEFREC_LOST, pieces, uses_depth);
}

void TrackedSurface::keep_samples(SurfaceSamples samples) {
    depth_speed_.add_frame(data().camera, samples_, samples, uses_depth_);
    std::copy(samples.begin(), samples.end(), samples_.begin());
}

void TrackedSurface::move_samples() {
    for (size_t i = 0; i < samples_.size(); ++i) {
        const defrec_surface_sample sample = moved(data().vertices[i], motions_);
        std::copy_n(sample.position, 3, samples_[i].position);
        std::copy_n(sample.normal, 3, samples_[i].normal);
    }
}

void TrackedSurface::search_lost_pieces(std::span<const defrec_match> matches) {
    for (size_t piece = 0; piece < pieces_.pieces().size(); ++piece)
        if (pieces_.pieces()[piece].state == DEFREC_LOST)
            search_piece(data(), piece, matches, motions_);
}

}  // namespace defrec
