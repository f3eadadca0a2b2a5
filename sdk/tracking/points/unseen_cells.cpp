// See unseen_cells.hpp.
#include "sdk/tracking/points/unseen_cells.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sdk/body/body_piece.hpp"

namespace defrec {
namespace {

using Cells = decisions::UnseenCells;

std::vector<uint32_t> vertices_of(const Template& surface, size_t piece) {
    std::vector<uint32_t> vertices;
    for (size_t i = 0; i < surface.data().vertices.size(); ++i)
        if (surface.vertex_pieces()[i] == piece) vertices.push_back(static_cast<uint32_t>(i));
    return vertices;
}

double view_width(const TemplateData& data, std::span<const uint32_t> vertices) {
    std::vector<float> depths;
    for (const uint32_t vertex : vertices) depths.push_back(data.vertices[vertex].position[2]);
    if (depths.empty()) return 1;
    const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
    std::nth_element(depths.begin(), middle, depths.end());
    return std::max(1e-3, data.width * std::abs(static_cast<double>(*middle)) / data.camera.fx);
}

int32_t nearest(const std::vector<Eigen::Vector3d>& centres, const Eigen::Vector3d& place,
                double& squared) {
    int32_t best = -1;
    squared = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < centres.size(); ++i) {
        const double distance = (centres[i] - place).squaredNorm();
        if (distance >= squared) continue;
        squared = distance;
        best = static_cast<int32_t>(i);
    }
    return best;
}

}  // namespace

UnseenCells::UnseenCells(const Template& surface, size_t piece) {
    const TemplateData& data = surface.data();
    const std::vector<uint32_t> vertices = vertices_of(surface, piece);
    view_width_mm_ = view_width(data, vertices);
    apart_mm_ = Cells::kApart * Cells::kCellShare * view_width_mm_;
    const Centres centres = spread_centres(data, vertices);
    cell_of_.assign(data.vertices.size(), -1);
    std::vector<uint32_t> counts = assign(data, vertices, centres);
    const double fullest = counts.empty() ? 0 : *std::max_element(counts.begin(), counts.end());
    Centres full;
    for (size_t i = 0; i < centres.size(); ++i)
        if (counts[i] >= Cells::kMinFullness * fullest) full.push_back(centres[i]);
    counts = assign(data, vertices, full);

    const auto count = static_cast<Eigen::Index>(full.size());
    rest_.setZero(3, count);
    for (const uint32_t vertex : vertices)
        rest_.col(cell_of_[vertex]) += position_of(data.vertices[vertex]);
    for (Eigen::Index i = 0; i < count; ++i)
        rest_.col(i) /= std::max<double>(1, counts[static_cast<size_t>(i)]);
    age_.assign(full.size(), 0);
    choose_samples(data, vertices);
    sum_rest_.resize(3, count);
    sum_now_.resize(3, count);
    sum_error_mm2_.resize(count);
}

UnseenCells::Centres UnseenCells::spread_centres(const TemplateData& data,
                                                 std::span<const uint32_t> vertices) {
    Centres centres;
    double squared = 0;
    for (;; apart_mm_ *= Cells::kCellGrowth) {
        centres.clear();
        for (const uint32_t vertex : vertices) {
            const Eigen::Vector3d place = position_of(data.vertices[vertex]);
            nearest(centres, place, squared);
            if (squared >= apart_mm_ * apart_mm_) centres.push_back(place);
            if (centres.size() > Cells::kMaxCells) break;
        }
        if (centres.size() <= Cells::kMaxCells) return centres;
    }
}

std::vector<uint32_t> UnseenCells::assign(const TemplateData& data,
                                          std::span<const uint32_t> vertices,
                                          const Centres& centres) {
    std::vector<uint32_t> counts(centres.size(), 0);
    double squared = 0;
    for (const uint32_t vertex : vertices) {
        cell_of_[vertex] = nearest(centres, position_of(data.vertices[vertex]), squared);
        ++counts[cell_of(vertex)];
    }
    return counts;
}

void UnseenCells::choose_samples(const TemplateData& data, std::span<const uint32_t> vertices) {
    std::vector<std::vector<uint32_t>> of_cell(size());
    for (const uint32_t vertex : vertices) of_cell[cell_of(vertex)].push_back(vertex);
    size_t most = 0;
    for (size_t cell = 0; cell < of_cell.size(); ++cell) {
        const std::vector<uint32_t>& all = of_cell[cell];
        const size_t used = std::min(all.size(), Cells::kSamples);
        most = std::max(most, used);
        for (size_t k = 0; k < used; ++k) {
            const uint32_t vertex = all[k * all.size() / used];
            samples_.push_back({vertex, static_cast<int32_t>(cell),
                                position_of(data.vertices[vertex]).cast<float>()});
        }
    }
    least_seen_ = static_cast<uint32_t>(
        std::max(Cells::kMinSeen, Cells::kSeenShare * static_cast<double>(most)));
}

void UnseenCells::take_ages(const UnseenCells& before) {
    for (size_t i = 0; i < size(); ++i) {
        Eigen::Index nearest = 0;
        (before.rest_.colwise() - rest_.col(static_cast<Eigen::Index>(i)))
            .colwise()
            .squaredNorm()
            .minCoeff(&nearest);
        age_[i] = before.age(nearest);
    }
}

void UnseenCells::add_lost_frame() {
    for (uint32_t& age : age_) ++age;
}

bool UnseenCells::read(SurfaceSamples samples, const VertexConfidence& confidence) {
    count_.assign(size(), 0);
    sum_rest_.setZero();
    sum_now_.setZero();
    sum_error_mm2_.setZero();
    for (const Sample& sample : samples_) {
        if (confidence.status[sample.vertex] != DEFREC_POINT_OBSERVED) continue;
        const auto error = static_cast<double>(confidence.expected_error[sample.vertex]);
        ++count_[static_cast<size_t>(sample.cell)];
        sum_rest_.col(sample.cell) += sample.rest.cast<double>();
        sum_now_.col(sample.cell) +=
            Eigen::Map<const Eigen::Vector3f>(samples[sample.vertex].position).cast<double>();
        sum_error_mm2_[sample.cell] += error * error;
    }
    const auto with_at_least = [&](uint32_t least) {
        return std::count_if(count_.begin(), count_.end(),
                             [&](uint32_t count) { return count >= least; });
    };
    const uint32_t least = with_at_least(least_seen_) >= Cells::kMinCells ? least_seen_ : 1;
    const std::ptrdiff_t used = with_at_least(least);
    seen_.rest.resize(3, used);
    seen_.now.resize(3, used);
    seen_.error_mm2.resize(used);
    seen_.cells.clear();
    Eigen::Index next = 0;
    for (size_t i = 0; i < size(); ++i) {
        ++age_[i];
        if (count_[i] < least) continue;
        const auto cell = static_cast<Eigen::Index>(i);
        seen_.rest.col(next) = sum_rest_.col(cell) / count_[i];
        seen_.now.col(next) = sum_now_.col(cell) / count_[i];
        seen_.error_mm2[next++] = sum_error_mm2_[cell] / count_[i];
        seen_.cells.push_back(static_cast<uint32_t>(i));
        age_[i] = 0;
    }
    if (used < Cells::kMinCells) return false;
    // A row of cells does not tell how the surface turns about it.
    const Eigen::Matrix3Xd apart = seen_.rest.colwise() - seen_.rest.rowwise().mean();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(
        apart * apart.transpose() / static_cast<double>(used), Eigen::EigenvaluesOnly);
    return spread.eigenvalues()[1] > Cells::kMinSpread * Cells::kMinSpread * apart_mm_ * apart_mm_;
}

}  // namespace defrec
