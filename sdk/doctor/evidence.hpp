// The doctor looks at this: frames, calibration, and what matching and tracking tell of them.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/repeated_frames.hpp"
#include "sdk/doctor/rig_trial.hpp"
#include "sdk/doctor/view_matches.hpp"
#include "sdk/input/compression/compression_signs.hpp"
#include "sdk/input/frame_source.hpp"
#include "sdk/io/calibration.hpp"
#include "sdk/io/field_order.hpp"

namespace defrec::cli {

// Both views of a frame in gray.
struct GrayPair {
    cv::Mat left, right;
};

// A frame that the tracker was given.
struct TrackedFrame {
    std::uint32_t state = 0, reasons = 0;  // DEFREC_INITIALISING ..., DEFREC_REASON_*
    float view_lag_frames = 0;
    double depth_share = 0;  // of the surface
    bool has_rows = false;   // the tracker measured in which rows the right view shows the tissue

    bool is_lit() const;  // neither view is black or white
};

// The frames tracked.
struct TrackProbe {
    bool has_rig = false;  // false: the calibration was refused, and only the images say something
    std::vector<TrackedFrame> frames;
    defrec_camera camera{};  // of the rectified views
    // Disparities in the rectified views, px, all but a thousandth at either end; the first above
    // the last: none was found.
    double least_disparity = 0, largest_disparity = -1;

    std::size_t frames_with(std::uint32_t reasons) const;
    // Neither black nor white.
    std::size_t lit_frames_with(std::uint32_t reasons) const;
    // The mean over the frames that are neither black nor white, of the surface.
    double share_without_depth() const;
};

// A frame of which a view shows nothing.
struct BlankFrame {
    enum Look { kLit, kBlack, kWhite };
    std::int64_t number = 0;
    Look left = kLit, right = kLit;

    bool is_blank() const { return left != kLit || right != kLit; }
    bool is(Look look) const { return left == look || right == look; }
};

// Left views paired with right ones of other frames, all of them by one number of frames.
struct Pairing {
    int later = 0;             // the right view's frame less the left's
    double row_motion_px = 0;  // median by which rows differ beyond what all frames have in common
    bool is_never_worse = true;  // in no frame do rows agree worse than in the pairs as they are
    double row_error_px = 0;     // median by which rows differ, with what all frames have in common
};

struct Evidence {
    int width = 0, height = 0;
    FieldOrder fields = FieldOrder::kProgressive;  // of the images; otherwise frames are fields
    std::int64_t first_frame = 0, last_frame = 0;  // their numbers
    std::size_t frame_count = 0;                   // that are looked at
    std::vector<BlankFrame> blank_frames;          // by their numbers, ascending
    std::vector<RepeatedFrame> repeated_frames;    // likewise
    std::vector<GrayPair> pairs;                   // some of the frames, none of them blank where
                                                   // others are not
    CompressionSigns compression;
    StereoCalibration calibration;   // as the files have it, T in mm
    std::string refusal;             // why it is not taken; empty: it is
    bool has_other_size = false;     // the calibration names another size than the frames'
    std::vector<ViewMatch> matches;  // of `pairs`
    std::vector<RigTrial> trials;    // of the calibration without each mistake, the first without
                                     // any; empty: too few matches, or R is no rotation
    TrackProbe probe;
    std::vector<Pairing> pairings;  // that were tried, with the pairs as they are; empty: none

    // So many frames that show nothing new are a problem, fewer are not.
    bool are_most(std::size_t frames) const;
    bool has_trials() const { return !trials.empty(); }
    const RigTrial& as_given() const { return trials.front(); }
    const RigTrial& without(Mistake mistake) const;
    // The calibration as given puts the tissue in front of the cameras.
    bool has_depth() const;
};

// The calibration, for images of the size that the frames have.
StereoCalibration fitting_calibration(const Evidence& evidence);

// How many frames of this size are looked at, where there are as many.
std::size_t frames_to_look_at(int width, int height);

// Which frames' views are matched, of so many that are looked at: spread over them, and none that
// is blank, for which the next one stands in.
class FramesToMatch {
  public:
    explicit FramesToMatch(std::size_t count,
                           std::size_t most = decisions::DoctorSample::kMatchedFrames);
    // The frames in order. None is taken in all: the last one is.
    bool takes(bool is_blank);

  private:
    std::vector<std::size_t> planned_;  // ascending
    std::size_t count_ = 0, next_ = 0, taken_ = 0;
};

// Evidence is gathered in this order: the first frame, views, the calibration. `compression`,
// `probe`, `last_frame`, `frame_count`, `blank_frames` and `repeated_frames` are the caller's.
Evidence begin_evidence(const StereoFrame& first);
// Which views are black or white as DEFREC_REASON_DARK and DEFREC_REASON_SATURATED mean it.
BlankFrame look_of(const StereoFrame& frame);
// Memory of their own.
GrayPair gray_views(const StereoFrame& frame);
void add_views(GrayPair views, Evidence& evidence);
// calibration: as the files have it. refusal: why it is not taken.
void add_calibration(StereoCalibration calibration, std::string refusal, Evidence& evidence);

// Everything but the probe.
Evidence collect_evidence(const std::vector<StereoFrame>& frames, StereoCalibration calibration,
                          std::string refusal);

}  // namespace defrec::cli
