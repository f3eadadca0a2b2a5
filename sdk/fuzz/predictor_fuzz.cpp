// A predictor's frames and questions: numbers of any size, calls in any order.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/fuzz/input.hpp"

using namespace defrec::fuzz;

namespace {

constexpr double kFarthest = 1e6;  // mm, that the predictor takes
constexpr int64_t kLatest = int64_t{DEFREC_MAX_PREDICTION_MS} * 1'000'000;

void require(bool is_true) {
    if (!is_true) std::abort();
}

// Near 0 mostly, else any bits: NaN, infinite, denormal.
double number(Input& input) {
    if (input.flag()) return input.real(-100, 100);
    return std::bit_cast<double>(input.number<uint64_t>());
}

// The state of the predictor, as it is known without it.
struct Known {
    bool has_frame = false;
    int64_t time = 0;
    std::vector<uint8_t> status;
};

class Points {
  public:
    explicit Points(size_t count) : xyz_(3 * count), error_(count), status_(count) {
        defrec_predictor_desc desc;
        DEFREC_INIT(&desc);
        desc.point_count = count;
        require(defrec_predictor_create(&desc, &predictor_) == DEFREC_OK);
        known_.status.assign(count, DEFREC_POINT_UNKNOWN);
    }
    ~Points() { defrec_predictor_destroy(predictor_); }
    Points(const Points&) = delete;
    Points& operator=(const Points&) = delete;

    // Frames of the usual interval, with points that swing, so that there is something to learn.
    void add_usual(Input& input, size_t frames) {
        const double step = input.real(0, 0.5), width = input.real(0, 20);
        for (size_t frame = 0; frame < frames; ++frame) {
            phase_ += step;
            for (size_t i = 0; i < xyz_.size(); ++i)
                xyz_[i] = 80 + width * std::sin(phase_ + 0.1 * static_cast<double>(i));
            std::fill(error_.begin(), error_.end(), 0.2);
            std::fill(status_.begin(), status_.end(), uint8_t{DEFREC_POINT_OBSERVED});
            defrec_predictor_frame given = frame_of(1, DEFREC_TRACKING, 33'333'333);
            add(given);
        }
    }

    void add_any(Input& input) {
        static constexpr int64_t kIntervals[] = {33'333'333, 16'666'667, 1, 1'000'000'000, 0, -1};
        for (double& value : xyz_) value = number(input);
        for (double& value : error_) value = number(input);
        for (uint8_t& value : status_) value = input.number<uint8_t>(0, 3);
        const bool is_any_time = input.flag();
        const uint32_t epoch = input.number<uint8_t>(0, 2), state = input.number<uint8_t>(0, 5);
        const int64_t interval = is_any_time ? 0 : input.one_of(kIntervals);
        defrec_predictor_frame given = frame_of(epoch, state, interval);
        if (is_any_time) given.timestamp_ns = input.number<int64_t>();
        if (input.number<uint8_t>(0, 15) == 0) given.count = input.number<uint64_t>();
        if (input.number<uint8_t>(0, 15) == 0) given.xyz = nullptr;
        if (input.number<uint8_t>(0, 15) == 0) given.status = nullptr;
        if (input.flag()) given.expected_error_mm = nullptr;
        add(given);
    }

    void predict(Input& input) {
        const size_t count = status_.size();
        const int64_t time =
            input.flag() ? input.number<int64_t>()
                         : later(known_.time, input.number<uint32_t>(0, uint32_t{kLatest} + 1));
        std::vector<double> xyz(3 * count, -7), error(count, -7);
        std::vector<uint8_t> status(count, 77), basis(count, 77);
        const defrec_status answer = defrec_predictor_predict(
            predictor_, time, count, xyz.data(), status.data(), error.data(), basis.data());
        const bool is_within =
            known_.has_frame && time >= known_.time && time <= later(known_.time, kLatest);
        require((answer == DEFREC_OK) == is_within);
        if (answer != DEFREC_OK) {
            require(std::all_of(xyz.begin(), xyz.end(), [](double value) { return value == -7; }));
            return;
        }
        for (size_t i = 0; i < count; ++i) {
            require(status[i] == known_.status[i] && basis[i] <= DEFREC_PREDICTED_LEARNED);
            if (status[i] == DEFREC_POINT_UNKNOWN) continue;
            require(error[i] >= 0 && std::isfinite(error[i]));
            for (size_t k = 0; k < 3; ++k) require(std::isfinite(xyz[3 * i + k]));
        }
    }

  private:
    // by: may be negative; at the ends of what an int64_t holds it stays there.
    static int64_t later(int64_t time, int64_t by) {
        using Limits = std::numeric_limits<int64_t>;
        if (by > 0 && time > Limits::max() - by) return Limits::max();
        if (by < 0 && time < Limits::min() - by) return Limits::min();
        return time + by;
    }

    defrec_predictor_frame frame_of(uint32_t epoch, uint32_t state, int64_t interval) const {
        defrec_predictor_frame frame;
        DEFREC_INIT(&frame);
        frame.state = state;
        frame.epoch = epoch;
        frame.timestamp_ns = later(known_.time, interval);
        frame.count = status_.size();
        frame.xyz = xyz_.data();
        frame.expected_error_mm = error_.data();
        frame.status = status_.data();
        return frame;
    }

    static bool is_followed(const defrec_predictor_frame& frame) {
        return frame.state == DEFREC_TRACKING || frame.state == DEFREC_DEGRADED ||
               frame.state == DEFREC_RELOCALISED;
    }

    // False for a frame that the header says is refused.
    bool is_right(const defrec_predictor_frame& frame) const {
        if (frame.count != status_.size()) return false;
        if (known_.has_frame && frame.timestamp_ns <= known_.time) return false;
        if (!is_followed(frame)) return true;
        if (frame.xyz == nullptr || frame.status == nullptr) return false;
        for (size_t i = 0; i < status_.size(); ++i) {
            if (status_[i] > DEFREC_POINT_UNKNOWN) return false;
            if (status_[i] == DEFREC_POINT_UNKNOWN) continue;
            for (size_t k = 0; k < 3; ++k)
                if (!(std::abs(xyz_[3 * i + k]) <= kFarthest)) return false;
            if (frame.expected_error_mm != nullptr && !(std::isfinite(error_[i]) && error_[i] >= 0))
                return false;
        }
        return true;
    }

    void add(const defrec_predictor_frame& frame) {
        const bool is_taken = defrec_predictor_add_frame(predictor_, &frame) == DEFREC_OK;
        require(is_taken == is_right(frame));
        if (!is_taken) return;
        known_.has_frame = true;
        known_.time = frame.timestamp_ns;
        known_.status = status_;
        if (!is_followed(frame))
            std::fill(known_.status.begin(), known_.status.end(), uint8_t{DEFREC_POINT_UNKNOWN});
    }

    defrec_predictor predictor_ = nullptr;
    std::vector<double> xyz_, error_;
    std::vector<uint8_t> status_;
    double phase_ = 0;
    Known known_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    Input input(data, size);
    Points points(input.number<size_t>(1, 8));
    for (int calls = 0; calls < 1000 && !input.is_empty(); ++calls) {
        switch (input.number<uint8_t>(0, 3)) {
            case 0:
                points.add_usual(input, input.number<size_t>(1, 60));
                break;
            case 1:
                points.add_any(input);
                break;
            default:
                points.predict(input);
        }
    }
    return 0;
}
