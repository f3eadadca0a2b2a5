// See predictor.hpp.
#include "sdk/predictor/predictor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "sdk/base/util/error.hpp"
#include "sdk/predictor/decisions.hpp"

namespace defrec {
namespace {

using decisions::PredictionGrid;
using decisions::PredictionJumps;
using decisions::PredictionMemory;

constexpr double kNanosecond = 1e-9;
constexpr uint64_t kMaxPredictionMs = DEFREC_MAX_PREDICTION_MS;
constexpr uint64_t kNanosecondsPerMs = 1'000'000;

// later is not before earlier; their difference may be larger than an int64_t.
uint64_t nanoseconds_between(int64_t earlier, int64_t later) {
    return static_cast<uint64_t>(later) - static_cast<uint64_t>(earlier);
}
double seconds_between(int64_t earlier, int64_t later) {
    return static_cast<double>(nanoseconds_between(earlier, later)) * kNanosecond;
}

// The curve through what is known and predicted of all points, at a time after the last frame.
struct Curve {
    std::size_t first = 0;  // 0: one step before the frame, 1: the frame, 2 ...: after it
    std::size_t count = 0;
    std::array<double, 4> weights{};
};

Curve curve_at(double steps, std::size_t horizons) {
    const std::size_t last = horizons + 1;
    Curve curve;
    const auto before = std::min<std::size_t>(static_cast<std::size_t>(steps), horizons - 1);
    curve.first = before;
    curve.count = std::min<std::size_t>(before + 3, last) - before + 1;
    std::array<double, 4> times{};
    for (std::size_t i = 0; i < curve.count; ++i)
        times[i] = static_cast<double>(curve.first + i) - 1;
    curve.weights = lagrange_weights(times.data(), curve.count, steps);
    return curve;
}

}  // namespace

Predictor::Predictor(std::size_t points) : runs_(points) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    last_.xyz.resize(3 * points, nan);
    last_.error_mm.resize(points, nan);
    last_.status.resize(points, DEFREC_POINT_UNKNOWN);
}

void Predictor::check(const FollowedPoints& frame) const {
    if (has_frame_ && frame.time_ns <= last_.time_ns)
        fail(DEFREC_ERROR_ARGUMENT, "frame.timestamp_ns is ", frame.time_ns,
             ", not after that of the frame before, ", last_.time_ns);
    if (!frame.is_followed) return;
    for (std::size_t point = 0; point < point_count(); ++point) {
        const unsigned status = frame.status[point];
        if (status > DEFREC_POINT_UNKNOWN)
            fail(DEFREC_ERROR_ARGUMENT, "frame.status of point ", point, " is ", status,
                 "; expected DEFREC_POINT_*");
        if (status == DEFREC_POINT_UNKNOWN) continue;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double value = frame.xyz[3 * point + axis];
            if (!(std::abs(value) <= PredictionGrid::kFarthest))
                fail(DEFREC_ERROR_ARGUMENT, "frame.xyz of point ", point, " has ", value,
                     ", and its status is not DEFREC_POINT_UNKNOWN; expected at most ",
                     PredictionGrid::kFarthest, " mm");
        }
        if (frame.expected_error_mm == nullptr) continue;
        const double error = frame.expected_error_mm[point];
        if (!(error >= 0 && std::isfinite(error)))
            fail(DEFREC_ERROR_ARGUMENT, "frame.expected_error_mm of point ", point, " is ", error,
                 "; expected a finite number that is not negative");
    }
}

void Predictor::keep(const FollowedPoints& frame) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::size_t points = point_count();
    const auto copy = [&](const double* from, std::size_t count, double otherwise, double* to) {
        if (from == nullptr)
            std::fill_n(to, count, otherwise);
        else
            std::copy_n(from, count, to);
    };
    copy(frame.xyz, 3 * points, nan, last_.xyz.data());
    copy(frame.expected_error_mm, points, frame.is_followed ? 0 : nan, last_.error_mm.data());
    if (frame.is_followed)
        std::copy_n(frame.status, points, last_.status.data());
    else
        std::fill(last_.status.begin(), last_.status.end(), uint8_t{DEFREC_POINT_UNKNOWN});
    last_.time_ns = frame.time_ns;
    last_.epoch = frame.epoch;
    has_frame_ = true;
}

void Predictor::forget() {
    history_.forget();
    forecasts_.clear();
    runs_.end_all();
}

void Predictor::add_frame(const FollowedPoints& frame) {
    check(frame);
    const double seconds = has_frame_ ? seconds_between(last_.time_ns, frame.time_ns) : 0;
    const bool is_other = has_frame_ && frame.epoch != last_.epoch;
    keep(frame);
    if (!frame.is_followed || is_other || interval_.is_gap(seconds)) forget();
    try {
        if (seconds > 0 && interval_.add(seconds)) {
            forecasts_.clear();
            learner_.emplace(point_count(), interval_.horizons(), interval_.step_s());
        }
        if (frame.is_followed) follow(frame, seconds);
    } catch (...) {
        forget();
        throw;
    }
}

double Predictor::max_motion_mm(double seconds) const {
    if (!learner_) return std::numeric_limits<double>::infinity();
    const double usual = std::sqrt(learner_->models()[0].errors.mean(Basis::kLast));
    const double steps = std::max(1.0, seconds / interval_.step_s());
    return std::max(PredictionJumps::kMin, PredictionJumps::kRatio * usual * steps);
}

void Predictor::follow(const FollowedPoints& frame, double seconds) {
    if (history_.is_empty()) origin_ns_ = frame.time_ns;
    history_.add(seconds_between(origin_ns_, frame.time_ns), point_count());
    runs_.add(frame, max_motion_mm(seconds), history_);
    if (!learner_) return;
    learner_->add(history_, runs_, forecasts_, seconds);
    find_lags();
    forecast();
}

void Predictor::find_lags() {
    const double step = interval_.step_s();
    MotionFrame& frame = history_.newest_frame();
    frame.lags_from = history_.newest();
    for (int lag = 0; lag <= PredictionGrid::kLags; ++lag) {
        const Taps taps = history_.taps(frame.time_s - lag * step, PredictionGrid::kSame * step);
        if (taps.count == 0) break;
        frame.lags.push_back(taps);
        frame.lags_from = std::min(frame.lags_from, taps.first);
    }
}

void Predictor::forecast() {
    Forecast next;
    const double now = history_.at(history_.newest()).time_s;
    const double kept = static_cast<double>(learner_->models().size() + 2) * interval_.step_s();
    while (!forecasts_.empty() && (forecasts_.front().time_s < now - kept ||
                                   forecasts_.front().frame < history_.oldest())) {
        next = std::move(forecasts_.front());
        forecasts_.pop_front();
    }
    make_forecast(history_, runs_, learner_->models(), learner_->points(), next);
    forecasts_.push_back(std::move(next));
    history_.forget_before(history_.at(forecasts_.front().frame).lags_from);
}

double Predictor::expected_error(std::size_t point, double steps) const {
    const Forecast& made = forecasts_.back();
    double before = last_.error_mm[point];
    for (std::size_t i = 0; i < made.horizons.size(); ++i) {
        const PredictionErrors& errors = learner_->models()[i].errors;
        const double squared = std::max(errors.own(point), errors.mean(made.basis(i, point)));
        const double error = std::max(before, std::sqrt(squared));
        const double share = steps - static_cast<double>(i);
        if (share <= 1 || i + 1 == made.horizons.size()) return before + share * (error - before);
        before = error;
    }
    return before;
}

double Predictor::check_time(int64_t time_ns) const {
    if (!has_frame_) fail(DEFREC_ERROR_STATE, "the predictor has no frame yet");
    if (time_ns < last_.time_ns)
        fail(DEFREC_ERROR_ARGUMENT, "timestamp_ns is ", time_ns, ", before the last frame's, ",
             last_.time_ns);
    const uint64_t after = nanoseconds_between(last_.time_ns, time_ns);
    if (after > kMaxPredictionMs * kNanosecondsPerMs)
        fail(DEFREC_ERROR_ARGUMENT, "timestamp_ns is ", time_ns, ", ", after / kNanosecondsPerMs,
             " ms after the last frame's; expected at most ", kMaxPredictionMs, " ms");
    return static_cast<double>(after) * kNanosecond;
}

void Predictor::predict(int64_t time_ns, const PredictedPoints& out) const {
    const double seconds = check_time(time_ns);
    std::copy(last_.xyz.begin(), last_.xyz.end(), out.xyz);
    if (out.status != nullptr) std::copy(last_.status.begin(), last_.status.end(), out.status);
    if (out.expected_error_mm != nullptr)
        std::copy(last_.error_mm.begin(), last_.error_mm.end(), out.expected_error_mm);
    if (out.basis != nullptr) std::fill_n(out.basis, point_count(), uint8_t{DEFREC_PREDICTED_LAST});
    if (!forecasts_.empty())
        move_on(seconds / interval_.step_s(), out);
    else if (out.expected_error_mm != nullptr)
        for (std::size_t point = 0; point < point_count(); ++point)
            if (double& error = out.expected_error_mm[point]; runs_.is_known(point))
                error = std::max(error, PredictionMemory::kUnknownSpeed * seconds);
}

void Predictor::move_on(double steps, const PredictedPoints& out) const {
    const Forecast& made = forecasts_.back();
    const MotionFrame& frame = history_.at(history_.newest());
    const std::size_t horizons = made.horizons.size();
    const Curve curve = curve_at(steps, horizons);
    const auto horizon =
        std::min(static_cast<std::size_t>(std::ceil(std::max(steps, 1.0))), horizons) - 1;
    for (std::size_t point = 0; point < point_count(); ++point) {
        if (made.reach[point] == Reach::kUnknown) continue;
        if (out.expected_error_mm != nullptr)
            out.expected_error_mm[point] = expected_error(point, steps);
        const Basis basis = made.basis(horizon, point);
        if (basis == Basis::kLast) continue;
        if (out.basis != nullptr) out.basis[point] = static_cast<uint8_t>(basis);
        const auto column = static_cast<Eigen::Index>(point);
        Eigen::Map<Eigen::Vector3d> position(out.xyz + 3 * point);
        position.setZero();
        for (std::size_t i = 0; i < curve.count; ++i) {
            const std::size_t node = curve.first + i;
            position += curve.weights[i] *
                        (node == 0   ? history_.position(frame.lags[1], column)
                         : node == 1 ? Eigen::Vector3d(frame.xyz.col(column))
                                     : Eigen::Vector3d(made.horizons[node - 2].xyz.col(column)));
        }
    }
}

}  // namespace defrec
