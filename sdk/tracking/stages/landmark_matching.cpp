// See landmark_matching.hpp.
#include "sdk/tracking/stages/landmark_matching.hpp"

#include "sdk/tracking/decisions/stages.hpp"
#include "sdk/tracking/stages/make_stage.hpp"
#include "sdk/tracking/stages/template_buffers.hpp"

namespace defrec {

LandmarkMatching::LandmarkMatching(Queue& queue, const defrec_camera& camera,
                                   const TrackerSettings& settings, const TemplateData& data)
    : landmarks_(uploaded(queue, data.landmarks)),
      matches_(buffer_of<defrec_match>(queue, data.landmarks.size())),
      weighted_(buffer_of<defrec_match>(queue, data.landmarks.size())),
      summary_(buffer_of<defrec_ransac_summary>(queue, 1)) {
    if (data.landmarks.empty()) return;
    auto match = make_params<defrec_match_params>();
    match.landmarks = count_of(data.landmarks);
    match.features = settings.max_features;
    match.width = data.width;
    match.height = data.height;
    match.camera = camera;
    match_ = make_stage<DEFREC_STAGE_MATCH>(queue.device(), match);
    match_->prepare(queue, {&landmarks_});

    auto ransac = make_params<defrec_ransac_params>();
    ransac.landmarks = count_of(data.landmarks);
    ransac.iterations = decisions::StageParameters::kRansacIterations;
    ransac.seed = settings.seed;
    ransac_ = make_stage<DEFREC_STAGE_RANSAC>(queue.device(), ransac);
    ransac_->prepare(queue, {&landmarks_});
}

void LandmarkMatching::enqueue(Queue& queue, const Observation& observed, StageTimer& timer) {
    if (match_ == nullptr) return;
    match_->enqueue(queue, {&observed.feature_count, &observed.features, &observed.disparity},
                    {&matches_});
    timer.end("match");
    ransac_->enqueue(queue, {&matches_}, {&weighted_, &summary_});
    timer.end("ransac");
}

void LandmarkMatching::read_back(Queue& queue, FrameOutput& output) const {
    queue.read(weighted_, output.matches.data(), bytes_of(output.matches));
    queue.read(summary_, &output.summary->ransac, sizeof output.summary->ransac);
}

}  // namespace defrec
