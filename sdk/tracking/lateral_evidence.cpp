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

void clear(const TemplateData& data, NodeMeans& means) {
    means.sums.assign(data.nodes.size() / 3, 0);
    means.weights.assign(data.nodes.size() / 3, 0);
}

// Spreads a patch's value over the control points that move it.
void add(const defrec_patch& patch, float value, NodeMeans& means) {
    for (int k = 0; k < DEFREC_SKIN_NODES; ++k) {
        const auto node = static_cast<size_t>(patch.node[k]);
        means.sums[node] += patch.weight[k] * value;
        means.weights[node] += patch.weight[k];
    }
}

// At a vertex; 0 where there is no patch near.
float mean_at(const defrec_surface_point& vertex, const NodeMeans& means) {
    float sum = 0, weight = 0;
    for (int k = 0; k < DEFREC_SKIN_NODES; ++k) {
        sum += vertex.weight[k] * means.sums[static_cast<size_t>(vertex.node[k])];
        weight += vertex.weight[k] * means.weights[static_cast<size_t>(vertex.node[k])];
    }
    return weight > 1e-3f ? sum / weight : 0;
}

bool fits(const defrec_patch_observation& found) {
    return found.valid != 0 && found.score >= kMinScore;
}

}  // namespace

void measure_lateral(const TemplateData& data, const FrameOutput& output,
                     std::span<const double> patch_px2, LateralEvidence& evidence) {
    clear(data, evidence.distances);
    for (size_t i = 0; i < data.patches.size(); ++i)
        if (!std::isnan(patch_px2[i]))
            add(data.patches[i],
                static_cast<float>(std::min<double>(patch_px2[i], kFarthestPx * kFarthestPx)),
                evidence.distances);
    clear(data, evidence.fitting);
    for (size_t i = 0; i < data.checks.size(); ++i)
        add(data.checks[i], fits(output.checks[i]) ? 1 : 0, evidence.fitting);
    const size_t count = data.vertices.size();
    evidence.is_confirmed.assign(count, 0);
    evidence.check_px2.assign(count, 0);
    evidence.check_score.assign(count, 0);
    evidence.patch_px2.assign(count, 0);
    for (size_t i = 0; i < count; ++i) {
        evidence.patch_px2[i] = mean_at(data.vertices[i], evidence.distances);
        if (data.check_of_vertex[i] < 0) continue;
        const auto check = static_cast<size_t>(data.check_of_vertex[i]);
        const defrec_patch_observation& found = output.checks[check];
        if (!fits(found) || mean_at(data.vertices[i], evidence.fitting) < kMinFittingShare)
            continue;
        const defrec_patch_prediction& expected = output.check_predictions[check];
        evidence.is_confirmed[i] = 1;
        const float du = static_cast<float>(found.u - expected.u) / 256,
                    dv = static_cast<float>(found.v - expected.v) / 256;
        evidence.check_px2[i] = du * du + dv * dv;
        evidence.check_score[i] = static_cast<float>(found.score) / 4096;
    }
}

}  // namespace defrec
