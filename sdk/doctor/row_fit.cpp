// See row_fit.hpp.
#include "sdk/doctor/row_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "sdk/doctor/decisions.hpp"
#include "sdk/io/statistics.hpp"

namespace defrec::cli {
namespace {

// By pair of images; pairs with few matches are left out.
std::map<int, double> medians(const std::vector<RectifiedMatch>& matches, auto&& value_of) {
    std::map<int, std::vector<double>> values;
    for (const RectifiedMatch& match : matches) values[match.pair].push_back(value_of(match));
    std::map<int, double> found;
    for (const auto& [pair, of_pair] : values)
        if (of_pair.size() >= decisions::DoctorPairings::kMinMatches)
            found[pair] = nearest_rank(of_pair, 0.5);
    return found;
}

}  // namespace

RowFit fit_rows(const std::vector<RectifiedMatch>& matches) {
    RowFit fit;
    for (const double width : decisions::DoctorViews::kTukeyWidths) {
        Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
        Eigen::Vector3d right = Eigen::Vector3d::Zero();
        for (const RectifiedMatch& match : matches) {
            const Eigen::Vector3d row(1, match.x, match.y);
            const double residual = (match.row_step - fit.at(match)) / width;
            if (std::abs(residual) >= 1) continue;
            const double root = 1 - residual * residual;
            normal += root * root * row * row.transpose();
            right += root * root * match.row_step * row;
        }
        const Eigen::Vector3d solved = normal.ldlt().solve(right);
        fit = {solved[0], solved[1], solved[2]};
    }
    return fit;
}

std::map<int, double> misfits_of_pairs(const std::vector<RectifiedMatch>& matches,
                                       const RowFit& fit) {
    return medians(matches, [&](const RectifiedMatch& match) {
        return std::abs(match.row_step - fit.at(match));
    });
}

std::pair<double, double> range_of_steps(const std::vector<RectifiedMatch>& matches) {
    const auto steps = medians(matches, [](const RectifiedMatch& match) { return match.row_step; });
    if (steps.empty()) return {0, 0};
    const auto [least, most] =
        std::minmax_element(steps.begin(), steps.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; });
    return {least->second, most->second};
}

}  // namespace defrec::cli
