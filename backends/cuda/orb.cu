// Stage orb: the pyramid, the corner of each cell, distances between them, the choice, and a
// description of each feature; one kernel for each, all levels at once (the pyramid: four).
// docs/stages/orb.md.
#include <algorithm>

#include "backends/cuda/orb_steps.hpp"
#include "backends/cuda/stages.hpp"

namespace defrec::cuda {
namespace {

constexpr uint32_t kWord = 4;  // px that are read at once, beyond the last row too

OrbLevels levels_of(const defrec_orb_params& params, const orb::Layout& layout) {
    OrbLevels levels{constants_of(params, layout), {}};
    std::ranges::copy(device_levels(layout), levels.level);
    return levels;
}
// Parts of it are read that nobody writes.
Buffer cleared(Device& device, uint64_t size) {
    Buffer buffer(device, size);
    device.clear(buffer.data(), size);
    return buffer;
}

class Orb final : public Stage {
  public:
    Orb(const defrec_orb_params& params, Device& device)
        : p_(params),
          layout_(orb::make_layout(params)),
          levels_(levels_of(params, layout_)),
          patterns_(upload(device, orb_patterns())),
          pyramid_(cleared(device, device_pixels(layout_) + kWord)),
          usable_(device, pyramid_.size()),
          corners_(make_buffer<uint32_t>(device, layout_.cells)),
          keys_(cleared(device,
                        sizeof(uint16_t) * kOrbKeysAtOnce * cover(layout_.cells, kOrbKeysAtOnce))),
          counts_(make_buffer<uint32_t>(device, kOrbKeys)),
          kept_(make_buffer<uint32_t>(device, params.capacity)) {}

    void record(Recorder& recorder, std::span<const InBuffer> in,
                std::span<const OutBuffer> out) override {
        const orb::OrbBuffers given = orb_buffers(p_, layout_, in, out);
        const OrbMemory memory{
            .gray = given.gray,
            .mask = given.mask,
            .pyramid = pyramid_.as<uint8_t>(),
            .usable = usable_.as<uint8_t>(),
            .corners = given.corners != nullptr ? given.corners : corners_.as<uint32_t>(),
            .keys = keys_.as<uint16_t>(),
            .counts = counts_.as<uint32_t>(),
            .kept = kept_.as<uint32_t>(),
            .feature_count = given.count,
            .features = given.features};
        recorder.beside([&] { record_orb_pyramid(recorder, levels_, memory); },
                        [&] { recorder.fill(counts_.data(), 0, counts_.size()); },
                        [&] {
                            if (given.scores != nullptr)
                                recorder.fill(given.scores, 0, layout_.pixels);
                        });
        record_orb_corners(recorder, levels_, memory, given.scores);
        record_orb_distances(recorder, levels_, memory, given.distances);
        record_orb_selection(recorder, levels_, memory);
        record_orb_features(recorder, levels_, memory, patterns_.as<uint32_t>());
        record_orb_images(recorder, levels_, memory, given.pyramid, given.smoothed);
    }

  private:
    defrec_orb_params p_;
    orb::Layout layout_;
    OrbLevels levels_;
    Buffer patterns_;
    // For each pixel, then for each cell.
    Buffer pyramid_, usable_, corners_, keys_;
    Buffer counts_, kept_;
};

}  // namespace

std::unique_ptr<Stage> make_orb(const defrec_orb_params& params, Device& device) {
    check_params(params);
    return std::make_unique<Orb>(params, device);
}

}  // namespace defrec::cuda
