// See surface_check.hpp.
#include "sdk/tracking/stages/surface_check.hpp"

#include <algorithm>

#include "sdk/template/check_patches.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/tracking/decisions/stages.hpp"
#include "sdk/tracking/stages/make_stage.hpp"
#include "sdk/tracking/stages/template_buffers.hpp"
#include "sdk/tracking/stages/template_patches.hpp"

namespace defrec {
namespace {

using decisions::StageParameters;

std::vector<defrec_patch> rig_patches(const TemplateData& data) {
    std::vector<defrec_patch> patches;
    for (size_t i = 0; i < data.patches.size(); i += rig_patch_step(data))
        patches.push_back(data.patches[i]);
    return patches;
}

// Compares rather than searches: what is found lies within a pixel or two of the surface.
defrec_align_params check_params(const defrec_camera& camera, const TemplateData& data) {
    defrec_align_params align = align_params(camera, data, count_of(data.checks));
    align.level = check_level(data);
    align.patch_radius = decisions::CheckPatches::kCheckRadius;
    align.search_radius = check_search_radius(data.width);
    align.min_score = 1;
    align.keep_predicted = 1;
    return align;
}

// Coarse and wide: it is the rows of a few hundred patches together that count.
defrec_align_params right_params(const defrec_camera& camera, const TemplateData& data) {
    defrec_align_params align =
        align_params(camera, data, static_cast<uint32_t>(rig_patch_count(data)));
    align.level = std::max(StageParameters::kRightSearchLevel, data.texture_level);
    align.search_radius = StageParameters::kRightSearchRadius;
    align.right_view = 1;
    return align;
}

}  // namespace

SurfaceCheck::SurfaceCheck(Queue& queue, const defrec_camera& camera, const TemplateData& data,
                           const DeviceBuffer& views)
    : patches_(uploaded(queue, data.checks)),
      slopes_(uploaded(queue, slopes_of(data, data.checks))),
      predictions_(buffer_of<defrec_patch_prediction>(queue, data.checks.size())),
      observations_(buffer_of<defrec_patch_observation>(queue, data.checks.size())),
      compare_(make_stage<DEFREC_STAGE_ALIGN>(queue.device(), check_params(camera, data))) {
    compare_->prepare(queue, {&patches_, &views, &slopes_});
}

void SurfaceCheck::enqueue(Queue& queue, const Observation& observed, const DeviceBuffer& motions,
                           StageTimer& timer) {
    compare_->enqueue(queue, {&observed.gray[0], &observed.mask[0], &motions, nullptr},
                      {&observations_, &predictions_});
    timer.end("check");
}

void SurfaceCheck::read_back(Queue& queue, FrameOutput& output) const {
    queue.read(observations_, output.checks.data(), bytes_of(output.checks));
    queue.read(predictions_, output.check_predictions.data(), bytes_of(output.check_predictions));
}

RightViewSearch::RightViewSearch(Queue& queue, const defrec_camera& camera,
                                 const TemplateData& data, const DeviceBuffer& views)
    : patches_(uploaded(queue, rig_patches(data))),
      slopes_(uploaded(queue, slopes_of(data, rig_patches(data)))),
      observations_(buffer_of<defrec_patch_observation>(queue, rig_patch_count(data))),
      search_(make_stage<DEFREC_STAGE_ALIGN>(queue.device(), right_params(camera, data))) {
    search_->prepare(queue, {&patches_, &views, &slopes_});
}

void RightViewSearch::enqueue(Queue& queue, const Observation& observed,
                              const DeviceBuffer& motions, StageTimer& timer) {
    search_->enqueue(queue, {&observed.gray[1], &observed.mask[1], &motions, nullptr},
                     {&observations_, nullptr});
    timer.end("align right");
}

void RightViewSearch::read_back(Queue& queue, FrameOutput& output) const {
    queue.read(observations_, output.right_observations.data(),
               bytes_of(output.right_observations));
}

}  // namespace defrec
