// A submitted frame, checked: its images have the rig's size and the tracker's format.
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "sdk/tracking/frame/colour_cells.hpp"
#include "sdk/tracking/frame/given_disparity.hpp"

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
    const DeviceBuffer* pixels_in_device =
        nullptr;  // the pixels where the device need not copy them
    bool given() const { return pixels != nullptr || memory != nullptr; }
};

struct FrameInput {
    int64_t timestamp_ns = 0;
    uint32_t flags = 0;                           // DEFREC_FRAME_*
    uint32_t field = 0;                           // DEFREC_FIELD_*
    std::array<FrameImage, 2> views;              // left, right
    FrameImage ignore;                            // may be missing
    GivenDisparity given_disparity;               // of the caller, until it is kept
    KeptDisparity disparity;                      // may be missing
    std::shared_ptr<const DeviceBuffer> samples;  // where the surface is left as well; may be null
    using Clock = std::chrono::steady_clock;
    Clock::time_point deadline = Clock::time_point::max();      // of the job
    std::optional<Eigen::Isometry3d> held_motion, camera_pose;  // as defrec_frame has them
};

// An image, with pixels of a DEFREC_FORMAT_*, and where their gray values are to be kept, in rows
// of that many pixels without padding.
struct KeptImage {
    FrameImage& image;
    uint32_t format;
    uint64_t row_pixels;
    std::span<uint8_t> copy;
    const DeviceBuffer* copy_in_device = nullptr;  // the same as the device sees it, if it does
    uint32_t field = 0;  // DEFREC_FIELD_*: these rows are copied, the others made of them
    ColourCells* colours = nullptr;  // read as well, unless null
};
// Copies pixels of the host; the images are these gray copies afterwards, of which stage rectify
// makes the same as of the colours. loop: who helps it helps copying. helpers: whose threads copy
// as well where it is much, for a device that reads the copies by itself; may be nullptr. is_idle:
// no frame is under way that may want these threads, so those that are awake copy little, too.
// Throws what Services::expect_parallel_success does.
void keep_pixels(std::span<const KeptImage> images, uint32_t height, SharedLoop& loop,
                 const Services* helpers, bool is_idle);

}  // namespace defrec
