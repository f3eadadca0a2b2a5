// See unseen_piece.hpp.
#include "sdk/tracking/points/unseen_piece.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "sdk/body/deep_motion.hpp"
#include "sdk/tracking/decisions/unseen.hpp"

namespace defrec {
namespace {

using Decision = decisions::UnseenMotion;

class CellIndices {
  public:
    explicit CellIndices(const CellSet& cells) {
        for (size_t cell = 0; cell < cells.size(); ++cell)
            if (cells[cell]) indices_[count_++] = static_cast<Eigen::Index>(cell);
    }
    std::span<const Eigen::Index> all() const { return std::span(indices_).first(count_); }

  private:
    std::array<Eigen::Index, decisions::UnseenCells::kMaxCells> indices_;
    size_t count_ = 0;
};

// Errors of neighbouring vertices are alike: a mean of many is no better than each.
double noise_mm2(double error_mm2) {
    return Decision::kNoise * Decision::kNoise + Decision::kErrorShare * error_mm2;
}

}  // namespace

UnseenPiece::UnseenPiece(const Template& surface, size_t piece) : cells_(surface, piece) {
    variance_.assign(cells_.size(), 0);
    if (cells_.size() == 0) return;
    modes_ = {cells_.rest(), Decision::kLengthShare * cells_.view_width_mm()};
    learnt_.emplace(modes_);
    shaped_rest_.setConstant(3, cells_.rest().cols(), std::numeric_limits<double>::quiet_NaN());
    shapes_of_cells_.resize(cells_.rest().cols(), modes_.count());
    coefficients_.setZero(modes_.count(), 3);
}

void UnseenPiece::learn_from(const UnseenPiece& before) {
    if (before.cells_.size() == 0 || cells_.size() == 0) return;
    learnt_->learn_from(*before.learnt_, modes_, before.shapes(cells_.rest()),
                        before.modes_.spread());
    cells_.take_ages(before.cells_);
    all_frames_ = before.all_frames_;
}

void UnseenPiece::read(SurfaceSamples samples, const VertexConfidence& confidence) {
    lesson_ = Lesson::kNone;
    is_telling_ = cells_.read(samples, confidence);
    if (is_telling_) ++all_frames_;
}

bool UnseenPiece::solve_frame() {
    if (!is_telling_) return false;
    const bool is_as_before = solve_as_before();
    if (!is_as_before && !solve()) return false;
    lesson_ = is_as_before ? Lesson::kSolvedAsBefore : Lesson::kSolved;
    return true;
}

void UnseenPiece::skip_frame() {
    lesson_ = Lesson::kNone;
    if (!is_telling_) return;
    if (cells_.seen().rest.cols() == cells_.rest().cols())
        lesson_ = Lesson::kDirect;
    else if (all_frames_ % Decision::kLearnEvery == 0)
        lesson_ = Lesson::kSolve;
}

// Kriging gives what is seen where every cell is.
void UnseenPiece::learn_directly() {
    const UnseenCells::Seen& seen = cells_.seen();
    const Eigen::Isometry3d pose =
        fit_rigid(seen.rest, seen.now, Eigen::VectorXd::Ones(seen.rest.cols()));
    const Eigen::Matrix3Xd displacements = pose.inverse() * seen.now - seen.rest;
    const Eigen::VectorXd noise = seen.error_mm2.unaryExpr(&noise_mm2);
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(3 * modes_.count(), 3 * modes_.count());
    add_on_axes(modes_.at_cells().transpose() * noise.asDiagonal() * modes_.at_cells(), covariance);
    learnt_->learn(modes_.at_cells().transpose() * displacements.transpose(), covariance);
}

void UnseenPiece::find_shapes_seen() {
    const UnseenCells::Seen& seen = cells_.seen();
    shapes_seen_.resize(seen.rest.cols(), modes_.count());
    for (Eigen::Index k = 0; k < seen.rest.cols(); ++k) {
        const Eigen::Index cell = seen.cells[static_cast<size_t>(k)];
        if (shaped_rest_.col(cell) != seen.rest.col(k)) {
            shaped_rest_.col(cell) = seen.rest.col(k);
            shapes_of_cells_.row(cell) = shapes(seen.rest.col(k));
        }
        shapes_seen_.row(k) = shapes_of_cells_.row(cell);
    }
}

// A column for each cell, as it is where the cell was when it was weighed; 0 where it is not
// observed.
Eigen::Matrix3Xd UnseenPiece::displacements() const {
    const UnseenCells::Seen& seen = cells_.seen();
    Eigen::Matrix3Xd values = Eigen::Matrix3Xd::Zero(3, cells_.rest().cols());
    values(Eigen::all, cells_seen()) = pose_.inverse() * seen.now - seen.rest;
    return values - (shift_ * coefficients_).transpose();
}

// The cells' weights, 1/mm^2; 0 where a cell is not observed.
Eigen::VectorXd UnseenPiece::weights() const {
    // Means of parts of cells lie off the cells' means, and modes do not tell everything.
    const Eigen::VectorXd beside_modes =
        (1 - (shapes_seen_.cwiseAbs2() * modes_.spread()).array()).max(0.0).matrix();
    Eigen::VectorXd weight = Eigen::VectorXd::Zero(cells_.rest().cols());
    weight(cells_seen()) = (Decision::kStart * Decision::kStart * beside_modes +
                            cells_.seen().error_mm2.unaryExpr(&noise_mm2))
                               .cwiseInverse();
    return weight;
}

void UnseenPiece::weigh(const Eigen::VectorXd& weight) {
    const UnseenCells::Seen& seen = cells_.seen();
    centre_ = seen.rest.rowwise().mean();
    Eigen::MatrixXd shapes_of = modes_.at_cells();
    Eigen::Matrix3Xd places = cells_.rest();
    shapes_of(cells_seen(), Eigen::all) = shapes_seen_;
    places(Eigen::all, cells_seen()) = seen.rest;
    shift_.setZero(shapes_of.rows(), shapes_of.cols());
    kriging_.emplace(DisplacementModel(std::move(shapes_of), places.colwise() - centre_),
                     learnt_->information());
    kriging_->weigh(weight);
    whole_cells_ = {modes_.at_cells(), cells_.rest().colwise() - centre_};
    base_mm2_.setConstant(weight.size(), std::numeric_limits<double>::quiet_NaN());
}

void UnseenPiece::find() {
    displaced_ = displacements();
    found_ = kriging_->solve(displaced_);
}

// Cells that the others foretell otherwise, by what was found, are taken for as noisy as they seem.
// Returns the largest factor by which their noise grew.
double UnseenPiece::raise_noise() {
    kriging_->find_doubts();
    const Eigen::VectorXd surprises = kriging_->surprises(displaced_, found_);
    raise_ = raise_.cwiseProduct(surprises).cwiseMax(1.0);
    return surprises.maxCoeff();
}

bool UnseenPiece::solve() {
    is_reusable_ = false;
    find_shapes_seen();
    if (raise_.size() > 0) {
        const std::optional<double> largest = solve_with_noise_before();
        if (largest && *largest < Decision::kSurprise) return true;
    }
    const Eigen::VectorXd weight = weights();
    raise_.setOnes(weight.size());
    weigh(weight);
    fit_pose();
    // A cell that stands out hides another one from the first round.
    for (int round = 0; round < Decision::kRaises; ++round) {
        find();
        const double largest = raise_noise();
        kriging_->weigh(weight.cwiseQuotient(raise_));
        if (largest < Decision::kStandsOut) break;
    }
    return estimate();
}

// How noisy the cells seem now is for the next frame. Returns raise_noise(), if the numbers do.
std::optional<double> UnseenPiece::solve_with_noise_before() {
    weigh(weights().cwiseQuotient(raise_));
    if (!estimate()) return std::nullopt;
    return raise_noise();
}

void UnseenPiece::fit_pose() {
    const UnseenCells::Seen& seen = cells_.seen();
    pose_ = fit_rigid(seen.rest, seen.now, Eigen::VectorXd::Ones(seen.rest.cols()));
}

bool UnseenPiece::estimate() {
    fit_pose();
    for (int round = 0; round < 2; ++round) {
        find();
        pose_ = pose_ * Eigen::Translation3d(centre_) * as_motion(found_.motion) *
                Eigen::Translation3d(-centre_);
        coefficients_ = found_.coefficients;
    }
    find();
    coefficients_ = found_.coefficients;
    return coefficients_.allFinite() && pose_.matrix().allFinite();
}

// Gives cells that are observed otherwise other weights; false: they are too many.
bool UnseenPiece::change_weights() {
    find_shapes_seen();
    shift_.setZero();
    shift_(cells_seen(), Eigen::all) = shapes_seen_ - kriging_->shapes()(cells_seen(), Eigen::all);
    const Eigen::VectorXd weight = weights().cwiseQuotient(raise_);
    std::array<Eigen::Index, Decision::kMaxChanges> changed;
    size_t count = 0;
    for (Eigen::Index cell = 0; cell < weight.size(); ++cell) {
        const double before = kriging_->weight()[cell];
        if (weight[cell] * Decision::kNoiseRatio >= before && (before > 0 || weight[cell] <= 0))
            continue;
        if (count == Decision::kMaxChanges) return false;
        changed[count++] = cell;
    }
    kriging_->change(std::span(changed).first(count), weight);
    return true;
}

bool UnseenPiece::solve_as_before() {
    if (!std::exchange(is_reusable_, false) || !change_weights() || !estimate()) return false;
    return kriging_->surprises(displaced_, found_).maxCoeff() < Decision::kSurprise;
}

void UnseenPiece::find_base_variances(const CellSet& cells) {
    CellSet missing;
    for (size_t cell = 0; cell < cells_.size(); ++cell)
        missing[cell] = cells[cell] && std::isnan(base_mm2_[static_cast<Eigen::Index>(cell)]);
    const CellIndices indices(missing);
    base_mm2_(indices.all()) = kriging_->variances(whole_cells_.part(indices.all()));
}

void UnseenPiece::find_variances(const CellSet& cells) {
    asked_ = cells;
    find_base_variances(cells);
    const CellIndices indices(cells);
    const std::span<const Eigen::Index> asked = indices.all();
    const Eigen::VectorXd lessened = kriging_->lessened(whole_cells_.part(asked));
    for (size_t k = 0; k < asked.size(); ++k)
        variance_[static_cast<size_t>(asked[k])] =
            Decision::kVarianceShare *
                (base_mm2_[asked[k]] - lessened[static_cast<Eigen::Index>(k)]) +
            unseen_mm2(asked[k]);
}

void UnseenPiece::learn() {
    const Lesson lesson = std::exchange(lesson_, Lesson::kNone);
    if (lesson == Lesson::kNone) return;
    if (lesson == Lesson::kDirect) return learn_directly();
    // Coefficients by another frame's weights place tissue well enough, but are no lesson: errors
    // would add up.
    if (lesson == Lesson::kSolve && !solve()) return;
    if (lesson == Lesson::kSolvedAsBefore && !solve_with_noise_before()) return;
    kriging_->find_covariance();
    learnt_->learn(coefficients_, kriging_->covariance());
    if (lesson == Lesson::kSolve) return;
    // For the next frame and the next lesson.
    is_reusable_ = true;
    kriging_->find_doubts();
    learnt_->information();
    find_base_variances(asked_);
}

// Variance of motion that a cell has for itself: since it was seen, and far from what is seen.
double UnseenPiece::unseen_mm2(Eigen::Index cell) const {
    const Eigen::Matrix3Xd& seen = cells_.seen().rest;
    const double nearest = std::sqrt(
                     (seen.colwise() - cells_.rest().col(cell)).colwise().squaredNorm().minCoeff()),
                 far = std::clamp((nearest - cells_.apart_mm() / 2) / Decision::kFar, 0.0, 1.0),
                 unseen = std::min(cells_.age(cell), Decision::kLong);
    return Decision::kMost * Decision::kMost * far * far * unseen / Decision::kLong;
}

Eigen::Vector3d UnseenPiece::place(const Eigen::Vector3d& at_rest,
                                   const Eigen::Ref<const Eigen::VectorXd>& shapes) const {
    return pose_ * (at_rest + coefficients_.transpose() * shapes.head(coefficients_.rows()));
}

}  // namespace defrec
