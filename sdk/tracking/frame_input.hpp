// A submitted frame, checked: its images have the rig's size and the tracker's format.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>

namespace defrec {

class DeviceBuffer;  // device.hpp
class Services;      // services.hpp
class SharedLoop;    // shared_loop.hpp

// Where an image lies: pixels of the host, or memory of the tracker's device. Neither: there is
// none.
struct FrameImage {
    const uint8_t* pixels = nullptr;
    uint64_t stride = 0;  // bytes from row to row
    std::shared_ptr<const DeviceBuffer> memory;
    bool given() const { return pixels != nullptr || memory != nullptr; }
};

struct FrameInput {
    int64_t timestamp_ns = 0;
    uint32_t flags = 0;                           // DEFREC_FRAME_*
    std::array<FrameImage, 2> views;              // left, right
    FrameImage ignore;                            // may be missing
    std::shared_ptr<const DeviceBuffer> samples;  // where the surface is left as well; may be null
    using Clock = std::chrono::steady_clock;
    Clock::time_point deadline = Clock::time_point::max();  // of the job
};

// An image and where its pixels are to be kept, in rows of that many bytes without padding.
struct KeptImage {
    FrameImage& image;
    uint64_t row_bytes;
    std::span<uint8_t> copy;
};
// Copies pixels of the host; the images are these copies afterwards. loop: who helps it helps
// copying. helpers: whose threads copy as well where it is much, for a device that reads the copies
// by itself; may be nullptr. Throws what Services::expect_parallel_success does.
void keep_pixels(std::span<const KeptImage> images, uint32_t height, SharedLoop& loop,
                 const Services* helpers);

}  // namespace defrec
