// See photometric_evidence.hpp.
#include "sdk/tracking/evidence/photometric_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sdk/template/check_patches.hpp"
#include "sdk/tracking/decisions/confidence.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"

namespace defrec {
namespace {

using decisions::Confidence;

// A control point's sums of checks: those that are located, that fit, that are refuted, and all.
enum Checks : Eigen::Index { kLocated, kFitting, kRefuted, kAll };

// Spreads values over the control points that move a patch.
template <class Sums>
void add(const defrec_patch& patch, const Sums& values, std::vector<Sums>& sums) {
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
        sums[static_cast<size_t>(patch.node[k])] += patch.weight[k] * values;
}

template <class Sums>
Sums sums_at(const defrec_surface_point& vertex, const std::vector<Sums>& sums) {
    Sums sum = Sums::Zero();
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
        sum += vertex.weight[k] * sums[static_cast<size_t>(vertex.node[k])];
    return sum;
}
// 0 where there is none near.
float mean(float sum, float weight) { return weight > 1e-3f ? sum / weight : 0; }

// Whether the check's own peak was found, rather than compared where it is predicted.
bool has_peak(const defrec_patch_observation& found) {
    return found.information[0] > 0 || found.information[2] > 0;
}

bool is_located(const defrec_patch_observation& found) {
    return found.valid != 0 && has_peak(found) && found.score >= Confidence::kMinZncc;
}

// px^2 between where a check was found and where the surface has it.
float distance2(const defrec_patch_observation& found, const defrec_patch_prediction& expected) {
    const float du = static_cast<float>(int64_t{found.u} - expected.u) / 256,
                dv = static_cast<float>(int64_t{found.v} - expected.v) / 256;
    return du * du + dv * dv;
}

// level: of the image in which checks are searched.
bool fits(const defrec_patch_observation& found, const defrec_patch_prediction& expected,
          uint32_t level) {
    if (found.valid == 0) return false;
    if (!has_peak(found)) return found.score >= Confidence::kMinZnccKept;
    const float px2 = distance2(found, expected) / static_cast<float>(1u << (2 * level));
    return static_cast<float>(found.score) >= Confidence::kMinZncc + Confidence::kZnccPerPx2 * px2;
}

// Whether a check shows that its tissue is not where the surface has it. sample: in its window.
bool is_refuted(const TemplateData& data, const defrec_patch_prediction& expected,
                const defrec_surface_sample& sample, bool is_located, bool does_fit) {
    if (expected.valid == 0) return false;
    switch (sample.observation) {
        case DEFREC_OBSERVED:
            return !is_located && !does_fit;
        case DEFREC_INCONSISTENT:
            return is_located ? lies_elsewhere(data.camera, sample) : !does_fit;
        case DEFREC_OCCLUDED:
            return is_located && lies_elsewhere(data.camera, sample);
        default:
            return false;
    }
}

// Squared distance at which the peak of a check may lie that was not located.
float kept_px2(const TemplateData& data) {
    const auto reach = static_cast<float>(check_search_radius(data.width) << check_level(data));
    return Confidence::kKeptShare * reach * reach;
}

// Sums of checks over the control points at most kRegionReach away along rows and columns of the
// grid, per control point, by summed-area tables (Crow 1984); tissue that joined has its own.
void sum_regions(const TemplateData& data, PhotometricEvidence& evidence) {
    constexpr int kReach = Confidence::kRegionReach;
    const NodeGrid& grid = data.node_grid;
    const auto own = [&](int32_t node) -> Eigen::Array2f {
        const Eigen::Array4f& sums = evidence.checks[static_cast<size_t>(node)];
        return {sums[kLocated], sums[kAll]};
    };
    for (size_t i = 0; i < evidence.checks.size(); ++i)
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

// The share of the checks in a vertex' region that are located.
float region_share(const defrec_surface_point& vertex, const PhotometricEvidence& evidence) {
    const Eigen::Array2f sum = sums_at(vertex, evidence.regions);
    return mean(sum[0], sum[1]);
}

// Whether a score is what the vertex' region asks for.
bool suits_region(const defrec_surface_point& vertex, int32_t score,
                  const PhotometricEvidence& evidence) {
    return score >= Confidence::kMinZnccAlone ||
           score >= required_zncc(region_share(vertex, evidence));
}

// A check that was located poorly among others that fail may be another part of the texture.
bool may_be_chance(const defrec_surface_point& vertex, const defrec_patch_observation& found,
                   const PhotometricEvidence& evidence) {
    return has_peak(found) && least_information(found) < Confidence::kMinInformation &&
           region_share(vertex, evidence) < Confidence::kMostFail;
}

// From the sums.
void measure_vertex(const TemplateData& data, const FrameOutput& output, size_t vertex,
                    PhotometricEvidence& evidence) {
    const defrec_surface_point& point = data.vertices[vertex];
    const Eigen::Array2f patches = sums_at(point, evidence.patches);
    evidence.patch_px2[vertex] = mean(patches[0], patches[1]);
    evidence.is_confirmed[vertex] = evidence.is_located[vertex] = 0;
    evidence.check_px2[vertex] = 0;
    evidence.check_score[vertex] = 0;
    const Eigen::Array4f checks = sums_at(point, evidence.checks);
    const auto share = [&](Checks such) { return mean(checks[such], checks[kAll]); };
    evidence.refuted[vertex] = std::max(0.0f, share(kRefuted) - Confidence::kRefutedByChance);
    if (data.check_of_vertex[vertex] < 0) return;
    const auto check = static_cast<size_t>(data.check_of_vertex[vertex]);
    const defrec_patch_observation& found = output.checks[check];
    if (evidence.is_check_located[check] + evidence.does_check_fit[check] == 0 ||
        !suits_region(point, found.score, evidence))
        return;
    const auto most_are = [&](Checks such) { return share(such) >= Confidence::kMinFittingShare; };
    evidence.is_located[vertex] = evidence.is_check_located[check] != 0 && most_are(kLocated);
    if (evidence.does_check_fit[check] == 0 || !most_are(kFitting) ||
        may_be_chance(point, found, evidence))
        return;
    evidence.is_confirmed[vertex] = 1;
    evidence.refuted[vertex] = 0;
    evidence.check_px2[vertex] =
        has_peak(found) ? distance2(found, output.check_predictions[check]) : kept_px2(data);
    evidence.check_score[vertex] = static_cast<float>(found.score) / 4096;
}

}  // namespace

bool lies_elsewhere(const defrec_camera& camera, const defrec_surface_sample& sample) {
    const float per_px = depth_per_px(camera, sample.position[2]);
    return std::abs(sample.residual) > decisions::Departure::kMinPx * per_px;
}

float least_information(const defrec_patch_observation& found) {
    const float* of = found.information;
    const float half = (of[0] - of[2]) / 2;
    return (of[0] + of[2]) / 2 - std::sqrt(half * half + of[1] * of[1]);
}

CheckedVertices::CheckedVertices(const TemplateData& data)
    : nearest(data.checks.size(), -1), count(data.checks.size(), 0) {
    std::vector<float> least(data.checks.size(), std::numeric_limits<float>::max());
    for (size_t i = 0; i < data.vertices.size(); ++i) {
        if (data.check_of_vertex[i] < 0) continue;
        const auto check = static_cast<size_t>(data.check_of_vertex[i]);
        ++count[check];
        const float apart = (Eigen::Map<const Eigen::Vector3f>(data.vertices[i].position) -
                             Eigen::Map<const Eigen::Vector3f>(data.checks[check].position))
                                .squaredNorm();
        if (apart >= least[check]) continue;
        least[check] = apart;
        nearest[check] = static_cast<int32_t>(i);
    }
}

void PhotometricEvidence::make_room(const TemplateData& data) {
    const size_t vertices = data.vertices.size(), nodes = data.nodes.size() / 3;
    is_confirmed.resize(vertices);
    is_located.resize(vertices);
    for (std::vector<float>* values : {&check_px2, &check_score, &patch_px2, &refuted})
        values->resize(vertices);
    patches.resize(nodes);
    checks.resize(nodes);
    regions.resize(nodes);
    const NodeGrid& grid = data.node_grid;
    area.assign(static_cast<size_t>(grid.columns + 1) * static_cast<size_t>(grid.rows + 1),
                Eigen::Array2d::Zero());
    is_check_located.resize(data.checks.size());
    does_check_fit.resize(data.checks.size());
}

void spread_patches(const TemplateData& data, std::span<const double> patch_px2,
                    PhotometricEvidence& evidence) {
    constexpr float kFarthest2 = Confidence::kFarthestPatch * Confidence::kFarthestPatch;
    std::fill(evidence.patches.begin(), evidence.patches.end(), Eigen::Array2f(0, 0));
    for (size_t i = 0; i < data.patches.size(); ++i)
        if (!std::isnan(patch_px2[i]))
            add<Eigen::Array2f>(
                data.patches[i],
                {static_cast<float>(std::min<double>(patch_px2[i], kFarthest2)), 1.0f},
                evidence.patches);
}

void spread_checks(const TemplateData& data, const CheckedVertices& vertices,
                   const FrameOutput& output, PhotometricEvidence& evidence) {
    std::fill(evidence.checks.begin(), evidence.checks.end(), Eigen::Array4f(0, 0, 0, 0));
    evidence.vertices_refuted = 0;
    const uint32_t level = check_level(data);
    for (size_t i = 0; i < data.checks.size(); ++i) {
        const defrec_patch_observation& found = output.checks[i];
        uint8_t &located = evidence.is_check_located[i], &fit = evidence.does_check_fit[i];
        located = is_located(found) ? 1 : 0;
        fit = fits(found, output.check_predictions[i], level) ? 1 : 0;
        const bool refuted = vertices.nearest[i] >= 0 &&
                             is_refuted(data, output.check_predictions[i],
                                        output.samples[static_cast<size_t>(vertices.nearest[i])],
                                        located != 0, fit != 0);
        evidence.vertices_refuted += refuted ? vertices.count[i] : 0;
        add<Eigen::Array4f>(
            data.checks[i],
            {static_cast<float>(located), static_cast<float>(fit), refuted ? 1.0f : 0.0f, 1.0f},
            evidence.checks);
    }
    sum_regions(data, evidence);
}

void measure_photometric(const TemplateData& data, const FrameOutput& output, size_t begin,
                         size_t end, PhotometricEvidence& evidence) {
    for (size_t i = begin; i < end; ++i) measure_vertex(data, output, i, evidence);
}

}  // namespace defrec
