// See photometric_evidence.hpp.
#include "sdk/tracking/evidence/photometric_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {
namespace {

using decisions::Confidence;

// The two of a control point's sums that are of patches, and of checks.
enum SumsOf : Eigen::Index { kPatches = 0, kChecks = 2 };

template <SumsOf kOf>
void clear(std::vector<Eigen::Array4f>& sums) {
    for (Eigen::Array4f& all : sums) all.segment<2>(kOf).setZero();
}
// Spreads a patch's value over the control points that move it.
template <SumsOf kOf>
void add(const defrec_patch& patch, float value, std::vector<Eigen::Array4f>& sums) {
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
        sums[static_cast<size_t>(patch.node[k])].segment<2>(kOf) +=
            patch.weight[k] * Eigen::Array2f(value, 1);
}

Eigen::Array4f sums_at(const defrec_surface_point& vertex,
                       const std::vector<Eigen::Array4f>& sums) {
    Eigen::Array4f sum = Eigen::Array4f::Zero();
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
        sum += vertex.weight[k] * sums[static_cast<size_t>(vertex.node[k])];
    return sum;
}
// 0 where there is none near.
template <SumsOf kOf>
float mean_of(const Eigen::Array4f& sums) {
    return sums[kOf + 1] > 1e-3f ? sums[kOf] / sums[kOf + 1] : 0;
}

bool fits(const defrec_patch_observation& found) {
    return found.valid != 0 && found.score >= Confidence::kMinZncc;
}

// Sums of checks over the control points at most kRegionReach away along rows and columns of the
// grid, per control point; tissue that joined has its own.
void sum_regions(const TemplateData& data, PhotometricEvidence& evidence) {
    constexpr int kReach = Confidence::kRegionReach;
    const NodeGrid& grid = data.node_grid;
    const auto own = [&](size_t node) -> Eigen::Array2f {
        return evidence.sums[node].segment<2>(kChecks);
    };
    for (size_t i = 0; i < evidence.sums.size(); ++i) evidence.regions[i] = own(i);
    std::vector<Eigen::Array2f>& rows = evidence.rows;
    for (size_t first = 0; first < grid.node.size(); first += grid.cells()) {
        const auto for_cells = [&](auto&& visit) {
            for (int y = 0; y < grid.rows; ++y)
                for (int x = 0; x < grid.columns; ++x)
                    visit(x, y, static_cast<size_t>(y * grid.columns + x));
        };
        for_cells([&](int x, int y, size_t cell) {
            rows[cell].setZero();
            for (int at = std::max(0, x - kReach); at <= std::min(grid.columns - 1, x + kReach);
                 ++at)
                if (const int32_t node =
                        grid.node[first + static_cast<size_t>(y * grid.columns + at)];
                    node >= 0)
                    rows[cell] += own(static_cast<size_t>(node));
        });
        for_cells([&](int x, int y, size_t cell) {
            const int32_t node = grid.node[first + cell];
            if (node < 0) return;
            Eigen::Array2f sum = Eigen::Array2f::Zero();
            for (int at = std::max(0, y - kReach); at <= std::min(grid.rows - 1, y + kReach); ++at)
                sum += rows[static_cast<size_t>(at * grid.columns + x)];
            evidence.regions[static_cast<size_t>(node)] = sum;
        });
    }
}

// ZNCC from which on a check fits, by the share of the checks in its region that do.
int32_t required_zncc(float region_share) {
    const float contradicted =
        std::clamp((Confidence::kFittingRegion - region_share) /
                       (Confidence::kFittingRegion - Confidence::kContradictedRegion),
                   0.0f, 1.0f);
    return Confidence::kMinZncc +
           static_cast<int32_t>(contradicted * (Confidence::kMinZnccAlone - Confidence::kMinZncc));
}

float region_share(const defrec_surface_point& vertex, const PhotometricEvidence& evidence) {
    Eigen::Array2f sum = Eigen::Array2f::Zero();
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
        sum += vertex.weight[k] * evidence.regions[static_cast<size_t>(vertex.node[k])];
    return sum[1] > 1e-3f ? sum[0] / sum[1] : 0;
}

// From the sums.
void measure_vertex(const TemplateData& data, const FrameOutput& output, size_t vertex,
                    PhotometricEvidence& evidence) {
    const defrec_surface_point& point = data.vertices[vertex];
    const Eigen::Array4f sums = sums_at(point, evidence.sums);
    evidence.patch_px2[vertex] = mean_of<kPatches>(sums);
    evidence.is_confirmed[vertex] = 0;
    evidence.check_px2[vertex] = 0;
    evidence.check_score[vertex] = 0;
    if (data.check_of_vertex[vertex] < 0) return;
    const auto check = static_cast<size_t>(data.check_of_vertex[vertex]);
    const defrec_patch_observation& found = output.checks[check];
    if (!fits(found) || mean_of<kChecks>(sums) < Confidence::kMinFittingShare ||
        found.score < required_zncc(region_share(point, evidence)))
        return;
    const defrec_patch_prediction& expected = output.check_predictions[check];
    const float du = static_cast<float>(int64_t{found.u} - expected.u) / 256,
                dv = static_cast<float>(int64_t{found.v} - expected.v) / 256;
    evidence.is_confirmed[vertex] = 1;
    evidence.check_px2[vertex] = du * du + dv * dv;
    evidence.check_score[vertex] = static_cast<float>(found.score) / 4096;
}

}  // namespace

void PhotometricEvidence::make_room(const TemplateData& data) {
    const size_t vertices = data.vertices.size();
    is_confirmed.resize(vertices);
    for (std::vector<float>* values : {&check_px2, &check_score, &patch_px2})
        values->resize(vertices);
    sums.resize(data.nodes.size() / 3);
    regions.resize(sums.size());
    rows.resize(data.node_grid.cells());
}

void spread_patches(const TemplateData& data, std::span<const double> patch_px2,
                    PhotometricEvidence& evidence) {
    constexpr float kFarthest2 = Confidence::kFarthestPatch * Confidence::kFarthestPatch;
    clear<kPatches>(evidence.sums);
    for (size_t i = 0; i < data.patches.size(); ++i)
        if (!std::isnan(patch_px2[i]))
            add<kPatches>(data.patches[i],
                          static_cast<float>(std::min<double>(patch_px2[i], kFarthest2)),
                          evidence.sums);
}

void spread_checks(const TemplateData& data, const FrameOutput& output,
                   PhotometricEvidence& evidence) {
    clear<kChecks>(evidence.sums);
    for (size_t i = 0; i < data.checks.size(); ++i)
        add<kChecks>(data.checks[i], fits(output.checks[i]) ? 1 : 0, evidence.sums);
    sum_regions(data, evidence);
}

void measure_photometric(const TemplateData& data, const FrameOutput& output, size_t begin,
                         size_t end, PhotometricEvidence& evidence) {
    for (size_t i = begin; i < end; ++i) measure_vertex(data, output, i, evidence);
}

}  // namespace defrec
