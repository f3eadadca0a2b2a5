// Two calibrated cameras: checks, rectification, the maps for the stage rectify, and pixels to and
// fro.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/base/os/services.hpp"
#include "sdk/rig/lens.hpp"

namespace defrec {

// Any thread. Immutable once made. Lengths mm, pixels px; view 0 is the left one.
class Rig {
  public:
    // Checks everything that defrec_rig_create promises. Throws Error whose text names the field.
    Rig(std::shared_ptr<const Services> services, const defrec_rig_desc& desc);

    bool identity() const { return identity_; }     // frames are rectified already
    uint32_t width() const { return desc_.width; }  // raw and rectified images have the same size
    uint32_t height() const { return desc_.height; }
    // The pinhole of both rectified images, but for the right one's principal point.
    const defrec_camera& camera() const { return camera_; }
    double principal_x(int view) const {
        return view == 1 ? camera_.cx + camera_.disparity_offset_px : camera_.cx;
    }
    // x_rectified = rotation * x_raw of that view.
    const Eigen::Matrix3d& rotation(int view) const { return rotation_[view]; }
    const defrec_rig_desc& desc() const { return desc_; }

    // The view's map for the stage rectify: width * height pairs (x, y) of raw pixel positions in
    // 1/128 px, row by row; INT32_MIN, INT32_MIN where the raw image has nothing. nullptr for an
    // identity.
    const int32_t* map(int view) const { return identity_ ? nullptr : map_[view].data(); }
    // The right view's map for a right camera that lies otherwise than the calibration says: a
    // rectified pixel (x, y), from the image's centre, is seen at (x - roll y + ratio x, y + offset
    // + roll x + ratio y), where the vergence's turn about the vertical axis takes it before. roll
    // and vergence: rad; ratio: of the focal lengths, right to left, less 1.
    struct ViewShift {
        double offset_px = 0, roll = 0, ratio = 0, vergence = 0;
    };
    std::vector<int32_t> shifted_right_map(const ViewShift& shift) const;
    uint64_t map_bytes() const { return uint64_t{8} * desc_.width * desc_.height; }

    // count pixels (u, v), raw to rectified and back; in and out may be the same. NaN where there
    // is no answer.
    void rectify_pixels(int view, const double* raw_uv, size_t count, double* rectified_uv) const;
    void distort_pixels(int view, const double* rectified_uv, size_t count, double* raw_uv) const;

    // Where a place, mm, of the left rectified camera's frame lies in a view: the nearest rectified
    // pixel, or where the raw image has that one. nullopt where it is not in the image.
    std::optional<Eigen::Vector2d> pixel_of(int view, const float place[3],
                                            bool is_rectified) const;

    defrec_rig_info info() const;

  private:
    void rectify();
    void choose_camera();
    void fill_map(int view, const ViewShift& shift, int32_t* map) const;
    Eigen::Vector2d turned(int view, const Eigen::Vector2d& rectified, double angle) const;
    bool to_raw(int view, const Eigen::Vector2d& rectified, Eigen::Vector2d& raw) const;
    bool to_rectified(int view, const Eigen::Vector2d& raw, Eigen::Vector2d& rectified) const;
    template <class Convert>
    void convert_pixels(const double* in, size_t count, double* out, Convert convert) const;

    defrec_rig_desc desc_;
    bool identity_ = false;
    defrec_camera camera_{};
    std::array<Lens, 2> lens_;
    std::array<Eigen::Matrix3d, 2> rotation_;
    std::array<ContextVector<int32_t>, 2> map_;
    std::shared_ptr<const Services> services_;
};

}  // namespace defrec
