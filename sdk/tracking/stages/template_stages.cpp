// See template_stages.hpp.
#include "sdk/tracking/stages/template_stages.hpp"

#include <algorithm>

#include "sdk/tracking/stages/make_stage.hpp"
#include "sdk/tracking/stages/template_buffers.hpp"

namespace defrec {

// The camera is the rig's, of which the template's own may differ by rounding.
TemplateStages::TemplateStages(Queue& queue, const Rig& rig, const TrackerSettings& settings,
                               const TemplateData& data)
    : views_(uploaded(queue, data.image)),
      matching_(queue, rig.camera(), settings, data),
      solver_(queue, rig.camera(), settings, data, views_),
      check_(queue, rig.camera(), data, views_),
      points_(uploaded(queue, data.vertices)),
      samples_(buffer_of<defrec_surface_sample>(queue, data.vertices.size())) {
    if (settings.self_calibration != DEFREC_SELF_CALIBRATION_OFF)
        right_search_.emplace(queue, rig.camera(), data, views_);

    auto warp = make_params<defrec_warp_params>();
    warp.nodes = node_count(data);
    warp.points = count_of(data.vertices);
    warp.width = data.width;
    warp.height = data.height;
    warp.camera = rig.camera();
    warp_ = make_stage<DEFREC_STAGE_WARP>(queue.device(), warp);
    warp_->prepare(queue, {&points_});
    queue.finish();
}

void TemplateStages::enqueue(Queue& queue, const Observation& observed,
                             const RegistrationPlan& plan, const DeviceBuffer* samples,
                             StageTimer& timer, FrameOutput& output) {
    if (samples == nullptr) samples = &samples_;
    matching_.enqueue(queue, observed, timer);
    const DeviceBuffer* matches = plan.uses_depth ? matching_.matches() : nullptr;
    const DeviceBuffer& motions = solver_.enqueue(queue, observed, plan, matches, timer);
    const bool is_checked = plan.quality_level != QualityLevel::kUnchecked;
    if (is_checked) {
        check_.enqueue(queue, observed, motions, timer);
        if (right_search_) right_search_->enqueue(queue, observed, motions, timer);
    }
    const DeviceBuffer* disparity = plan.uses_depth ? &observed.disparity : nullptr;
    warp_->enqueue(queue, {&motions, disparity}, {samples});
    timer.end("warp");
    queue.read(motions, output.motions.data(), bytes_of(output.motions));
    read_back(queue, *samples, is_checked, output);
}

void TemplateStages::read_back(Queue& queue, const DeviceBuffer& samples, bool is_checked,
                               FrameOutput& output) const {
    queue.read(samples, output.samples.data(), bytes_of(output.samples));
    if (is_checked) {
        if (right_search_) right_search_->read_back(queue, output);
        check_.read_back(queue, output);
    } else {
        const auto find_none = [](auto records) {
            std::fill(records.begin(), records.end(), typename decltype(records)::value_type{});
        };
        find_none(output.right_observations);
        find_none(output.checks);
        find_none(output.check_predictions);
    }
    matching_.read_back(queue, output);
    solver_.read_back(queue, output);
}

}  // namespace defrec
