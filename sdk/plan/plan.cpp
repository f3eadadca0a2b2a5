// See plan.hpp.
#include "sdk/plan/plan.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "backends/shared/motion.hpp"
#include "sdk/base/os/helped_loop.hpp"
#include "sdk/base/os/services.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/base/util/utf8.hpp"
#include "sdk/registration/decisions.hpp"
#include "sdk/template/template.hpp"
#include "sdk/tracking/frame_result.hpp"

namespace defrec {
namespace {

template <class Real>
bool all_finite(const std::vector<Real>& values) {
    return std::ranges::all_of(values, [](Real value) { return std::isfinite(value); });
}

std::string fault_of_pose(const Pose& pose) {
    if (!pose.rotation.allFinite() || !pose.translation.allFinite())
        return "transform is not finite";
    const Eigen::Matrix3d rest =
        pose.rotation.transpose() * pose.rotation - Eigen::Matrix3d::Identity();
    if (!(rest.cwiseAbs().array() <= decisions::PlanRegistration::kRotation).all() ||
        pose.rotation.determinant() < 0)
        return "transform is no rigid motion";
    return {};
}

std::string fault_of_covariance(const TwistMatrix& covariance) {
    if (!covariance.allFinite()) return "covariance is not finite";
    const double largest = covariance.cwiseAbs().maxCoeff();
    if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() >
        decisions::PlanRegistration::kSymmetric * largest)
        return "covariance is not symmetric";
    const Twist variance = covariance.diagonal();
    if ((variance.array() < 0).any()) return "covariance has a negative variance";
    // In units of its own standard deviations: turns and shifts differ by far.
    const Twist deviation = variance.cwiseSqrt();
    const auto exceeds = [&](int i, int j) {
        return std::abs(covariance(i, j)) >
               (1 + decisions::PlanRegistration::kSymmetric) * deviation[i] * deviation[j];
    };
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j)
            if (i != j && exceeds(i, j))
                return concat("covariance is none: element ", i, ", ", j,
                              " is larger than its variances allow");
    const Twist scale = deviation.unaryExpr([](double d) { return d > 0 ? 1 / d : 0; });
    const TwistMatrix shares = scale.asDiagonal() * covariance * scale.asDiagonal();
    const Eigen::LDLT<TwistMatrix> factors(shares);
    if (!(factors.vectorD().array() >= -decisions::PlanRegistration::kSymmetric).all())
        return "covariance is none: it has a negative eigenvalue";
    return {};
}

// Root of a trace that rounding may leave below 0.
double error_of(const Eigen::Matrix3d& covariance) {
    const double trace = covariance.trace();
    return trace < 0 ? 0 : std::sqrt(trace);
}

// A deformed model's points: as many as there are, each with a covariance.
std::string fault_of_deformed(const PlanData& data) {
    const size_t points = data.point_count();
    if (data.deformed_places.empty() && data.deformed_covariances.empty()) return {};
    if (data.deformed_places.size() != 3 * points || data.deformed_covariances.size() != 6 * points)
        return concat("there are ", data.deformed_places.size(), " coordinates and ",
                      data.deformed_covariances.size(),
                      " numbers of covariances of deformed points, ", 3 * points, " and ",
                      6 * points, " expected");
    if (!all_finite(data.deformed_places) || !all_finite(data.deformed_covariances))
        return "a deformed point is not finite";
    for (size_t i = 0; i < points; ++i) {
        const Eigen::Matrix3d covariance = data.at_rest(i).covariance;
        const Eigen::LDLT<Eigen::Matrix3d> factors(covariance);
        const double least =
            -decisions::PlanRegistration::kSymmetric * covariance.cwiseAbs().maxCoeff();
        if (!(covariance.diagonal().array() >= 0).all() ||
            !(factors.vectorD().array() >= least).all())
            return concat("deformed point ", i, " has a covariance that is none");
    }
    return {};
}

// Numbers that are finite may lead to a place or an error that is not.
std::string fault_of_places(const PlanData& data) {
    const size_t vertices = data.vertices.size() / 3;
    for (size_t i = 0; i < data.point_count(); ++i) {
        const PlacedPoint point = data.at_rest(i);
        if (!point.place.allFinite() || !std::isfinite(error_of(point.covariance)))
            return concat(i < vertices ? "vertex " : "target ", i < vertices ? i : i - vertices,
                          " has no finite place and error in the template");
    }
    return {};
}

std::string fault_of_name(const std::string& name, const char* list, size_t index,
                          size_t min_bytes) {
    if (name.size() < min_bytes || name.size() > decisions::PlanRegistration::kMaxNameBytes)
        return concat(list, "[", index, "].name has ", name.size(), " bytes, ", min_bytes, " to ",
                      decisions::PlanRegistration::kMaxNameBytes, " expected");
    if (name.find('\0') != std::string::npos)
        return concat(list, "[", index, "].name has a zero byte");
    if (!is_utf8(name)) return concat(list, "[", index, "].name is not UTF-8");
    return {};
}

// An application finds a target by its name.
std::string fault_of_target_names(const std::vector<std::string>& names, size_t targets) {
    if (names.empty()) return {};
    if (names.size() != targets)
        return concat("there are ", names.size(), " names of targets, ", targets, " expected");
    std::unordered_set<std::string_view> known;
    for (size_t i = 0; i < names.size(); ++i) {
        if (std::string found = fault_of_name(names[i], "targets", i, 0); !found.empty())
            return found;
        if (!names[i].empty() && !known.insert(names[i]).second)
            return concat("targets[", i, "].name is \"", without_controls(names[i]),
                          "\", which is that of another target");
    }
    return {};
}

std::string fault_of_parts(const std::vector<PlanPart>& parts, uint64_t triangles) {
    for (size_t i = 0; i < parts.size(); ++i) {
        const PlanPart& part = parts[i];
        if (std::string found = fault_of_name(part.name, "parts", i, 1); !found.empty())
            return found;
        if (part.first_triangle > triangles ||
            part.triangle_count > triangles - part.first_triangle)
            return concat("parts[", i, "] has ", part.triangle_count, " triangles from ",
                          part.first_triangle, " on, there are ", triangles);
    }
    return {};
}

// R of x_now = R x + t.
Eigen::Matrix3d rotation_of(const DualQuaternion<double>& motion) {
    const Vec3<double> origin = apply(motion, Vec3<double>{0, 0, 0}),
                       axes[3] = {apply(motion, Vec3<double>{1, 0, 0}) - origin,
                                  apply(motion, Vec3<double>{0, 1, 0}) - origin,
                                  apply(motion, Vec3<double>{0, 0, 1}) - origin};
    Eigen::Matrix3d rotation;
    for (int k = 0; k < 3; ++k) rotation.col(k) = Eigen::Vector3d(axes[k].x, axes[k].y, axes[k].z);
    return rotation;
}

}  // namespace

Eigen::Vector3d PlanData::place(size_t point) const {
    const size_t vertex_count = vertices.size() / 3;
    if (point < vertex_count)
        return Eigen::Map<const Eigen::Vector3f>(&vertices[3 * point]).cast<double>();
    return Eigen::Map<const Eigen::Vector3d>(&targets[3 * (point - vertex_count)]);
}

PlacedPoint PlanData::at_rest(size_t point) const {
    if (is_deformed())
        return {Eigen::Map<const Eigen::Vector3d>(&deformed_places[3 * point]),
                symmetric_matrix(&deformed_covariances[6 * point])};
    const Eigen::Vector3d moved = pose * place(point);
    return {moved, target_covariance(covariance, moved)};
}

std::string PlanData::fault() const {
    if (vertices.size() % 3 != 0 || !all_finite(vertices)) return "a vertex is not finite";
    if (targets.size() % 3 != 0 || !all_finite(targets)) return "a target is not finite";
    const size_t points = point_count();
    if (points > PreparedTargets::kMaxTargets)
        return concat("there are ", points, " vertices and targets, at most ",
                      PreparedTargets::kMaxTargets, " expected");
    if (triangles.size() % 3 != 0) return "a triangle has no three vertices";
    const size_t vertex_count = vertices.size() / 3;
    for (const uint32_t vertex : triangles)
        if (vertex >= vertex_count)
            return concat("a triangle has vertex ", vertex, ", there are ", vertex_count);
    if (std::string found = fault_of_parts(parts, triangles.size() / 3); !found.empty())
        return found;
    if (std::string found = fault_of_target_names(target_names, targets.size() / 3); !found.empty())
        return found;
    if (std::string found = fault_of_pose(pose); !found.empty()) return found;
    if (std::string found = fault_of_covariance(covariance); !found.empty()) return found;
    if (std::string found = fault_of_deformed(*this); !found.empty()) return found;
    return fault_of_places(*this);
}

void add_registration_error(const Eigen::Matrix3d& rotation, const Eigen::Matrix3d& registration,
                            double* covariance) {
    const Eigen::Matrix3d turned = rotation * registration * rotation.transpose();
    const std::array<double, 6> values = symmetric_values(turned);
    for (size_t k = 0; k < values.size(); ++k) covariance[k] += values[k];
}

Plan::Plan(std::shared_ptr<const Template> surface, PlanData data)
    : surface_(std::move(surface)), data_(std::move(data)) {
    if (const std::string fault = data_.fault(); !fault.empty()) fail(DEFREC_ERROR_ARGUMENT, fault);
    for (size_t i = 0; i < point_count(); ++i) {
        const PlacedPoint point = data_.at_rest(i);
        at_rest_.insert(at_rest_.end(), point.place.begin(), point.place.end());
        error_mm_.push_back(error_of(point.covariance));
    }
    points_ = std::make_unique<const PreparedTargets>(surface_, at_rest_.data(), point_count());
}

void Plan::move(const Job& job, const PlanPointArrays& arrays) const {
    const FrameResult& result = job.surface_result();
    if (!result.surface->descends_from(*surface_))
        fail(DEFREC_ERROR_ARGUMENT, "the plan was made for another template");
    job.move_targets(*points_, arrays.xyz, arrays.covariance, arrays.status,
                     arrays.expected_error_mm);
    const auto add = [&](size_t i) {
        if (arrays.expected_error_mm != nullptr)  // a trace does not change by a rotation
            arrays.expected_error_mm[i] = std::hypot(arrays.expected_error_mm[i], error_mm_[i]);
        if (arrays.covariance == nullptr) return;
        const double* at_rest = &at_rest_[3 * i];
        add_registration_error(
            rotation_of(result.surface->motion_at(at_rest, result.motions.data())),
            data_.at_rest(i).covariance, arrays.covariance + 6 * i);
    };
    // Threads that help pay from some points on.
    constexpr size_t kFewest = 1024, kRun = 128;
    const std::shared_ptr<const Services> lent = job.services();
    helped_runs(point_count() >= kFewest ? lent->own_threads() : nullptr, point_count(), kRun,
                [&](size_t begin, size_t end) {
                    for (size_t i = begin; i < end; ++i) add(i);
                });
}

}  // namespace defrec
