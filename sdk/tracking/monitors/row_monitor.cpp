// See row_monitor.hpp.
#include "sdk/tracking/monitors/row_monitor.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

namespace defrec {
namespace {

using decisions::RigRows;
using decisions::ViewLag;

// Information on offset (px), roll (px per px), ratio of focal lengths less 1 and vergence (rad),
// before anything is known.
Eigen::Vector4d prior_information() {
    return {1 / (RigRows::kPriorOffset * RigRows::kPriorOffset),
            1 / (RigRows::kPriorRoll * RigRows::kPriorRoll),
            1 / (RigRows::kPriorRatio * RigRows::kPriorRatio),
            1 / (RigRows::kPriorVergence * RigRows::kPriorVergence)};
}

constexpr int kLag = 4;  // of RowValues

struct Fit {
    RowInformation information = RowInformation::Zero();  // of the matches alone
    RowValues weighted = RowValues::Zero();
    RowValues values = RowValues::Zero();
    double lag_sigma = 0;
    double matches = 0;  // sum of the robust weights
};

using Prior = RowKnowledge;

// Iteratively reweighted least squares from these values on, with Tukey's kernel as wide in each
// step as widths (px) say. known_lag: the lag, if it is known.
Fit fit_rows(std::span<const RowMatch> matches, const Prior& prior, const RowValues& start,
             std::span<const double> widths, std::optional<double> known_lag) {
    using Pair = Eigen::Array2d;  // of two matches
    constexpr int kValues = 5;
    constexpr RowMatch kNoMatch{0, 0, 1e9, 0};
    const double lag_sign = known_lag ? 0 : -1, lag = known_lag.value_or(0);
    Fit fit;
    fit.values = start;
    for (const double width : widths) {
        Pair sums[kValues][kValues], weighted[kValues], squares = Pair::Zero();
        std::fill_n(*sums, kValues * kValues, Pair::Zero());
        std::fill_n(weighted, kValues, Pair::Zero());
        for (size_t m = 0; m < matches.size(); m += 2) {
            const RowMatch &a = matches[m], &b = m + 1 < matches.size() ? matches[m + 1] : kNoMatch;
            const Pair speed(a.speed, b.speed);
            const Pair row[kValues] = {
                {1, 1}, {a.x, b.x}, {a.y, b.y}, {a.turn, b.turn}, lag_sign * speed};
            const Pair step = Pair(a.step, b.step) + lag * speed;
            const Pair residual = step - fit.values[0] - row[1] * fit.values[1] -
                                  row[2] * fit.values[2] - row[3] * fit.values[3] -
                                  row[4] * fit.values[4];
            const Pair x = residual / width, inside = (1 - x * x).max(0), weight = inside * inside;
            squares += weight * residual * residual;
            for (int i = 0; i < kValues; ++i) {
                const Pair of_row = weight * row[i];
                for (int j = 0; j <= i; ++j) sums[i][j] += of_row * row[j];
                weighted[i] += of_row * step;
            }
        }
        fit.matches = sums[0][0].sum();
        const double noise = fit.matches > 0 ? std::sqrt(squares.sum() / fit.matches) : 0,
                     sigma = std::max(RigRows::kStepSigma, noise),
                     information = 1 / (sigma * sigma);
        for (int i = 0; i < kValues; ++i) {
            for (int j = 0; j <= i; ++j)
                fit.information(i, j) = fit.information(j, i) = information * sums[i][j].sum();
            fit.weighted[i] = information * weighted[i].sum();
        }
        fit.values =
            (prior.information + fit.information).ldlt().solve(prior.weighted + fit.weighted);
    }
    fit.lag_sigma = std::sqrt((prior.information + RigRows::kIndependentShare * fit.information)
                                  .ldlt()
                                  .solve(RowValues::Unit(kLag))[kLag]);
    return fit;
}

// Shares that the values have in a match's step.
RowValues row_of(const RowMatch& match, double speed) {
    RowValues row;
    row << 1, match.x, match.y, match.turn, -speed;
    return row;
}

// Mean row speed of the matches nearest to one of them, without its own.
double speed_around(std::span<const RowMatch> matches, size_t at) {
    struct Neighbour {
        double squared_distance = std::numeric_limits<double>::infinity(), speed = 0;
    };
    std::array<Neighbour, ViewLag::kNeighbours> nearest;  // the farthest last
    for (size_t m = 0; m < matches.size(); ++m) {
        const double x = matches[m].x - matches[at].x, y = matches[m].y - matches[at].y;
        Neighbour next{x * x + y * y, matches[m].speed};
        if (m == at) continue;
        for (Neighbour& other : nearest)
            if (next.squared_distance < other.squared_distance) std::swap(next, other);
    }
    double sum = 0;
    for (const Neighbour& neighbour : nearest) sum += neighbour.speed;
    return sum / double{ViewLag::kNeighbours};
}

// Whether the lag of a fit also shows in what moves around each match. Where a match's row in the
// left view is wrong, its step and its speed are wrong alike, which looks like a lag.
bool shows_around(std::span<const RowMatch> matches, const Prior& prior, const Fit& fit) {
    RowInformation information = RowInformation::Zero();
    RowValues weighted = prior.weighted;
    for (size_t m = 0; m < matches.size(); ++m) {
        const RowMatch& match = matches[m];
        const RowValues around = row_of(match, speed_around(matches, m));
        const double own = row_of(match, match.speed).dot(fit.values),
                     x = (match.step - own) / RigRows::kTukeyWidths.back(),
                     inside = std::max(0.0, 1 - x * x),
                     weight = inside * inside / (RigRows::kStepSigma * RigRows::kStepSigma);
        information += weight * around * around.transpose();
        weighted += weight * match.step * around;
    }
    const double lag = (prior.information + information).ldlt().solve(weighted)[kLag],
                 variance = (prior.information + RigRows::kIndependentShare * information)
                                .ldlt()
                                .solve(RowValues::Unit(kLag))[kLag];
    return std::copysign(lag, lag * fit.values[kLag]) >
           std::max(ViewLag::kMinLag, ViewLag::kSignificanceAround * std::sqrt(variance));
}

}  // namespace

void match_rows(const TemplateData& data, const FrameOutput& output, std::span<const RigPatch> last,
                std::vector<RigPatch>& now, std::vector<RowMatch>& matches) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    constexpr double kOne = 256;  // of an observation, per px
    const size_t step = rig_patch_step(data);
    const defrec_camera& camera = data.camera;
    now.resize(rig_patch_count(data));
    matches.clear();
    matches.reserve(now.size());
    for (size_t i = 0; i < now.size(); ++i) {
        const defrec_patch_observation &left = output.observations[i * step],
                                       &right = output.right_observations[i];
        const bool is_seen = left.valid == 1, is_matched = is_seen && right.valid == 1;
        const double column = left.u / kOne, row = left.v / kOne, of_right = right.u / kOne;
        now[i] = {is_seen ? static_cast<float>(column) : kNone,
                  is_seen ? static_cast<float>(row) : kNone,
                  is_matched ? static_cast<float>(column - of_right) : kNone};
        if (!is_matched) continue;
        const RigPatch before = i < last.size() ? last[i] : RigPatch{kNone, kNone, kNone};
        matches.push_back({.x = column - 0.5 * (data.width - 1),
                           .y = row - 0.5 * (data.height - 1),
                           .step = static_cast<double>(int64_t{right.v} - left.v) / kOne,
                           .speed = std::isnan(before.row) ? 0 : double{now[i].row - before.row},
                           .turn = (of_right - camera.cx - camera.disparity_offset_px) *
                                   (row - camera.cy) / camera.fy,
                           .along = double{now[i].column - before.column},
                           .growth = double{now[i].disparity - before.disparity}});
    }
}

RigEstimate RowMonitor::skip() {
    is_late_ = lasting_.lag() != 0;
    return estimate(lasting_.lag());
}

RigEstimate RowMonitor::update(std::span<const RowMatch> matches) {
    is_late_ = lasting_.lag() != 0;
    if (matches.size() < RigRows::kMinMatches) {
        break_off();
        return estimate(lasting_.lag());
    }
    Prior prior;
    prior.information.topLeftCorner<4, 4>() = information_;
    prior.information.diagonal().head<4>() += prior_information();
    prior.information(kLag, kLag) = 1 / (ViewLag::kLagSigma * ViewLag::kLagSigma);
    prior.weighted.head<4>() = weighted_;
    const RowValues mean = prior.information.ldlt().solve(prior.weighted);
    const Fit with_lag = fit_rows(matches, prior, mean, RigRows::kTukeyWidths, std::nullopt);
    const double lag = with_lag.values[kLag];
    const bool is_late_now =
        std::abs(lag) > std::max(ViewLag::kMinLag, ViewLag::kSignificance * with_lag.lag_sigma) &&
        shows_around(matches, prior, with_lag);
    information_ *= RigRows::kMemory;
    weighted_ *= RigRows::kMemory;
    const bool had_none = lasting_.unseen() == 0;  // or another one, told before
    lasting_.add_frame(matches, {prior.information, prior.weighted}, with_lag.values, is_late_now);
    if (!had_none && lasting_.lag() != 0) take_rows_of_lasting();
    matches_ *= RigRows::kMemory;
    is_late_ = is_late_now || lasting_.lag() != 0;
    if (is_late_now) return estimate(lag);
    const Fit without =
        fit_rows(matches, prior, with_lag.values, RigRows::kNextTukeyWidths, lasting_.lag());
    information_ += RigRows::kIndependentShare * without.information.topLeftCorner<4, 4>();
    weighted_ += RigRows::kIndependentShare * without.weighted.head<4>();
    matches_ += without.matches;
    RowValues values = without.values;
    values[kLag] = lasting_.lag();
    measure_shared_noise(matches, values);
    return estimate(lasting_.lag());
}

// Noise that matches side by side have in common, by cells: twice the products of all pairs in a
// cell are the square of their sum less their squares.
void RowMonitor::measure_shared_noise(std::span<const RowMatch> matches, const RowValues& values) {
    constexpr size_t kAcross = RigRows::kCellsAcross;
    struct Cell {
        double sum = 0, squares = 0, count = 0;
    };
    std::array<Cell, kAcross * kAcross> cells{};
    const double per_px = double{kAcross} / std::max(width_, height_);
    const auto place = [per_px](double from_centre) {
        const double at = from_centre * per_px + double{kAcross} / 2;
        return static_cast<size_t>(std::clamp(at, 0.0, double{kAcross} - 1));
    };
    for (const RowMatch& match : matches) {
        const double residual = match.step - row_of(match, match.speed).dot(values);
        if (std::abs(residual) > RigRows::kNextTukeyWidths.back()) continue;
        Cell& cell = cells[place(match.y) * kAcross + place(match.x)];
        cell.sum += residual;
        cell.squares += residual * residual;
        cell.count += 1;
    }
    products_ *= RigRows::kMemory;
    pairs_ *= RigRows::kMemory;
    for (const Cell& cell : cells) {
        products_ += (cell.sum * cell.sum - cell.squares) / 2;
        pairs_ += cell.count * (cell.count - 1) / 2;
    }
}

// Before the lag was told, rows that it moves were taken for an offset.
void RowMonitor::take_rows_of_lasting() {
    const RowKnowledge& all = lasting_.rows();
    information_ = all.information.topLeftCorner<4, 4>();
    weighted_ = all.weighted.head<4>() - lasting_.lag() * all.information.topRightCorner<4, 1>();
}

double RowMonitor::row_error() const {
    const RigEstimate now = estimate(0);
    if (now.matches < RigRows::kMinRowMatches) return 0;
    const double roll = std::tan(now.roll_deg * std::numbers::pi / 180),
                 along = now.focal_ratio - 1;
    const double squared = double(now.vertical_offset_px) * now.vertical_offset_px +
                           (roll * roll * width_ * width_ + along * along * height_ * height_) / 12;
    return std::sqrt(squared);
}

bool RowMonitor::is_turned(double least) const {
    const RigEstimate now = estimate(0);
    return std::abs(now.vergence) >
           std::max(least, RigRows::kVergenceSignificance * double{now.vergence_sigma});
}

RigEstimate RowMonitor::estimate(double lag) const {
    RigEstimate estimate;
    estimate.lag_frames = static_cast<float>(lag);
    estimate.unseen_lag_frames = static_cast<float>(lag == 0 ? lasting_.unseen() : 0);
    estimate.lag_px = static_cast<float>(lasting_.lag() * lasting_.speed());
    if (matches_ < 1) return estimate;
    estimate.shared_noise_px2 =
        static_cast<float>(std::max(0.0, products_) / (pairs_ + RigRows::kPriorPairs));
    Eigen::Matrix4d information = information_;
    information.diagonal() += prior_information();
    const Eigen::LDLT<Eigen::Matrix4d> factor(information);
    const Values mean = factor.solve(weighted_);
    estimate.vertical_offset_px = static_cast<float>(mean[0]);
    estimate.roll_deg = static_cast<float>(std::atan(mean[1]) * 180 / std::numbers::pi);
    estimate.focal_ratio = static_cast<float>(1 + mean[2]);
    estimate.vergence = static_cast<float>(mean[3]);
    estimate.vergence_sigma = static_cast<float>(std::sqrt(factor.solve(Values::Unit(3))[3]));
    estimate.matches = static_cast<uint32_t>(matches_);
    return estimate;
}

}  // namespace defrec
