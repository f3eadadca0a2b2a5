// See lateral_evidence.hpp.
#include "sdk/tracking/lateral_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace defrec {
namespace {

// Tissue that has slid by a millimetre and more has a median score of 0 to 0.15, tissue in its
// place one above 0.9.
constexpr int32_t kMinScore = 4096 / 2;
constexpr float kFarthestPx = 8;  // a patch farther off says no more than one at this distance

// The patches' squared distances, spread over the control points that move them.
void gather_patches(const TemplateData& data, std::span<const double> patch_px2,
                    LateralEvidence& evidence) {
    evidence.squares.assign(data.nodes.size() / 3, 0);
    evidence.weights.assign(data.nodes.size() / 3, 0);
    for (size_t i = 0; i < data.patches.size(); ++i) {
        if (std::isnan(patch_px2[i])) continue;
        const defrec_patch& patch = data.patches[i];
        const auto squared =
            static_cast<float>(std::min<double>(patch_px2[i], kFarthestPx * kFarthestPx));
        for (int k = 0; k < DEFREC_SKIN_NODES; ++k) {
            const auto node = static_cast<size_t>(patch.node[k]);
            evidence.squares[node] += patch.weight[k] * squared;
            evidence.weights[node] += patch.weight[k];
        }
    }
}

}  // namespace

void measure_lateral(const TemplateData& data, const FrameOutput& output,
                     std::span<const double> patch_px2, LateralEvidence& evidence) {
    gather_patches(data, patch_px2, evidence);
    const size_t count = data.vertices.size();
    evidence.is_confirmed.assign(count, 0);
    evidence.check_px2.assign(count, 0);
    evidence.check_score.assign(count, 0);
    evidence.patch_px2.assign(count, 0);
    for (size_t i = 0; i < count; ++i) {
        const defrec_surface_point& vertex = data.vertices[i];
        float squares = 0, weights = 0;
        for (int k = 0; k < DEFREC_SKIN_NODES; ++k) {
            squares += vertex.weight[k] * evidence.squares[static_cast<size_t>(vertex.node[k])];
            weights += vertex.weight[k] * evidence.weights[static_cast<size_t>(vertex.node[k])];
        }
        if (weights > 1e-3f) evidence.patch_px2[i] = squares / weights;
        if (data.check_of_vertex[i] < 0) continue;
        const auto check = static_cast<size_t>(data.check_of_vertex[i]);
        const defrec_patch_observation& found = output.checks[check];
        if (found.valid == 0 || found.score < kMinScore) continue;
        const defrec_patch_prediction& expected = output.check_predictions[check];
        evidence.is_confirmed[i] = 1;
        const float du = static_cast<float>(found.u - expected.u) / 256,
                    dv = static_cast<float>(found.v - expected.v) / 256;
        evidence.check_px2[i] = du * du + dv * dv;
        evidence.check_score[i] = static_cast<float>(found.score) / 4096;
    }
}

}  // namespace defrec
