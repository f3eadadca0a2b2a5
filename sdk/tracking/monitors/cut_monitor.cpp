// See cut_monitor.hpp.
#include "sdk/tracking/monitors/cut_monitor.hpp"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/base/util/median.hpp"
#include "sdk/template/cut.hpp"
#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {
namespace {

using decisions::Cuts;

using Cell = Eigen::Vector2d;  // column and row of the grid

struct Gap {
    uint8_t piece = 0;
    std::vector<Cell> cells;
};

// The gap's main direction, and its cells' extent along it.
struct Axis {
    Cell centre, along, across;
    double begin, end;
};

Axis axis_of(const Gap& gap) {
    Axis axis{Cell::Zero(), Cell::Zero(), Cell::Zero(), 0, 0};
    for (const Cell& cell : gap.cells) axis.centre += cell;
    axis.centre /= static_cast<double>(gap.cells.size());
    Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
    for (const Cell& cell : gap.cells)
        moments += (cell - axis.centre) * (cell - axis.centre).transpose();
    axis.along = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(moments).eigenvectors().col(1);
    axis.across = {-axis.along.y(), axis.along.x()};
    for (const Cell& cell : gap.cells) {
        const double at = axis.along.dot(cell - axis.centre);
        axis.begin = std::min(axis.begin, at);
        axis.end = std::max(axis.end, at);
    }
    return axis;
}

// Through the middle of the gap, a step of the grid apart along its axis.
std::vector<Cell> middle_line(const Gap& gap, const Axis& axis) {
    const auto slices = static_cast<size_t>(std::lround(axis.end - axis.begin)) + 1;
    std::vector<double> sum(slices, 0), count(slices, 0);
    for (const Cell& cell : gap.cells) {
        const auto at =
            static_cast<int>(std::lround(axis.along.dot(cell - axis.centre) - axis.begin));
        for (int near = at - Cuts::kSmooth; near <= at + Cuts::kSmooth; ++near) {
            if (near < 0 || near >= static_cast<int>(slices)) continue;
            sum[static_cast<size_t>(near)] += axis.across.dot(cell - axis.centre);
            ++count[static_cast<size_t>(near)];
        }
    }
    std::vector<Cell> line;
    for (size_t i = 0; i < slices; ++i)
        if (count[i] > 0)
            line.push_back(axis.centre + (axis.begin + static_cast<double>(i)) * axis.along +
                           sum[i] / count[i] * axis.across);
    return line;
}

class Watcher {
  public:
    Watcher(const TemplateData& data, std::span<const defrec_surface_sample> samples,
            std::span<const uint8_t> is_confirmed)
        : data_(data),
          samples_(samples),
          is_confirmed_(is_confirmed),
          spacing_(data.node_grid.spacing_u / data.grid.spacing) {}

    bool shows_gap(size_t cell) const {
        const int32_t vertex = data_.grid.vertex[cell];
        if (vertex < 0 || is_confirmed_[static_cast<size_t>(vertex)] != 0) return false;
        const defrec_surface_sample& sample = samples_[static_cast<size_t>(vertex)];
        return sample.observation == DEFREC_INCONSISTENT && sample.residual > 0;
    }

    // The cells with a gap that are connected with one of them, which they are removed with.
    Gap take_gap(std::vector<uint8_t>& open, size_t from) const {
        const int columns = data_.grid.columns, rows = data_.grid.rows;
        Gap gap{piece_of(from), {}};
        std::vector<size_t> next{from};
        open[from] = 0;
        while (!next.empty()) {
            const auto x = static_cast<int>(next.back() % static_cast<size_t>(columns)),
                       y = static_cast<int>(next.back() / static_cast<size_t>(columns));
            next.pop_back();
            gap.cells.emplace_back(x, y);
            for (int row = std::max(0, y - 1); row <= std::min(rows - 1, y + 1); ++row)
                for (int column = std::max(0, x - 1); column <= std::min(columns - 1, x + 1);
                     ++column) {
                    const auto cell = static_cast<size_t>(row * columns + column);
                    if (open[cell] == 0 || piece_of(cell) != gap.piece) continue;
                    open[cell] = 0;
                    next.push_back(cell);
                }
        }
        return gap;
    }

    std::optional<CutLine> cut_of(const Gap& gap) const {
        const Axis axis = axis_of(gap);
        const double length = axis.end - axis.begin + 1;
        if (length < Cuts::kMinLength * spacing_ ||
            length * length < Cuts::kMinSlimness * static_cast<double>(gap.cells.size()))
            return std::nullopt;
        const std::vector<Cell> middle = middle_line(gap, axis);
        if (!comes_apart(middle, axis, gap.piece)) return std::nullopt;
        return as_cut(middle, gap.piece);
    }

  private:
    uint8_t piece_of(size_t cell) const {
        return data_.grid.piece.empty() ? uint8_t{0} : data_.grid.piece[cell];
    }

    // The first vertex with photometric evidence that way; -1: there is none.
    int32_t confirmed_vertex(const Cell& from, const Cell& step, uint8_t piece) const {
        for (double steps = 1; steps <= Cuts::kReach * spacing_; ++steps) {
            const auto x = static_cast<int>(std::lround(from.x() + steps * step.x())),
                       y = static_cast<int>(std::lround(from.y() + steps * step.y()));
            if (x < 0 || y < 0 || x >= data_.grid.columns || y >= data_.grid.rows) return -1;
            const auto cell = static_cast<size_t>(y * data_.grid.columns + x);
            const int32_t vertex = data_.grid.vertex[cell];
            if (vertex >= 0 && piece_of(cell) == piece &&
                is_confirmed_[static_cast<size_t>(vertex)] != 0)
                return vertex;
        }
        return -1;
    }

    // How much farther apart two vertices lie than at rest.
    double stretch(int32_t a, int32_t b) const {
        double now = 0, rest = 0;
        for (size_t axis = 0; axis < 3; ++axis) {
            const auto i = static_cast<size_t>(a), j = static_cast<size_t>(b);
            now += std::pow(samples_[i].position[axis] - samples_[j].position[axis], 2);
            rest +=
                std::pow(data_.vertices[i].position[axis] - data_.vertices[j].position[axis], 2);
        }
        return rest > 0 ? std::sqrt(now / rest) : 1;
    }

    bool comes_apart(const std::vector<Cell>& middle, const Axis& axis, uint8_t piece) const {
        std::vector<double> across, along;
        int32_t last[2] = {-1, -1};
        const auto step = static_cast<size_t>(std::max(1.0, spacing_));
        for (size_t i = 0; i < middle.size(); i += step) {
            const int32_t sides[2] = {confirmed_vertex(middle[i], axis.across, piece),
                                      confirmed_vertex(middle[i], -axis.across, piece)};
            if (sides[0] >= 0 && sides[1] >= 0) across.push_back(stretch(sides[0], sides[1]));
            for (size_t k = 0; k < 2; ++k) {
                if (sides[k] >= 0 && last[k] >= 0) along.push_back(stretch(sides[k], last[k]));
                last[k] = sides[k];
            }
        }
        return 2 * step * across.size() >= middle.size() && !along.empty() &&
               median(std::move(across)) > Cuts::kMinOpening * median(std::move(along));
    }

    CutLine as_cut(std::vector<Cell> middle, uint8_t piece) const {
        const Cell first = middle.front(), last = middle.back();
        const size_t beside = std::min(middle.size() - 1, static_cast<size_t>(spacing_) + 1);
        const double beyond = Cuts::kBeyond * spacing_;
        middle.insert(middle.begin(), first + beyond * (first - middle[beside]).normalized());
        middle.push_back(last + beyond * (last - middle[middle.size() - 1 - beside]).normalized());
        CutLine line{piece, {}};
        const auto add = [&](const Cell& cell) {
            line.pixels.push_back({static_cast<float>(cell.x() * data_.grid.spacing),
                                   static_cast<float>(cell.y() * data_.grid.spacing)});
        };
        for (size_t i = 0; i + 1 < middle.size(); i += 2) add(middle[i]);
        add(middle.back());
        return line;
    }

    const TemplateData& data_;
    const std::span<const defrec_surface_sample> samples_;
    const std::span<const uint8_t> is_confirmed_;
    const double spacing_;  // of control points, cells of the grid
};

}  // namespace

void CutMonitor::add_frame(const TemplateData& data, std::span<const defrec_surface_sample> samples,
                           std::span<const uint8_t> is_confirmed) {
    if (found_) return;
    const SurfaceGrid& grid = data.grid;
    const Watcher watcher(data, samples, is_confirmed);
    frames_.resize(grid.vertex.size(), 0);
    size_t cells = 0;
    for (size_t i = 0; i < frames_.size(); ++i) {
        if (watcher.shows_gap(i))
            frames_[i] = static_cast<uint8_t>(std::min<int>(frames_[i] + 1, Cuts::kFrames));
        else if (frames_[i] > 0)
            --frames_[i];
        cells += frames_[i] == Cuts::kFrames ? 1 : 0;
    }
    if (static_cast<double>(cells) * grid.spacing < Cuts::kMinLength * data.node_grid.spacing_u)
        return;
    // Beside a line that was released some tissue counts to the wrong side.
    std::vector<uint8_t> open(frames_.size(), 0);
    for (size_t i = 0; i < frames_.size(); ++i) {
        const size_t columns = static_cast<size_t>(grid.columns), column = i % columns,
                     row = i / columns;
        const ViewPixel at{static_cast<double>(column) * grid.spacing,
                           static_cast<double>(row) * grid.spacing};
        open[i] = frames_[i] == Cuts::kFrames &&
                  distance_to_cut(data.node_grid.cuts, grid.piece.empty() ? 0 : grid.piece[i], at) >
                      data.node_grid.spacing_u;
    }
    for (size_t i = 0; i < open.size() && !found_; ++i)
        if (open[i] != 0) found_ = watcher.cut_of(watcher.take_gap(open, i));
}

}  // namespace defrec
