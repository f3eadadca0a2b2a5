// See frame_output.hpp.
#include "sdk/tracking/frame/frame_output.hpp"

#include <algorithm>

#include "sdk/tracking/decisions/stages.hpp"

namespace defrec {
namespace {

// Hands out pieces of a block one after the other, each on a cache line of its own; without a block
// it only counts.
class Carver {
  public:
    explicit Carver(std::span<std::byte> block) : block_(block) {}
    template <class T>
    void take(std::span<T>& piece, uint64_t count) {
        if (!block_.empty()) piece = {reinterpret_cast<T*>(block_.data() + used_), count};
        used_ += (count * sizeof(T) + kLine - 1) / kLine * kLine;
    }
    uint64_t used() const { return used_; }

  private:
    static constexpr uint64_t kLine = 64;
    std::span<std::byte> block_;
    uint64_t used_ = 0;
};

uint64_t carve_fixed(std::span<std::byte> block, uint64_t disparities, FrameOutput& output) {
    Carver carver(block);
    std::span<FrameSummary> summary;
    carver.take(summary, 1);
    carver.take(output.disparity, disparities);
    output.summary = summary.data();
    return carver.used();
}

uint64_t carve_fitted(std::span<std::byte> block, const TemplateData& data, FrameOutput& output) {
    Carver carver(block);
    output.fit(data, [&](auto& array, size_t count) { carver.take(array, count); });
    return carver.used();
}

}  // namespace

size_t rig_patch_step(const TemplateData& data) {
    constexpr size_t kEnough = decisions::StageParameters::kRightPatches;
    const size_t first = data.first_counts().patches;
    return (first + kEnough - 1) / kEnough + (first == 0 ? 1 : 0);
}

size_t rig_patch_count(const TemplateData& data) {
    const size_t step = rig_patch_step(data);
    return (data.patches.size() + step - 1) / step;
}

void AttemptMemory::make_room(const TemplateData& data) {
    FrameOutput unused;
    const uint64_t bytes = carve_fitted({}, data, unused);
    if (bytes > fitted_.size()) fitted_ = HostMemory(device_, bytes);
}

FrameMemory::FrameMemory(std::shared_ptr<const Device> device, uint64_t disparities)
    : fixed_(device, carve_fixed({}, disparities, output)), attempt_(std::move(device)) {
    carve_fixed(fixed_.as<std::byte>(), disparities, output);
}

void FrameMemory::fit(const TemplateData& data) {
    attempt_.make_room(data);
    carve_fitted(attempt_.fitted_.as<std::byte>(), data, output);
}

void FrameMemory::exchange(AttemptMemory& other, const TemplateData& data) {
    std::swap(attempt_, other);
    fit(data);
}

}  // namespace defrec
