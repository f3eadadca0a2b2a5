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

using Sums = std::vector<Eigen::Array2f>;

// Spreads a patch's value over the control points that move it.
void add(const defrec_patch& patch, float value, Sums& sums) {
    for (int k = 0; k < DEFREC_SKIN_NODES; ++k)
        sums[static_cast<size_t>(patch.node[k])] += patch.weight[k] * Eigen::Array2f(value, 1);
}

// 0 where there is none near.
float mean_at(const defrec_surface_point& vertex, const Sums& sums) {
    Eigen::Array2f sum = Eigen::Array2f::Zero();
    for (int k = 0; k < DEFREC_SKIN_NODES; ++k)
        sum += vertex.weight[k] * sums[static_cast<size_t>(vertex.node[k])];
    return sum[1] > 1e-3f ? sum[0] / sum[1] : 0;
}

bool fits(const defrec_patch_observation& found) {
    return found.valid != 0 && found.score >= kMinScore;
}

// From the sums.
void measure_vertex(const TemplateData& data, const FrameOutput& output, size_t vertex,
                    LateralEvidence& evidence) {
    const defrec_surface_point& point = data.vertices[vertex];
    evidence.patch_px2[vertex] = mean_at(point, evidence.patch_sums);
    evidence.is_confirmed[vertex] = 0;
    evidence.check_px2[vertex] = 0;
    evidence.check_score[vertex] = 0;
    if (data.check_of_vertex[vertex] < 0) return;
    const auto check = static_cast<size_t>(data.check_of_vertex[vertex]);
    const defrec_patch_observation& found = output.checks[check];
    if (!fits(found) || mean_at(point, evidence.check_sums) < kMinFittingShare) return;
    const defrec_patch_prediction& expected = output.check_predictions[check];
    const float du = static_cast<float>(found.u - expected.u) / 256,
                dv = static_cast<float>(found.v - expected.v) / 256;
    evidence.is_confirmed[vertex] = 1;
    evidence.check_px2[vertex] = du * du + dv * dv;
    evidence.check_score[vertex] = static_cast<float>(found.score) / 4096;
}

}  // namespace

void LateralEvidence::make_room(const TemplateData& data) {
    const size_t vertices = data.vertices.size();
    is_confirmed.resize(vertices);
    for (std::vector<float>* values : {&check_px2, &check_score, &patch_px2})
        values->resize(vertices);
    for (Sums* sums : {&patch_sums, &check_sums}) sums->resize(data.nodes.size() / 3);
}

void spread_patches(const TemplateData& data, std::span<const double> patch_px2,
                    LateralEvidence& evidence) {
    Sums& sums = evidence.patch_sums;
    std::fill(sums.begin(), sums.end(), Eigen::Array2f::Zero());
    for (size_t i = 0; i < data.patches.size(); ++i)
        if (!std::isnan(patch_px2[i]))
            add(data.patches[i],
                static_cast<float>(std::min<double>(patch_px2[i], kFarthestPx * kFarthestPx)),
                sums);
}

void spread_checks(const TemplateData& data, const FrameOutput& output, LateralEvidence& evidence) {
    Sums& sums = evidence.check_sums;
    std::fill(sums.begin(), sums.end(), Eigen::Array2f::Zero());
    for (size_t i = 0; i < data.checks.size(); ++i)
        add(data.checks[i], fits(output.checks[i]) ? 1 : 0, sums);
}

void measure_lateral(const TemplateData& data, const FrameOutput& output, size_t begin, size_t end,
                     LateralEvidence& evidence) {
    for (size_t i = begin; i < end; ++i) measure_vertex(data, output, i, evidence);
}

}  // namespace defrec
