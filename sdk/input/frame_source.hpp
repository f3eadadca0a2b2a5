// Pairs of left and right images, from two sources or from one that carries both, with their number
// and time: recorded ones, or those of cameras.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/input/bag_options.hpp"
#include "sdk/input/camera_counts.hpp"
#include "sdk/input/camera_name.hpp"
#include "sdk/input/disparity_folder.hpp"
#include "sdk/io/field_order.hpp"

namespace defrec::cli {

struct ImageView {
    const std::uint8_t* pixels = nullptr;
    int width = 0, height = 0;
    int channels = 0;        // 1: gray, 3: BGR
    std::size_t stride = 0;  // bytes from row to row
};

struct StereoFrame {
    std::int64_t index = 0;              // in the source, from 0; of cameras counted by next()
    double timestamp_ms = 0;             // of cameras from the first frame on
    ImageView left, right;               // same size and channels
    std::shared_ptr<const void> pixels;  // keeps what the views show
    // DEFREC_FIELD_*: the rows that were taken of an interlaced image; the others are made of them.
    std::uint32_t field = DEFREC_FIELD_NONE;
    std::shared_ptr<const DisparityImage> disparity{};  // null: stage stereo measures it
    float disparity_sigma_px = 0;
};

enum class Layout { kSideBySide, kTopBottom };

// Frames first .. last - 1 of the source, counted from 0; of interlaced images, fields.
struct FrameRange {
    std::int64_t first = 0;
    std::optional<std::int64_t> last;
};
// "A:B", "A:" or ":B". Throws CliError(kUsage).
FrameRange parse_frame_range(const std::string& text);

struct SourceOptions {
    // Whether they name both views, in one of the three ways.
    bool has_views() const {
        const bool has_both = !left.empty() && !right.empty();
        return int{has_both} + int{!stereo.empty()} + int{bag.is_given()} == 1;
    }
    // The left view's source, or the one that carries both, as it is shown.
    std::string name() const {
        return shown_source(bag.is_given() ? bag.path : stereo.empty() ? left : stereo);
    }

    BagOptions bag;                // this, or
    std::string left, right;       // both, or
    std::string stereo;            // this with
    std::string recording;         // file that names the three, of `defrec record`; or empty
    std::string times;             // file with the images' times; empty: they are even
    std::vector<double> times_ms;  // of that file, where it was read; otherwise empty
    std::string disparity;         // folder with the disparity of frames; empty: none
    float disparity_sigma_px = 0;  // of these, the standard deviation of what neighbours share
    Layout layout = Layout::kSideBySide;  // of both in one: left on the left, or left on top
    FrameRange range;
    double fps = 0;                                // of images; 0: the source's own, else 30
    FieldOrder fields = FieldOrder::kProgressive;  // of the images; otherwise each field is a frame
    double reconnect_seconds = 60;                 // for which a camera that stopped is looked for
};

// One thread at a time.
class FrameSource {
  public:
    // Throws CliError(kInput) when nothing can be read, or when image files of left and right do
    // not pair up. A source that starts like a camera's name (camera_name.hpp) is a camera.
    explicit FrameSource(const SourceOptions& options);
    ~FrameSource();
    FrameSource(const FrameSource&) = delete;
    FrameSource& operator=(const FrameSource&) = delete;

    int width() const;
    int height() const;
    int channels() const;
    double fps() const;  // of frames
    // How the images are read; not kAuto.
    FieldOrder fields() const;
    // Images come from cameras: next() waits for them, and passes over those that it came too late
    // for.
    bool is_live() const;
    // Empty for recorded images.
    std::optional<CameraCounts> camera_counts() const;
    // Empty but for bags.
    std::optional<BagFacts> bag_facts() const;
    // A sentence that users are to be told of the files of disparity: which frames had none, and
    // how many were of no frame that was delivered. Empty where each had its own.
    std::string disparity_remark() const;
    // That the numbers in the names of left and right images differ, alike in all pairs; or empty.
    const std::string& pairing_remark() const;
    // See CameraSource.
    void set_notice_handler(std::function<void(const std::string&)> handler);
    // How many frames next() should deliver by what the source claims.
    std::optional<std::int64_t> expected() const;

    // False at the end and at the first frame that cannot be used; fault() then says why, and is
    // empty at a regular end. Frames delivered before stay valid.
    bool next(StereoFrame& frame);
    const std::string& fault() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace defrec::cli
