// Places of points in the last frames, and between them.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace defrec {

// A position at some time as a sum of weighted positions of consecutive frames.
struct Taps {
    std::uint64_t first = 0;  // number of the first of them
    std::size_t count = 0;    // 0: the time is before all frames
    std::array<double, 4> weights{};
};

// Weights of Lagrange's polynomial through `count` times, at a time.
std::array<double, 4> lagrange_weights(const double* times, std::size_t count, double time);

struct MotionFrame {
    double time_s = 0;
    Eigen::Matrix3Xd xyz;  // finite, also of unknown points
    // Positions 0, 1, 2 ... steps before, as far as frames reach, and the first frame they use.
    std::vector<Taps> lags;
    std::uint64_t lags_from = 0;
};

// Frames have numbers that grow by one. Memory of frames that are let go is used again.
class MotionHistory {
  public:
    bool is_empty() const { return size_ == 0; }
    std::uint64_t oldest() const { return next_ - size_; }
    std::uint64_t newest() const { return next_ - 1; }
    const MotionFrame& at(std::uint64_t number) const { return frames_[slot(number)]; }
    MotionFrame& newest_frame() { return frames_[slot(newest())]; }

    // A frame later than all others, its lags empty. Throws std::bad_alloc, and is as before.
    MotionFrame& add(double time_s, std::size_t points);
    void forget() { size_ = 0; }
    // number: of a frame, or of one that is forgotten already.
    void forget_before(std::uint64_t number);

    // The newest frame at or before a time; that must not be before the oldest.
    std::uint64_t last_before(double time_s) const;
    // A time after the newest frame counts as that frame's.
    Taps taps(double time_s, double same_s) const;
    // One point's.
    Eigen::Vector3d position(const Taps& taps, Eigen::Index point) const;

  private:
    std::size_t slot(std::uint64_t number) const { return number % frames_.size(); }
    void grow();

    std::vector<MotionFrame> frames_;
    std::uint64_t next_ = 0;
    std::size_t size_ = 0;
};

}  // namespace defrec
