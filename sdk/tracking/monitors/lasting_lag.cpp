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

// One value of each match that was followed from the frame before, in single precision, of
// which the compiler makes vectors.
constexpr Eigen::Index kMostMatches = 400;
using Column = Eigen::Array<float, Eigen::Dynamic, 1, 0, kMostMatches, 1>;

Column column_of(std::span<const RowMatch> matches, double RowMatch::*value,
                 double RowMatch::*known) {
    Column column(kMostMatches);
    Eigen::Index count = 0;
    for (const RowMatch& match : matches) {
        if (std::isnan(match.along) || std::isnan(match.*known)) continue;
        column[count++] = static_cast<float>(match.*value);
        if (count == kMostMatches) break;
    }
    column.conservativeResize(count);
    return column;
}

// Tukey's weights of residuals.
void weigh(const Column& residual, double width, Column& weight) {
    const float scale = 1 / static_cast<float>(width);
    weight = (1 - (scale * residual).square()).max(0).square();
}

// Robust plane through a value of the matches; none where too few have it.
template <size_t kSteps>
std::optional<Plane> fit_plane(std::span<const RowMatch> matches, double RowMatch::*value,
                               const std::array<double, kSteps>& widths) {
    const Column x = column_of(matches, &RowMatch::x, value),
                 y = column_of(matches, &RowMatch::y, value), z = column_of(matches, value, value);
    if (static_cast<double>(z.size()) < Decision::kMinMatches) return std::nullopt;
    Eigen::Vector3f plane(z.mean(), 0, 0);
    Column weight, by_x, by_y;
    for (const double width : widths) {
        weigh(z - plane[0] - plane[1] * x - plane[2] * y, width, weight);
        by_x = weight * x;
        by_y = weight * y;
        const float sum = weight.sum(), sum_x = by_x.sum(), sum_y = by_y.sum(),
                    sum_xy = (by_x * y).sum();
        if (sum < Decision::kMinMatches / 2) return std::nullopt;
        Eigen::Matrix3f squares;
        squares << sum, sum_x, sum_y, sum_x, (by_x * x).sum(), sum_xy, sum_y, sum_xy,
            (by_y * y).sum();
        const Eigen::Vector3f products((weight * z).sum(), (by_x * z).sum(), (by_y * z).sum());
        plane = squares.cast<double>().ldlt().solve(products.cast<double>()).cast<float>();
    }
    return plane.cast<double>();
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

// Root mean square of the lag as an estimate leaves it, whose prior was wider than what is
// plausible.
double plausible_lag(const Estimate& estimate) {
    constexpr double kWide = 1 / (decisions::ViewLag::kLagSigma * decisions::ViewLag::kLagSigma),
                     kPlausible = 1 / (Decision::kUnseen * Decision::kUnseen);
    const double shown = 1 / (estimate.sigma * estimate.sigma),
                 information = std::max(0.0, shown - kWide) + kPlausible,
                 mean = shown * estimate.lag / information;
    return std::sqrt(mean * mean + 1 / information);
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
    const Column step = column_of(matches, &RowMatch::step, &RowMatch::step);
    std::array<Column, 5> columns{Column::Ones(step.size()),
                                  column_of(matches, &RowMatch::x, &RowMatch::x),
                                  column_of(matches, &RowMatch::y, &RowMatch::y),
                                  column_of(matches, &RowMatch::turn, &RowMatch::turn), Column()};
    const Eigen::Vector3f down = motion.down.cast<float>();
    columns[kLag] = -down[0] - down[1] * columns[1] - down[2] * columns[2];
    RowKnowledge of_frame;
    Column weight, of_row;
    for (const double width : RigRows::kNextTukeyWidths) {
        of_row = step;
        for (size_t i = 0; i < columns.size(); ++i)
            of_row -= static_cast<float>(values[static_cast<Eigen::Index>(i)]) * columns[i];
        weigh(of_row, width, weight);
        for (Eigen::Index i = 0; i < values.size(); ++i) {
            of_row = weight * columns[static_cast<size_t>(i)];
            for (Eigen::Index j = 0; j <= i; ++j)
                of_frame.information(i, j) = of_frame.information(j, i) =
                    kInformation * double{(of_row * columns[static_cast<size_t>(j)]).sum()};
            of_frame.weighted[i] = kInformation * double{(of_row * step).sum()};
        }
        values = (known.information + of_frame.information)
                     .ldlt()
                     .solve(known.weighted + of_frame.weighted);
    }
    return of_frame;
}

// A lag that has begun or ended is measured anew.
void LastingLag::restart_where_other(const Estimate& now, bool is_sure) {
    if (!is_sure || !is_significant({now.lag - begun_, now.sigma}, Decision::kChange,
                                    decisions::ViewLag::kSignificance))
        return;
    rows_ = {};
    break_off();
    lag_ = 0;
    begun_ = now.lag;
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
        return decide(shows_in_rows ? rows.lag : 0);
    }
    unseen_ = plausible_lag(rows);
    const Estimate depth = by_depth();
    if (depth.sigma > Decision::kSeenByDepth) return;
    decide(is_significant(depth, Decision::kMinByDepth, Decision::kSignificanceByDepth) ? depth.lag
                                                                                        : 0);
}

void LastingLag::decide(double lag) {
    lag_ = begun_ = lag;
    is_seen_ = true;
}

}  // namespace defrec
