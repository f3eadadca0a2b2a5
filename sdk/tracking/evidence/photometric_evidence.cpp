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
// grid, per control point, by summed-area tables (Crow 1984); tissue that joined has its own.
void sum_regions(const TemplateData& data, PhotometricEvidence& evidence) {
    constexpr int kReach = Confidence::kRegionReach;
    const NodeGrid& grid = data.node_grid;
    const auto own = [&](int32_t node) -> Eigen::Array2f {
        return evidence.sums[static_cast<size_t>(node)].segment<2>(kChecks);
    };
    for (size_t i = 0; i < evidence.sums.size(); ++i)
        evidence.regions[i] = own(static_cast<int32_t>(i));
    const auto above = [&](int x, int y) -> Eigen::Array2d& {
        return evidence.area[static_cast<size_t>(y * (grid.columns + 1) + x)];
    };
    for (size_t first = 0; first < grid.node.size(); first += grid.cells()) {
        const int32_t* nodes = grid.node.data() + first;
        for (int y = 0; y < grid.rows; ++y) {
            Eigen::Array2d row = Eigen::Array2d::Zero();
            for (int x = 0; x < grid.columns; ++x) {
                const int32_t node = nodes[y * grid.columns + x];
                if (node >= 0) row += own(node).cast<double>();
                above(x + 1, y + 1) = above(x + 1, y) + row;
            }
        }
        for (int y = 0; y < grid.rows; ++y)
            for (int x = 0; x < grid.columns; ++x) {
                const int32_t node = nodes[y * grid.columns + x];
                if (node < 0) continue;
                const int left = std::max(0, x - kReach), top = std::max(0, y - kReach),
                          right = std::min(grid.columns, x + kReach + 1),
                          bottom = std::min(grid.rows, y + kReach + 1);
                evidence.regions[static_cast<size_t>(node)] =
                    (above(right, bottom) - above(left, bottom) - above(right, top) +
                     above(left, top))
                        .cast<float>();
            }
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

float region_share(const defrec_patch& check, const PhotometricEvidence& evidence) {
    Eigen::Array2f sum = Eigen::Array2f::Zero();
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
        sum += check.weight[k] * evidence.regions[static_cast<size_t>(check.node[k])];
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
    if (evidence.is_accepted[check] == 0 || mean_of<kChecks>(sums) < Confidence::kMinFittingShare)
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
    const NodeGrid& grid = data.node_grid;
    area.assign(static_cast<size_t>(grid.columns + 1) * static_cast<size_t>(grid.rows + 1),
                Eigen::Array2d::Zero());
    is_accepted.resize(data.checks.size());
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
    for (size_t i = 0; i < data.checks.size(); ++i) {
        const defrec_patch_observation& found = output.checks[i];
        evidence.is_accepted[i] =
            fits(found) && (found.score >= Confidence::kMinZnccAlone ||
                            found.score >= required_zncc(region_share(data.checks[i], evidence)));
    }
}

void measure_photometric(const TemplateData& data, const FrameOutput& output, size_t begin,
                         size_t end, PhotometricEvidence& evidence) {
    for (size_t i = begin; i < end; ++i) measure_vertex(data, output, i, evidence);
}

}  // namespace defrec
