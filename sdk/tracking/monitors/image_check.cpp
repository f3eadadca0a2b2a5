// See image_check.hpp.
#include "sdk/tracking/monitors/image_check.hpp"

#include "sdk/base/os/services.hpp"
#include "sdk/tracking/evidence/vertex_runs.hpp"

namespace defrec {

ImageCheck::ImageCheck(std::shared_ptr<const Rig> rig)
    : rig_(std::move(rig)),
      blocks_{std::array{FrozenRegions(rig_->width(), rig_->height()),
                         FrozenRegions(rig_->width(), rig_->height())},
              std::array{FrozenRegions(rig_->width(), rig_->height()),
                         FrozenRegions(rig_->width(), rig_->height())}} {}

StreamCheck::Finding ImageCheck::look_at(const Frame& frame, const Services* helpers) {
    constexpr size_t kParts = FrozenRegions::kParts;
    kind_ = frame.field == DEFREC_FIELD_BOTTOM ? 1 : 0;
    std::array<FrozenRegions, 2>& blocks = blocks_[kind_];
    std::array<GraySums, kParts> sums[2];
    // The part's pixels come from memory once.
    for_each_task(helpers, 2 * kParts, [&](size_t task) {
        const size_t i = task / kParts, part = task % kParts;
        const auto& [gray, is_rectified] = frame.views[i];
        const int32_t* map = is_rectified ? rig_->map(static_cast<int>(i)) : nullptr;
        sums[i][part] = sum_gray(gray, rig_->width(), rig_->height(), blocks[i].rows_of(part), map);
        blocks[i].add_part(gray, part);
    });
    ImageStatistics statistics[2];
    for (size_t i = 0; i < 2; ++i) {
        statistics[i] = image_statistics(sums[i]);
        blocks[i].end_image();
        statistics[i].frozen = blocks[i].share();
    }
    return stream_.check(frame.timestamp_ns, statistics[0], statistics[1], kind_ == 1);
}

}  // namespace defrec
