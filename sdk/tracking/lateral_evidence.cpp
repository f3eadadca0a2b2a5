// See lateral_evidence.hpp.
#include "sdk/tracking/lateral_evidence.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace

void measure_lateral(const TemplateData& data, const FrameOutput& output,
                     std::span<const double> patch_px2, LateralEvidence& evidence) {
    evidence.sums.assign(data.nodes.size() / 3, Eigen::Array4f::Zero());
    for (size_t i = 0; i < data.patches.size(); ++i)
        if (!std::isnan(patch_px2[i]))
            add(data.patches[i],
                static_cast<float>(std::min<double>(patch_px2[i], kFarthestPx * kFarthestPx)),
                kPatches, evidence.sums);
    for (size_t i = 0; i < data.checks.size(); ++i)
        add(data.checks[i], fits(output.checks[i]) ? 1 : 0, kChecks, evidence.sums);
    const size_t count = data.vertices.size();
    evidence.is_confirmed.assign(count, 0);
    evidence.check_px2.assign(count, 0);
    evidence.check_score.assign(count, 0);
    evidence.patch_px2.assign(count, 0);
    for (size_t i = 0; i < count; ++i) {
        const Eigen::Array4f sums = sums_at(data.vertices[i], evidence.sums);
        evidence.patch_px2[i] = mean_of(sums, kPatches);
        if (data.check_of_vertex[i] < 0) continue;
        const auto check = static_cast<size_t>(data.check_of_vertex[i]);
        const defrec_patch_observation& found = output.checks[check];
        if (!fits(found) || mean_of(sums, kChecks) < kMinFittingShare) continue;
        const defrec_patch_prediction& expected = output.check_predictions[check];
        evidence.is_confirmed[i] = 1;
        const float du = static_cast<float>(found.u - expected.u) / 256,
                    dv = static_cast<float>(found.v - expected.v) / 256;
        evidence.check_px2[i] = du * du + dv * dv;
        evidence.check_score[i] = static_cast<float>(found.score) / 4096;
    }
}

}  // namespace defrec
