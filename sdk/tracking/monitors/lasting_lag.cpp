// See lasting_lag.hpp.
#include "sdk/tracking/monitors/lasting_lag.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace defrec {
namespace {

using Decision = decisions::LastingLag;
using decisions::RigRows;
using Estimate = LastingLag::Estimate;

constexpr int kLag = 4;  // of RowValues

// A value of the matches: in the image's middle, and its growth along x and y.
using Plane = Eigen::Vector3d;

// Robust plane through a value of the matches; none where too few have it.
template <size_t kSteps>
std::optional<Plane> fit_plane(std::span<const RowMatch> matches, double RowMatch::*value,
                               const std::array<double, kSteps>& widths) {
    double sum = 0, count = 0;
    for (const RowMatch& match : matches) {
        if (std::isnan(match.along) || std::isnan(match.*value)) continue;
        sum += match.*value;
        ++count;
    }
    if (count < Decision::kMinMatches) return std::nullopt;
    Plane plane(sum / count, 0, 0);
    for (const double width : widths) {
        Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
        Eigen::Vector3d products = Eigen::Vector3d::Zero();
        for (const RowMatch& match : matches) {
            if (std::isnan(match.along)) continue;
            const Eigen::Vector3d place(1, match.x, match.y);
            const double x = (match.*value - place.dot(plane)) / width;
            if (!(std::abs(x) < 1)) continue;
            const double inside = 1 - x * x, weight = inside * inside;
            squares += weight * place * place.transpose();
            products += weight * (match.*value) * place;
        }
        if (squares(0, 0) < Decision::kMinMatches / 2) return std::nullopt;
        plane = squares.ldlt().solve(products);
    }
    return plane;
}

bool is_significant(const Estimate& estimate, double least, double significance) {
    return std::abs(estimate.lag) > std::max(least, significance * estimate.sigma);
}

// The lag by two sources of knowledge.
Estimate lag_of(const RowKnowledge& a, const RowKnowledge& b) {
    const Eigen::LDLT<RowInformation> factor(a.information + b.information);
    return {factor.solve(a.weighted + b.weighted)[kLag],
            std::sqrt(factor.solve(RowValues::Unit(kLag))[kLag])};
}

RowKnowledge prior() {
    RowValues sigma(RigRows::kPriorOffset, RigRows::kPriorRoll, RigRows::kPriorRatio,
                    RigRows::kPriorVergence, decisions::ViewLag::kLagSigma);
    return {sigma.cwiseAbs2().cwiseInverse().asDiagonal(), RowValues::Zero()};
}

}  // namespace

struct LastingLag::Motion {
    Plane along, down;
    std::optional<double> growth;
};

std::optional<LastingLag::Motion> LastingLag::motion_of(std::span<const RowMatch> matches) {
    const auto along = fit_plane(matches, &RowMatch::along, Decision::kMotionWidths);
    if (!along) return std::nullopt;
    const auto down = fit_plane(matches, &RowMatch::speed, Decision::kMotionWidths);
    if (!down) return std::nullopt;
    const auto growth = fit_plane(matches, &RowMatch::growth, Decision::kGrowthWidths);
    return Motion{*along, *down, growth ? std::optional((*growth)[0]) : std::nullopt};
}

void LastingLag::add_frame(std::span<const RowMatch> matches, const RowKnowledge& known,
                           const RowValues& start, bool is_late) {
    const std::optional<Motion> motion = motion_of(matches);
    if (!motion) return break_off();
    const RowKnowledge of_frame = rows_of(matches, *motion, known, start);
    const Estimate now = is_late ? Estimate{start[kLag], 0} : lag_of(known, of_frame);
    restart_where_other(now, now.sigma <= Decision::kSeenByRows);
    rows_.information = RigRows::kMemory * rows_.information + of_frame.information;
    rows_.weighted = RigRows::kMemory * rows_.weighted + of_frame.weighted;
    add_course(*motion);
    judge();
}

// The matches' own row speeds err as their steps do, which looks like a lag; the plane through all
// of them hardly errs.
RowKnowledge LastingLag::rows_of(std::span<const RowMatch> matches, const Motion& motion,
                                 const RowKnowledge& known, RowValues values) {
    constexpr double kInformation =
        RigRows::kIndependentShare / (RigRows::kStepSigma * RigRows::kStepSigma);
    RowKnowledge of_frame;
    for (const double width : RigRows::kNextTukeyWidths) {
        of_frame = {};
        for (const RowMatch& match : matches) {
            if (std::isnan(match.along)) continue;
            const double speed = motion.down.dot(Plane(1, match.x, match.y));
            RowValues row;
            row << 1, match.x, match.y, match.turn, -speed;
            const double x = (match.step - row.dot(values)) / width;
            if (!(std::abs(x) < 1)) continue;
            const double inside = 1 - x * x;
            const RowValues of_row = kInformation * inside * inside * row;
            of_frame.information += of_row * row.transpose();
            of_frame.weighted += match.step * of_row;
        }
        values = (known.information + of_frame.information)
                     .ldlt()
                     .solve(known.weighted + of_frame.weighted);
    }
    return of_frame;
}

// A lag that has begun or ended is measured anew.
void LastingLag::restart_where_other(const Estimate& now, bool is_sure) {
    const bool is_other = is_sure && is_significant({now.lag - lag_, now.sigma}, Decision::kChange,
                                                    decisions::ViewLag::kSignificance);
    if (is_other && !was_other_) {
        rows_ = {};
        break_off();
        lag_ = 0;
    }
    was_other_ = is_other;
}

void LastingLag::add_course(const Motion& motion) {
    if (!motion.growth) return break_off();
    Course now;
    if (frames_ > 0) now = course_[(frames_ - 1) % Decision::kWindow];
    now.disparity += *motion.growth;
    now.along += motion.along[0];
    now.down += motion.down[0];
    now.scale += 100 * (motion.along[1] + motion.down[2]) / 2;
    now.speed = motion.along[0];
    course_[frames_ % Decision::kWindow] = now;
    ++frames_;
}

Estimate LastingLag::by_rows() const { return lag_of(rows_, prior()); }

// Depth depends on where the tissue is, and a lag on how fast it moves: least squares of disparity
// on place, scale and speed. Neighbouring residuals that are alike are worth less.
Estimate LastingLag::by_depth() const {
    const size_t count = std::min(frames_, Decision::kWindow);
    if (count < Decision::kMinFrames) return {};
    using Row = Eigen::Matrix<double, 5, 1>;  // 1, along, down, scale, speed
    const auto at = [&](size_t i) -> const Course& {
        return course_[(frames_ - count + i) % Decision::kWindow];
    };
    const auto row_of = [](const Course& course) {
        return Row(1, course.along, course.down, course.scale, course.speed);
    };
    Eigen::Matrix<double, 5, 5> squares = decltype(squares)::Zero();
    Row products = Row::Zero();
    for (size_t i = 0; i < count; ++i) {
        const Row row = row_of(at(i));
        squares += row * row.transpose();
        products += at(i).disparity * row;
    }
    const Row sigma(Decision::kPriorDisparity, Decision::kPriorByPlace, Decision::kPriorByPlace,
                    Decision::kPriorByScale, decisions::ViewLag::kLagSigma);
    const Eigen::Matrix<double, 5, 5> prior = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
    double noise = Decision::kLeastNoise, worth = 1;
    for (int step = 0; step < Decision::kNoiseSteps; ++step) {
        const double information = worth / (noise * noise);
        const Row values = (prior + information * squares).ldlt().solve(information * products);
        double of_squares = 0, of_neighbours = 0, last = 0;
        for (size_t i = 0; i < count; ++i) {
            const double left = at(i).disparity - row_of(at(i)).dot(values);
            of_squares += left * left;
            of_neighbours += left * last;
            last = left;
        }
        noise =
            std::max(Decision::kLeastNoise, std::sqrt(of_squares / static_cast<double>(count - 5)));
        const double alike =
            of_squares > 0 ? std::clamp(of_neighbours / of_squares, 0.0, Decision::kMostAlike) : 0;
        worth = (1 - alike) / (1 + alike);
    }
    const double information = worth / (noise * noise);
    const Eigen::LDLT<Eigen::Matrix<double, 5, 5>> factor(prior + information * squares);
    return {factor.solve(information * products)[4], std::sqrt(factor.solve(Row::Unit(4))[4])};
}

// Rows go before depth, which tissue that deforms may change as a lag does. Where neither says
// anything the view is as late as before.
void LastingLag::judge() {
    const Estimate rows = by_rows();
    const bool shows_in_rows =
        is_significant(rows, decisions::ViewLag::kMinLag, decisions::ViewLag::kSignificance);
    if (shows_in_rows || rows.sigma <= Decision::kSeenByRows) {
        lag_ = shows_in_rows ? rows.lag : 0;
        is_seen_ = true;
        return;
    }
    const Estimate depth = by_depth();
    if (depth.sigma > Decision::kSeenByDepth) return;
    lag_ = is_significant(depth, Decision::kMinByDepth, Decision::kSignificanceByDepth) ? depth.lag
                                                                                        : 0;
    is_seen_ = true;
}

}  // namespace defrec
