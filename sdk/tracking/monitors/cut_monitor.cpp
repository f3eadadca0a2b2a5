// See cut_monitor.hpp.
#include "sdk/tracking/monitors/cut_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/base/util/median.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"
#include "sdk/tracking/monitors/band.hpp"

namespace defrec {
namespace {

using decisions::Cuts;

class Watcher {
  public:
    Watcher(const TemplateData& data, std::span<const defrec_surface_sample> samples,
            std::span<const uint8_t> is_confirmed)
        : data_(data),
          samples_(samples),
          is_confirmed_(is_confirmed),
          spacing_(node_spacing(data)) {}

    bool shows_gap(size_t cell) const {
        const int32_t vertex = data_.grid.vertex[cell];
        if (vertex < 0 || is_confirmed_[static_cast<size_t>(vertex)] != 0) return false;
        const defrec_surface_sample& sample = samples_[static_cast<size_t>(vertex)];
        return sample.observation == DEFREC_INCONSISTENT && sample.residual > 0;
    }

    std::optional<CutLine> cut_of(const Band& gap) const {
        const BandAxis axis = axis_of(gap);
        if (!is_line(gap, axis, spacing_)) return std::nullopt;
        std::vector<Cell> middle = middle_line(gap, axis);
        if (!comes_apart(middle, axis, gap.piece)) return std::nullopt;
        return as_cut(std::move(middle), gap, data_.grid, spacing_, Cuts::kBeyond * spacing_);
    }

  private:
    // The first vertex with photometric evidence that way; -1: there is none.
    int32_t confirmed_vertex(const Cell& from, const Cell& step, uint8_t piece) const {
        for (double steps = 1; steps <= Cuts::kReach * spacing_; ++steps) {
            const int32_t vertex = vertex_at(data_.grid, from + steps * step, piece);
            if (vertex >= 0 && is_confirmed_[static_cast<size_t>(vertex)] != 0) return vertex;
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

    bool comes_apart(const std::vector<Cell>& middle, const BandAxis& axis, uint8_t piece) const {
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
    const size_t cells =
        count_frame(frames_, Cuts::kFrames, [&](size_t i) { return watcher.shows_gap(i); });
    if (static_cast<double>(cells) * grid.spacing < Cuts::kMinLength * data.node_grid.spacing_u)
        return;
    std::vector<uint8_t> open = open_cells(data, frames_, Cuts::kFrames, 1);
    for (size_t i = 0; i < open.size() && !found_; ++i)
        if (open[i] != 0) found_ = watcher.cut_of(take_band(grid, open, i));
}

}  // namespace defrec
