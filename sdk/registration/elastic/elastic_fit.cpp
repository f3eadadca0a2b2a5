// See elastic_fit.hpp. Iterated closest points, point to plane, as the rigid fit, with the shape's
// prior as a further term (as Rucker et al., A Mechanics-Based Nonrigid Registration Method for
// Liver Surgery Using Sparse Intraoperative Data, IEEE Trans. Med. Imaging 33, 2014). As long as
// the residuals are larger than the errors explain, all points count less in proportion, so that
// the stiffest shapes go first.
#include "sdk/registration/elastic/elastic_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdk/registration/decisions.hpp"
#include "sdk/registration/surface_verdict.hpp"

namespace defrec {
namespace {

Eigen::Vector3d vertex_of(std::span<const float> vertices, uint32_t index) {
    return Eigen::Map<const Eigen::Vector3f>(&vertices[3 * size_t{index}]).cast<double>();
}

}  // namespace

ElasticFit::ElasticFit(const SurfaceProblem& problem, const ForceModes& modes,
                       double deformation_mm, const Pose& start)
    : problem_(&problem),
      modes_(&modes),
      deformation_mm_(deformation_mm),
      pose_(start),
      matches_(problem, problem.step_for(decisions::SurfaceSearch::kMaxPoints)) {
    const size_t count = problem.model.vertices().size() / 3;
    places_.reserve(count);
    for (uint32_t i = 0; i < count; ++i)
        places_.push_back(modes.find(vertex_of(problem.model.vertices(), i)));
    posterior_.shape = Eigen::VectorXd::Zero(modes.count());
    deform();
}

void ElasticFit::deform() {
    const std::span<const float> rest = problem_->model.vertices();
    vertices_.assign(rest.begin(), rest.end());
    const Eigen::VectorXd shifts = node_shifts();
    for (size_t i = 0; i < places_.size(); ++i)
        Eigen::Map<Eigen::Vector3f>(&vertices_[3 * i]) +=
            modes_->shift(places_[i], shifts).cast<float>();
    tree_ = std::make_unique<const TriangleTree>(vertices_, problem_->model.triangles());
    matches_.find(*tree_, pose_);
}

Eigen::Vector3d ElasticFit::at_rest(size_t match) const {
    const Eigen::Vector3d place = pose_.inverse() * matches_.all[match].place;
    const uint32_t* corner = &problem_->model.triangles()[3 * size_t{matches_.triangle[match]}];
    const Eigen::Vector3d a = vertex_of(vertices_, corner[0]);
    Eigen::Matrix<double, 3, 2> sides;
    sides << vertex_of(vertices_, corner[1]) - a, vertex_of(vertices_, corner[2]) - a;
    const Eigen::Vector2d share =
        (sides.transpose() * sides).ldlt().solve(sides.transpose() * (place - a));
    const std::span<const float> rest = problem_->model.vertices();
    return (1 - share.sum()) * vertex_of(rest, corner[0]) + share[0] * vertex_of(rest, corner[1]) +
           share[1] * vertex_of(rest, corner[2]);
}

ShapeEquations ElasticFit::equations(double scale, double variance_scale) const {
    const std::vector<double> weights = matches_.weights(scale);
    const auto count = static_cast<Eigen::Index>(
        std::count_if(weights.begin(), weights.end(), [](double weight) { return weight > 0; }));
    const Eigen::Index modes = modes_->count();
    ShapeEquations made(modes);
    if (count == 0) return made;  // rankUpdate() divides by the number of rows
    // In units of the errors.
    Eigen::MatrixXd rows(count, 6 + modes);
    Eigen::VectorXd values(count);
    Eigen::Index row = 0;
    for (size_t i = 0; i < weights.size(); ++i) {
        if (weights[i] == 0) continue;
        const SurfaceMatch& match = matches_.all[i];
        const double root = std::sqrt(weights[i] / variance_scale) / match.expected;
        const Eigen::RowVectorXd by_shape =
            (pose_.rotation.transpose() * match.normal).transpose() * modes_->at(at_rest(i));
        rows.row(row).head<6>() = root * matches_.gradient(match).transpose();
        rows.row(row).tail(modes) = root * by_shape;
        values[row] = root * (match.residual + by_shape.dot(posterior_.shape));
        ++row;
    }
    const auto by_motion = rows.leftCols<6>();
    const auto by_shape = rows.rightCols(modes);
    made.motion = by_motion.transpose() * by_motion;
    made.motion.diagonal().array() += decisions::ElasticFit::kDamping * made.motion.trace();
    made.cross = by_motion.transpose() * by_shape;
    made.shape.selfadjointView<Eigen::Lower>().rankUpdate(by_shape.transpose());
    made.shape.triangularView<Eigen::StrictlyUpper>() = made.shape.transpose();
    made.motion_right = by_motion.transpose() * values;
    made.shape_right = by_shape.transpose() * values;
    return made;
}

double ElasticFit::move(double scale, double variance_scale) {
    posterior_ =
        posterior_of(equations(scale, variance_scale), modes_->stiffness(), deformation_mm_);
    Twist twist = posterior_.motion;
    twist.head<3>() /= problem_->length;
    pose_ = moved(pose_, twist, problem_->centre);
    std::vector<Eigen::Vector3d> before;
    for (const SurfaceMatch& match : matches_.all) before.push_back(match.place);
    deform();
    double squared = 0;
    for (size_t i = 0; i < before.size(); ++i) {
        const double along = matches_.all[i].normal.dot(matches_.all[i].place - before[i]);
        squared += along * along;
    }
    return std::sqrt(squared / static_cast<double>(before.size()));
}

void ElasticFit::measure_errors() {
    const double scale = matches_.robust_scale();
    double whole = 0;
    const PoseInformation information =
        matches_.information(scale, Twist::RowsAtCompileTime, whole);
    correlated_ = residual_correlation(matches_, scale);
    variance_scale_ = std::max(information.variance_scale * correlated_, model_share(matches_));
}

void ElasticFit::run() {
    using decisions::ElasticFit;
    // Parts of the surface that are as large as those of the model's error count as one point each.
    const double area = 2 * std::numbers::pi * problem_->length * problem_->length;
    constexpr double kPart = decisions::SurfaceSearch::kModelErrorLength;
    const double shared =
        std::max(1.0, static_cast<double>(matches_.all.size()) * kPart * kPart / area);
    for (int round = 0; round < ElasticFit::kMaxRounds; ++round) {
        const double scale = matches_.robust_scale();
        const double errors = std::max(scale, 1.0);
        if (move(scale, errors * errors * shared) < ElasticFit::kRest) break;
    }
    for (int round = 0; round < ElasticFit::kFinalRounds; ++round) {
        measure_errors();
        move(matches_.robust_scale(), variance_scale_);
    }
}

std::vector<Eigen::Vector3f> ElasticFit::seen_at_rest() const {
    const std::vector<double> weights = matches_.weights(matches_.robust_scale());
    const size_t step = weights.size() / decisions::ElasticFit::kSeenPlaces + 1;
    std::vector<Eigen::Vector3f> places;
    for (size_t i = 0; i < weights.size(); i += step)
        if (weights[i] > 0) places.push_back(at_rest(i).cast<float>());
    return places;
}

SurfaceMatches ElasticFit::match_all() const {
    SurfaceMatches all(*problem_, 1);
    all.find(*tree_, pose_);
    return all;
}

}  // namespace defrec
