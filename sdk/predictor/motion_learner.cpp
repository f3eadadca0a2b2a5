// See motion_learner.hpp.
#include "sdk/predictor/motion_learner.hpp"

#include <algorithm>

#include "sdk/predictor/decisions.hpp"

namespace defrec {
namespace {

using decisions::PredictionGrid;
using decisions::PredictionLearning;

// Sums of squared errors, by basis.
struct ErrorSums {
    ByBasis squared{};
    std::array<std::size_t, kBases> count{};

    void add(Basis basis, double value) {
        squared[static_cast<std::size_t>(basis)] += value;
        ++count[static_cast<std::size_t>(basis)];
    }
    // A basis without points counts as the one before.
    ByBasis means() const {
        ByBasis means{};
        for (std::size_t i = 0; i < kBases; ++i) {
            if (count[i] != 0)
                means[i] = squared[i] / static_cast<double>(count[i]);
            else if (i != 0)
                means[i] = means[i - 1];
        }
        return means;
    }
};

// Whether the truth that a prediction is compared with is of frames in which the point was known.
bool is_seen(const PointRuns& runs, std::size_t point, const Taps& now) {
    return now.count == 1 ? runs.is_known(point) : runs.covers(point, now.first);
}

}  // namespace

MotionLearner::MotionLearner(std::size_t points, std::size_t horizons, double step_s)
    : step_s_(step_s), due_(horizons, UINT64_MAX) {
    const std::size_t count = std::min(points, PredictionLearning::kPoints);
    for (std::size_t i = 0; i < count; ++i) points_.push_back(i * points / count);
    for (std::size_t i = 0; i < horizons; ++i) {
        const int steps = static_cast<int>(i) + 1;
        models_.push_back({LagModel(steps, step_s), LagModel::damped(steps, step_s),
                           PredictionErrors(points, steps * step_s)});
    }
    const auto equations = static_cast<Eigen::Index>(3 * count);
    motions_.resize(PredictionGrid::kLags, equations);
    reached_.resize(equations);
}

void MotionLearner::add(const MotionHistory& history, const PointRuns& runs,
                        const std::deque<Forecast>& forecasts, double seconds) {
    const double now = history.at(history.newest()).time_s, same = PredictionGrid::kSame * step_s_;
    for (std::size_t i = 0; i < models_.size(); ++i) {
        const double ahead = static_cast<double>(i + 1) * step_s_;
        const auto made =
            std::find_if(forecasts.rbegin(), forecasts.rend(),
                         [&](const Forecast& each) { return each.time_s + ahead <= now + same; });
        if (made == forecasts.rend() || made->frame == due_[i] || made->frame < history.oldest())
            continue;
        due_[i] = made->frame;
        const Due due{*made, i, history.taps(made->time_s + ahead, same)};
        judge(history, runs, due, seconds);
        compare(history, runs, due, seconds);
        models_[i].learned.forget(seconds);
        learn(history, runs, due);
    }
}

void MotionLearner::judge(const MotionHistory& history, const PointRuns& runs, const Due& due,
                          double seconds) {
    const Horizon& horizon = due.made.horizons[due.horizon];
    for (std::size_t point = 0; point < runs.size(); ++point) {
        if (due.made.reach[point] == Reach::kUnknown || !is_seen(runs, point, due.now)) continue;
        const auto column = static_cast<Eigen::Index>(point);
        const double squared =
            (history.position(due.now, column) - horizon.xyz.col(column)).squaredNorm();
        models_[due.horizon].errors.add_own(point, squared, seconds);
    }
}

void MotionLearner::compare(const MotionHistory& history, const PointRuns& runs, const Due& due,
                            double seconds) {
    const MotionFrame& frame = history.at(due.made.frame);
    ErrorSums all, whole;
    for (std::size_t j = 0; j < points_.size(); ++j) {
        const std::size_t point = points_[j];
        const Reach reach = due.made.reach[point];
        if (reach == Reach::kUnknown || !is_seen(runs, point, due.now)) continue;
        const auto column = static_cast<Eigen::Index>(point);
        const Eigen::Vector3d way = history.position(due.now, column) - frame.xyz.col(column);
        ErrorSums& compared = reach == Reach::kLearned ? whole : all;
        compared.add(Basis::kLast, way.squaredNorm());
        if (reach == Reach::kPosition || frame.lags[1].first < history.oldest()) continue;
        const Eigen::Vector3d step =
            frame.xyz.col(column) - history.position(frame.lags[1], column);
        compared.add(Basis::kVelocity, (way - models_[due.horizon].damped * step).squaredNorm());
        if (reach != Reach::kLearned) continue;
        const auto& learned = due.made.horizons[due.horizon].learned;
        compared.add(Basis::kLearned,
                     (way + frame.xyz.col(column) - learned.col(static_cast<Eigen::Index>(j)))
                         .squaredNorm());
    }
    const bool any_whole = whole.count[0] != 0;
    for (std::size_t i = 0; i < kBases; ++i) {
        all.squared[i] += whole.squared[i];
        all.count[i] += whole.count[i];
    }
    if (all.count[0] == 0) return;
    models_[due.horizon].errors.add_means(all.means(), (any_whole ? whole : all).means(), seconds);
}

void MotionLearner::learn(const MotionHistory& history, const PointRuns& runs, const Due& due) {
    const MotionFrame& frame = history.at(due.made.frame);
    if (frame.lags.size() <= PredictionGrid::kLags || frame.lags_from < history.oldest()) return;
    Eigen::Index equations = 0;
    for (const std::size_t point : points_) {
        if (!runs.covers(point, frame.lags_from)) continue;
        const auto column = static_cast<Eigen::Index>(point);
        Eigen::Vector3d later = frame.xyz.col(column);
        reached_.segment<3>(equations) = history.position(due.now, column) - later;
        for (int lag = 0; lag < PredictionGrid::kLags; ++lag) {
            const Eigen::Vector3d earlier =
                history.position(frame.lags[static_cast<std::size_t>(lag) + 1], column);
            motions_.block<1, 3>(lag, equations) = (later - earlier).transpose();
            later = earlier;
        }
        equations += 3;
    }
    LagModel& model = models_[due.horizon].learned;
    model.learn(motions_.leftCols(equations), reached_.head(equations));
    model.solve();
}

}  // namespace defrec
