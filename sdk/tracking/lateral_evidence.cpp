// See lateral_evidence.hpp.
#include "sdk/tracking/lateral_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/tracking/vertex_runs.hpp"

namespace defrec {
namespace {

// Tissue that has slid by a millimetre and more has a median score of 0 to 0.15, tissue in its
// place one above 0.9.
constexpr int32_t kMinScore = 4096 / 2;
// Of the checks round a vertex. Where tissue has slid, some checks fit elsewhere by chance.
constexpr float kMinFittingShare = 0.6f;
constexpr float kFarthestPx = 8;  // a patch farther off says no more than one at this distance

constexpr Eigen::Index kPatches = 0, kChecks = 2;  // of the sums

// Spreads a patch's value over the control points that move it.
void add(const defrec_patch& patch, float value, Eigen::Index kind,
         std::vector<Eigen::Array4f>& sums) {
    for (int k = 0; k < DEFREC_SKIN_NODES; ++k) {
        Eigen::Array4f& its = sums[static_cast<size_t>(patch.node[k])];
        its[kind] += patch.weight[k] * value;
        its[kind + 1] += patch.weight[k];
    }
}

Eigen::Array4f sums_at(const defrec_surface_point& vertex,
                       const std::vector<Eigen::Array4f>& sums) {
    Eigen::Array4f sum = Eigen::Array4f::Zero();
    for (int k = 0; k < DEFREC_SKIN_NODES; ++k)
        sum += vertex.weight[k] * sums[static_cast<size_t>(vertex.node[k])];
    return sum;
}

// 0 where there is none of that kind near.
float mean_of(const Eigen::Array4f& sums, Eigen::Index kind) {
    return sums[kind + 1] > 1e-3f ? sums[kind] / sums[kind + 1] : 0;
}

bool fits(const defrec_patch_observation& found) {
    return found.valid != 0 && found.score >= kMinScore;
}

// From the sums.
void measure_vertex(const TemplateData& data, const FrameOutput& output, size_t vertex,
                    LateralEvidence& evidence) {
    const Eigen::Array4f sums = sums_at(data.vertices[vertex], evidence.sums);
    evidence.patch_px2[vertex] = mean_of(sums, kPatches);
    evidence.is_confirmed[vertex] = 0;
    evidence.check_px2[vertex] = 0;
    evidence.check_score[vertex] = 0;
    if (data.check_of_vertex[vertex] < 0) return;
    const auto check = static_cast<size_t>(data.check_of_vertex[vertex]);
    const defrec_patch_observation& found = output.checks[check];
    if (!fits(found) || mean_of(sums, kChecks) < kMinFittingShare) return;
    const defrec_patch_prediction& expected = output.check_predictions[check];
    const float du = static_cast<float>(found.u - expected.u) / 256,
                dv = static_cast<float>(found.v - expected.v) / 256;
    evidence.is_confirmed[vertex] = 1;
    evidence.check_px2[vertex] = du * du + dv * dv;
    evidence.check_score[vertex] = static_cast<float>(found.score) / 4096;
}

}  // namespace

void spread_lateral(const TemplateData& data, const FrameOutput& output,
                    std::span<const double> patch_px2, LateralEvidence& evidence) {
    evidence.sums.assign(data.nodes.size() / 3, Eigen::Array4f::Zero());
    for (size_t i = 0; i < data.patches.size(); ++i)
        if (!std::isnan(patch_px2[i]))
            add(data.patches[i],
                static_cast<float>(std::min<double>(patch_px2[i], kFarthestPx * kFarthestPx)),
                kPatches, evidence.sums);
    for (size_t i = 0; i < data.checks.size(); ++i)
        add(data.checks[i], fits(output.checks[i]) ? 1 : 0, kChecks, evidence.sums);
}

void measure_lateral(const TemplateData& data, const FrameOutput& output, const Services* helpers,
                     LateralEvidence& evidence) {
    const size_t count = data.vertices.size();
    evidence.is_confirmed.resize(count);
    evidence.check_px2.resize(count);
    evidence.check_score.resize(count);
    evidence.patch_px2.resize(count);
    for_runs(helpers, count, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) measure_vertex(data, output, i, evidence);
    });
}

}  // namespace defrec
