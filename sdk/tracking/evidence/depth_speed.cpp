// See depth_speed.hpp.
#include "sdk/tracking/evidence/depth_speed.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/tracking/decisions/confidence.hpp"

namespace defrec {

using Decision = decisions::DepthSpeed;

void DepthSpeed::begin(size_t vertices) {
    speed_.assign(vertices, 0);
    usual_ = 0;
    interrupt();
}

void DepthSpeed::interrupt() {
    is_interrupted_ = true;
    unmeasured_ = 0;
    squared_frames_ = Decision::kShare;
}

void DepthSpeed::add_frame(const defrec_camera& camera,
                           std::span<const defrec_surface_sample> before,
                           std::span<const defrec_surface_sample> now, bool is_measured) {
    // The first one after some without depth shows the way of all of them.
    const bool follows = !is_interrupted_ && unmeasured_ == 0;
    is_interrupted_ = false;
    unmeasured_ = is_measured ? 0 : std::min(unmeasured_ + 1, Decision::kMostFrames);
    const auto frames = static_cast<float>(unmeasured_ + 1);
    squared_frames_ = Decision::kShare * frames * frames;
    if (!is_measured || !follows) return;
    const auto focal_baseline = static_cast<float>(camera.fx * camera.baseline_mm);
    float squares = 0;
    size_t count = 0;
    for (size_t i = 0; i < std::min(speed_.size(), now.size()); ++i) {
        if (now[i].observation != DEFREC_OBSERVED || before[i].observation != DEFREC_OBSERVED)
            continue;
        const float change =
            focal_baseline / now[i].position[2] - focal_baseline / before[i].position[2];
        speed_[i] += (change - speed_[i]) / Decision::kMemory;
        squares += speed_[i] * speed_[i];
        ++count;
    }
    if (count == 0) return;
    const float fastest = std::sqrt(squares / static_cast<float>(count));
    usual_ = std::max(fastest, usual_ * Decision::kDecay);
}

}  // namespace defrec
