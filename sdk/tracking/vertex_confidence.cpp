#include "sdk/tracking/vertex_confidence.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstring>

namespace defrec {
namespace {

constexpr double kDisparitySigmaPx = 0.15, kLateralSigmaMm = 0.1;
constexpr float kGrowth = 0.06f;          // mm of error per mm from the nearest observation
constexpr float kFarthestMm = 40;         // extrapolation reaches no farther
constexpr float kFarthestGrowthMm = 100;  // nor does the error grow beyond
constexpr double kGrowthUnsupported =
    0.03;  // mm of error per mm that the template was extrapolated
constexpr float kResidualShare = 0.3f;
constexpr float kGrowthLost = 0.5f;       // mm of error per frame
constexpr uint32_t kLongestGrowth = 100;  // frames

// Of an error that is the same in all directions. covariance: xx, xy, xz, yy, yz, zz.
template <class Real>
void set_isotropic(Real expected_error, Real* covariance) {
    std::fill_n(covariance, 6, Real{0});
    for (const int diagonal : {0, 3, 5})
        covariance[diagonal] = expected_error * expected_error / Real{3};
}

}  // namespace

SurfaceModel::SurfaceModel(const TemplateData& given) : data(&given), cell(given.vertices.size()) {
    const auto count = static_cast<Eigen::Index>(given.vertices.size());
    for (size_t i = 0; i < given.grid.vertex.size(); ++i)
        if (given.grid.vertex[i] >= 0)
            cell[static_cast<size_t>(given.grid.vertex[i])] = static_cast<uint32_t>(i);
    step_mm.resize(count);
    measurement_variance.resize(count);
    support_error.resize(count);
    centred.setZero(4, count);
    centre.setZero();
    for (Eigen::Index i = 0; i < count; ++i) {
        const defrec_surface_point& vertex = given.vertices[static_cast<size_t>(i)];
        const double z = std::max<double>(1, vertex.position[2]);
        const double depth_sigma =
            kDisparitySigmaPx * z * z / (given.camera.fx * given.camera.baseline_mm);
        step_mm[i] = static_cast<float>(given.grid.spacing * z / given.camera.fx);
        measurement_variance[i] =
            static_cast<float>(depth_sigma * depth_sigma + kLateralSigmaMm * kLateralSigmaMm);
        support_error[i] =
            static_cast<float>(kGrowthUnsupported * given.vertex_support[static_cast<size_t>(i)] *
                               z / given.camera.fx);
        centre += Eigen::Map<const Eigen::Vector3f>(vertex.position).cast<double>();
    }
    centre /= static_cast<double>(std::max<Eigen::Index>(1, count));
    for (Eigen::Index i = 0; i < count; ++i) {
        const Eigen::Map<const Eigen::Vector3f> position(
            given.vertices[static_cast<size_t>(i)].position);
        centred.col(i).head<3>() = (position.cast<double>() - centre).cast<float>();
    }
}

void estimate_confidence(const SurfaceModel& model, SurfaceSamples samples, bool lost, uint32_t age,
                         VertexConfidence& confidence) {
    const SurfaceGrid& grid = model.data->grid;
    const auto count = static_cast<Eigen::Index>(samples.size());
    confidence.status.resize(samples.size());
    confidence.evidence.resize(samples.size());
    confidence.covariance.resize(6 * samples.size());
    confidence.expected_error.resize(samples.size());
    confidence.far_mm.resize(count);
    confidence.residual_mm.resize(count);
    confidence.distance.assign(grid.vertex.size(), 1e6f);
    for (size_t i = 0; i < samples.size(); ++i)
        if (samples[i].observation == DEFREC_OBSERVED) confidence.distance[model.cell[i]] = 0;
    spread_distance(confidence.distance, grid.columns, grid.rows);
    static_assert(DEFREC_POINT_OBSERVED == 0 && DEFREC_POINT_EXTRAPOLATED == 1 &&
                  DEFREC_POINT_UNKNOWN == 2);
    float *far_mm = confidence.far_mm.data(), *residual_mm = confidence.residual_mm.data();
    uint8_t* status = confidence.status.data();
    for (size_t i = 0; i < samples.size(); ++i) {
        const float distance = confidence.distance[model.cell[i]],
                    far = distance * model.step_mm.data()[i];
        far_mm[i] = far;
        residual_mm[i] =
            distance > 0 ? 0
                         : kResidualShare * samples[i].residual;  // at distance 0 it is observed
        status[i] = static_cast<uint8_t>((distance > 0) + (far > kFarthestMm));
    }
    const float loss = lost ? kGrowthLost * static_cast<float>(std::min(age, kLongestGrowth)) : 0;
    Eigen::Map<Eigen::ArrayXf>(confidence.expected_error.data(), count) =
        (model.measurement_variance + confidence.residual_mm.square()).sqrt() +
        kGrowth * confidence.far_mm.min(kFarthestGrowthMm) + model.support_error + loss;
    if (lost)
        std::fill(confidence.status.begin(), confidence.status.end(),
                  uint8_t{DEFREC_POINT_UNKNOWN});
    for (size_t i = 0; i < samples.size(); ++i) {
        const bool is_measured = !lost && samples[i].observation == DEFREC_OBSERVED;
        confidence.evidence[i] = is_measured ? DEFREC_EVIDENCE_DEPTH : 0;
        set_isotropic(confidence.expected_error[i], &confidence.covariance[6 * i]);
    }
}

SurfaceConfidence confidence_at(const TemplateData& data, const VertexConfidence& confidence,
                                const double xyz[3]) {
    constexpr double kGrowthOffSurface = 0.03;  // mm of error per mm from the surface
    const SurfaceGrid& grid = data.grid;
    SurfaceConfidence at;
    at.expected_error = 100;
    set_isotropic(at.expected_error, at.covariance);
    if (!(xyz[2] > 0 && std::isfinite(xyz[2]))) return at;
    const double u = data.camera.fx * xyz[0] / xyz[2] + data.camera.cx,
                 v = data.camera.fy * xyz[1] / xyz[2] + data.camera.cy;
    if (!(std::abs(u) < 1e6 && std::abs(v) < 1e6)) return at;
    const int column = static_cast<int>(std::lround(u / grid.spacing)),
              row = static_cast<int>(std::lround(v / grid.spacing));
    // The nearest vertex within two grid steps; beyond, nothing is known of the surface there.
    int32_t nearest = -1;
    int best = 9;
    for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
            const int x = column + dx, y = row + dy;
            if (x < 0 || y < 0 || x >= grid.columns || y >= grid.rows || dx * dx + dy * dy >= best)
                continue;
            const int32_t vertex = grid.vertex[static_cast<size_t>(y * grid.columns + x)];
            if (vertex < 0) continue;
            nearest = vertex;
            best = dx * dx + dy * dy;
        }
    if (nearest < 0) return at;
    const size_t vertex = static_cast<size_t>(nearest);
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double difference = xyz[axis] - data.vertices[vertex].position[axis];
        squared += difference * difference;
    }
    const double step_mm = grid.spacing * data.vertices[vertex].position[2] / data.camera.fx;
    at.status = confidence.status[vertex];
    at.evidence = confidence.evidence[vertex];
    at.expected_error = confidence.expected_error[vertex] +
                        kGrowthOffSurface * std::max(0.0, std::sqrt(squared) - 2 * step_mm);
    const double growth = at.expected_error / confidence.expected_error[vertex];
    for (size_t i = 0; i < 6; ++i)
        at.covariance[i] = growth * growth * confidence.covariance[6 * vertex + i];
    return at;
}

void fit_rigid_motion(const SurfaceModel& model, SurfaceSamples samples, double motion[12]) {
    // Sums of short runs in single precision, of which the sum is in double. Targets need no
    // centring where sources are centred. The fourth component is a part of the normal, which goes
    // along for the sake of whole vectors.
    constexpr size_t kRun = 32;
    Eigen::Matrix<double, 4, 3> correlation = Eigen::Matrix<double, 4, 3>::Zero();
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (size_t begin = 0; begin < samples.size(); begin += kRun) {
        Eigen::Vector4f along[3] = {Eigen::Vector4f::Zero(), Eigen::Vector4f::Zero(),
                                    Eigen::Vector4f::Zero()};
        Eigen::Vector4f run = Eigen::Vector4f::Zero();
        for (size_t i = begin; i < std::min(begin + kRun, samples.size()); ++i) {
            const Eigen::Map<const Eigen::Vector4f> target(samples[i].position);
            const float* source = model.centred.data() + 4 * i;
            run += target;
            for (int axis = 0; axis < 3; ++axis) along[axis] += source[axis] * target;
        }
        sum += run.cast<double>();
        for (int axis = 0; axis < 3; ++axis) correlation.col(axis) += along[axis].cast<double>();
    }
    const Eigen::Vector3d to =
        sum.head<3>() / static_cast<double>(std::max<size_t>(1, samples.size()));
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation.topRows<3>(),
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    const Eigen::Matrix3d rotation =
        svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
    const Eigen::Vector3d translation = to - rotation * model.centre;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) motion[4 * row + column] = rotation(row, column);
        motion[4 * row + 3] = translation[row];
    }
}

bool moved_farther(SurfaceSamples from, SurfaceSamples to, float distance_mm) {
    if (to.empty()) return false;
    size_t farther = 0, nearer = 0;
    for (size_t i = 0; 2 * farther < to.size() && 2 * nearer <= to.size(); ++i) {
        float squared = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const float step = to[i].position[axis] - from[i].position[axis];
            squared += step * step;
        }
        (squared > distance_mm * distance_mm ? farther : nearer)++;
    }
    return 2 * farther >= to.size();
}

void split_samples(SurfaceSamples samples, std::span<float> positions, std::span<float> normals) {
    for (size_t i = 0; i < samples.size(); ++i) {
        std::memcpy(&positions[3 * i], samples[i].position, sizeof samples[i].position);
        std::memcpy(&normals[3 * i], samples[i].normal, sizeof samples[i].normal);
    }
}

}  // namespace defrec
