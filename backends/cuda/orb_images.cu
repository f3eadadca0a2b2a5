// Stage orb: pyramid and smoothed image (sections 1 and 2 of docs/stages/orb.md) for those who ask
// for them.
#include "backends/cuda/orb_steps.hpp"

namespace defrec::cuda {
namespace {

constexpr int kRim = orb::kSmoothRadius;  // px at the image's border that are not smoothed
constexpr int kColumns = 32, kRows = 8;

__global__ void __launch_bounds__(kColumns* kRows)
    copy_images(OrbLevels levels, const uint8_t* pyramid, uint8_t* pyramid_copy,
                uint16_t* smoothed) {
    const OrbLevel& level = levels.level[blockIdx.z];
    const int x = static_cast<int>(blockIdx.x * kColumns + threadIdx.x),
              y = static_cast<int>(blockIdx.y * kRows + threadIdx.y);
    if (x >= level.width || y >= level.height) return;
    const uint8_t* const pixel = pyramid + level.first + y * level.stride + x;
    const uint32_t at = level.first_pixel + static_cast<uint32_t>(y * level.width + x);
    if (pyramid_copy != nullptr) pyramid_copy[at] = *pixel;
    if (smoothed == nullptr) return;
    uint32_t sum = 0;
    if (level.cells_x > 0 && x >= kRim && y >= kRim && x < level.width - kRim &&
        y < level.height - kRim) {
        const auto across = [&](int dy) {
            const uint8_t* p = pixel + dy * level.stride;
            return static_cast<uint32_t>(p[-2] + p[2] + 4 * (p[-1] + p[1]) + 6 * p[0]);
        };
        sum = across(-2) + across(2) + 4 * (across(-1) + across(1)) + 6 * across(0);
    }
    smoothed[at] = static_cast<uint16_t>(sum);
}

}  // namespace

void record_orb_images(Recorder& recorder, const OrbLevels& levels, const OrbMemory& memory,
                       uint8_t* pyramid, uint16_t* smoothed) {
    if (pyramid == nullptr && smoothed == nullptr) return;
    const OrbLevel& largest = levels.level[0];
    const dim3 blocks(cover(static_cast<uint32_t>(largest.width), kColumns),
                      cover(static_cast<uint32_t>(largest.height), kRows),
                      static_cast<uint32_t>(levels.levels));
    recorder.launch(copy_images, {blocks, dim3(kColumns, kRows)}, levels, memory.pyramid, pyramid,
                    smoothed);
}

}  // namespace defrec::cuda
