// See side_levels.hpp.
#include "sdk/tracking/monitors/side_levels.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "sdk/tracking/decisions/template_changes.hpp"

namespace defrec {
namespace {

using decisions::Lifted;

// Keeps the plane level where cells lie along a line.
constexpr double kSlopeDamping = 1e-3;

}  // namespace

SideLevels::SideLevels(const SurfaceGrid& grid, std::span<const uint8_t> is_inside,
                       std::span<const float> moved)
    : grid_(grid), is_inside_(is_inside), moved_(moved), is_beside_(is_inside.size(), 0) {
    constexpr int kBlurred = Lifted::kBlurred;
    const auto at = [&](int x, int y) { return static_cast<size_t>(y * grid_.columns + x); };
    const auto mark = [&](int x, int y) {
        for (int v = std::max(0, y - kBlurred + 1); v < std::min(grid_.rows, y + kBlurred); ++v)
            for (int u = std::max(0, x - kBlurred + 1); u < std::min(grid_.columns, x + kBlurred);
                 ++u)
                is_beside_[at(u, v)] = 1;
    };
    for (int y = 0; y < grid_.rows; ++y)
        for (int x = 0; x < grid_.columns; ++x)
            for (const auto& [u, v] : {std::pair(x + 1, y), std::pair(x, y + 1)})
                if (u < grid_.columns && v < grid_.rows &&
                    is_inside_[at(x, y)] != is_inside_[at(u, v)]) {
                    mark(x, y);
                    mark(u, v);
                }
}

std::optional<double> SideLevels::step_at(const Cell& place, uint8_t piece, double reach) const {
    const std::optional<double> inner = level_at(place, true, piece, reach);
    if (!inner) return std::nullopt;
    const std::optional<double> outer = level_at(place, false, piece, reach);
    if (!outer) return std::nullopt;
    return *inner - *outer;
}

// Where the plane through what is seen on one side has the place.
std::optional<double> SideLevels::level_at(const Cell& place, bool inside, uint8_t piece,
                                           double reach) const {
    const auto first = [&](double at) {
        return std::max(0, static_cast<int>(std::ceil(at - reach)));
    };
    const auto last = [&](double at, int count) {
        return std::min(count - 1, static_cast<int>(std::floor(at + reach)));
    };
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    int seen = 0;
    for (int y = first(place.y()); y <= last(place.y(), grid_.rows); ++y)
        for (int x = first(place.x()); x <= last(place.x(), grid_.columns); ++x) {
            const auto cell = static_cast<size_t>(y * grid_.columns + x);
            if ((is_inside_[cell] != 0) != inside || is_beside_[cell] != 0 ||
                std::isnan(moved_[cell]) || (!grid_.piece.empty() && grid_.piece[cell] != piece))
                continue;
            const Cell from = Cell(x, y) - place;
            if (from.squaredNorm() > reach * reach) continue;
            const Eigen::Vector3d terms(1, from.x(), from.y());
            normal += terms * terms.transpose();
            right += double{moved_[cell]} * terms;
            ++seen;
        }
    if (seen < Lifted::kMinBeside) return std::nullopt;
    normal.diagonal().tail<2>().array() += kSlopeDamping;
    return normal.ldlt().solve(right)(0);
}

}  // namespace defrec
