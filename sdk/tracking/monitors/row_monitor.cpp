// See row_monitor.hpp.
#include "sdk/tracking/monitors/row_monitor.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace defrec {
namespace {

using decisions::RigRows;
using decisions::ViewLag;

// Information on offset (px), roll (px per px) and ratio of focal lengths less 1, before anything
// is known.
Eigen::Vector3d prior_information() {
    return {1 / (RigRows::kPriorOffset * RigRows::kPriorOffset),
            1 / (RigRows::kPriorRoll * RigRows::kPriorRoll),
            1 / (RigRows::kPriorRatio * RigRows::kPriorRatio)};
}

struct Fit {
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();  // of the matches alone
    Eigen::Vector4d weighted = Eigen::Vector4d::Zero();
    Eigen::Vector4d values = Eigen::Vector4d::Zero();  // offset, along x, along y, lag
    double lag_sigma = 0;
    double matches = 0;  // sum of the robust weights
};

// Information and information times mean.
struct Prior {
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    Eigen::Vector4d weighted = Eigen::Vector4d::Zero();
};

// Iteratively reweighted least squares from these values on, with Tukey's kernel as wide in each
// step as widths (px) say. with_lag: else the lag is 0.
Fit fit_rows(std::span<const RowMatch> matches, const Prior& prior, const Eigen::Vector4d& start,
             std::span<const double> widths, bool with_lag) {
    using Pair = Eigen::Array2d;  // of two matches
    constexpr RowMatch kNoMatch{0, 0, 1e9, 0};
    const double lag_sign = with_lag ? -1 : 0;
    Fit fit;
    fit.values = start;
    for (const double width : widths) {
        Pair sums[4][4], weighted[4];
        std::fill_n(*sums, 16, Pair::Zero());
        std::fill_n(weighted, 4, Pair::Zero());
        for (size_t m = 0; m < matches.size(); m += 2) {
            const RowMatch &a = matches[m], &b = m + 1 < matches.size() ? matches[m + 1] : kNoMatch;
            const Pair row[4] = {{1, 1}, {a.x, b.x}, {a.y, b.y}, lag_sign * Pair(a.speed, b.speed)};
            const Pair step(a.step, b.step);
            const Pair x = (step - fit.values[0] - row[1] * fit.values[1] - row[2] * fit.values[2] -
                            row[3] * fit.values[3]) /
                           width;
            const Pair inside = (1 - x * x).max(0), weight = inside * inside;
            for (int i = 0; i < 4; ++i) {
                const Pair of_row = weight * row[i];
                for (int j = 0; j <= i; ++j) sums[i][j] += of_row * row[j];
                weighted[i] += of_row * step;
            }
        }
        constexpr double kInformation = 1 / (RigRows::kStepSigma * RigRows::kStepSigma);
        fit.matches = sums[0][0].sum();
        for (int i = 0; i < 4; ++i) {
            for (int j = 0; j <= i; ++j)
                fit.information(i, j) = fit.information(j, i) = kInformation * sums[i][j].sum();
            fit.weighted[i] = kInformation * weighted[i].sum();
        }
        fit.values =
            (prior.information + fit.information).ldlt().solve(prior.weighted + fit.weighted);
    }
    const Eigen::Matrix4d covariance =
        (prior.information + RigRows::kIndependentShare * fit.information)
            .ldlt()
            .solve(Eigen::Matrix4d::Identity());
    fit.lag_sigma = std::sqrt(covariance(3, 3));
    return fit;
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
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    Eigen::Vector4d weighted = prior.weighted;
    for (size_t m = 0; m < matches.size(); ++m) {
        const RowMatch& match = matches[m];
        const Eigen::Vector4d own(1, match.x, match.y, -match.speed),
            around(1, match.x, match.y, -speed_around(matches, m));
        const double x = (match.step - own.dot(fit.values)) / RigRows::kTukeyWidths.back(),
                     inside = std::max(0.0, 1 - x * x),
                     weight = inside * inside / (RigRows::kStepSigma * RigRows::kStepSigma);
        information += weight * around * around.transpose();
        weighted += weight * match.step * around;
    }
    const double lag = (prior.information + information).ldlt().solve(weighted)[3],
                 variance = (prior.information + RigRows::kIndependentShare * information)
                                .ldlt()
                                .solve(Eigen::Vector4d::Unit(3))[3];
    return std::copysign(lag, lag * fit.values[3]) >
           std::max(ViewLag::kMinLag, ViewLag::kSignificanceAround * std::sqrt(variance));
}

}  // namespace

void match_rows(const TemplateData& data, const FrameOutput& output,
                std::span<const float> last_rows, std::vector<float>& rows,
                std::vector<RowMatch>& matches) {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    const size_t step = rig_patch_step(data);
    rows.resize(rig_patch_count(data));
    matches.clear();
    matches.reserve(rows.size());
    for (size_t i = 0; i < rows.size(); ++i) {
        const defrec_patch_observation &left = output.observations[i * step],
                                       &right = output.right_observations[i];
        const float last = i < last_rows.size() ? last_rows[i] : kNone;
        rows[i] = left.valid == 1 ? static_cast<float>(left.v) / 256 : kNone;
        if (left.valid != 1 || right.valid != 1) continue;
        matches.push_back({left.u / 256.0 - 0.5 * (data.width - 1),
                           left.v / 256.0 - 0.5 * (data.height - 1),
                           static_cast<double>(int64_t{right.v} - left.v) / 256,
                           std::isnan(last) ? 0 : rows[i] - last});
    }
}

RigEstimate RowMonitor::update(std::span<const RowMatch> matches) {
    is_late_ = false;
    if (matches.size() < RigRows::kMinMatches) return estimate(0);
    Prior prior;
    prior.information.topLeftCorner<3, 3>() = information_;
    prior.information.diagonal().head<3>() += prior_information();
    prior.information(3, 3) = 1 / (ViewLag::kLagSigma * ViewLag::kLagSigma);
    prior.weighted.head<3>() = weighted_;
    const Eigen::Vector4d mean = prior.information.ldlt().solve(prior.weighted);
    const Fit with_lag = fit_rows(matches, prior, mean, RigRows::kTukeyWidths, true);
    const double lag = with_lag.values[3];
    is_late_ =
        std::abs(lag) > std::max(ViewLag::kMinLag, ViewLag::kSignificance * with_lag.lag_sigma) &&
        shows_around(matches, prior, with_lag);
    information_ *= RigRows::kMemory;
    weighted_ *= RigRows::kMemory;
    distortion_squares_ *= RigRows::kMemory;
    distortion_weighted_ *= RigRows::kMemory;
    matches_ *= RigRows::kMemory;
    if (is_late_) return estimate(lag);
    const Fit without = fit_rows(matches, prior, with_lag.values, RigRows::kNextTukeyWidths, false);
    add_distortion(matches, without.values.head<3>());
    information_ += RigRows::kIndependentShare * without.information.topLeftCorner<3, 3>();
    weighted_ += RigRows::kIndependentShare * without.weighted.head<3>();
    matches_ += without.matches;
    return estimate(0);
}

// The rest that offset, roll and ratio leave, as far as it grows with x y. A kernel as narrow as
// theirs would leave out the corners, which say most of it.
void RowMonitor::add_distortion(std::span<const RowMatch> matches, const Eigen::Vector3d& fit) {
    for (const RowMatch& match : matches) {
        const double left = match.step - fit[0] - match.x * fit[1] - match.y * fit[2],
                     place = 4 * match.x * match.y / (double(width_) * height_);
        if (std::abs(left) > RigRows::kMaxDistortionResidual) continue;
        distortion_squares_ += place * place;
        distortion_weighted_ += place * left;
    }
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

double RowMonitor::distortion_error() const { return std::abs(estimate(0).distortion_px) / 3; }

RigEstimate RowMonitor::estimate(double lag) const {
    RigEstimate estimate;
    estimate.lag_frames = static_cast<float>(lag);
    if (matches_ < 1) return estimate;
    Eigen::Matrix3d information = information_;
    information.diagonal() += prior_information();
    const Eigen::Vector3d mean = information.ldlt().solve(weighted_);
    estimate.vertical_offset_px = static_cast<float>(mean[0]);
    estimate.roll_deg = static_cast<float>(std::atan(mean[1]) * 180 / std::numbers::pi);
    estimate.focal_ratio = static_cast<float>(1 + mean[2]);
    estimate.matches = static_cast<uint32_t>(matches_);
    if (matches_ >= RigRows::kMinDistortionMatches && distortion_squares_ > 0)
        estimate.distortion_px = static_cast<float>(distortion_weighted_ / distortion_squares_);
    return estimate;
}

}  // namespace defrec
