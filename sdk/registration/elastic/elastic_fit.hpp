// Draws a model to points that were seen, as a rigid motion and an elastic deformation together,
// from one pose.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "sdk/registration/elastic/force_modes.hpp"
#include "sdk/registration/elastic/shape_posterior.hpp"
#include "sdk/registration/surface_matches.hpp"

namespace defrec {

class ElasticFit {
  public:
    // Its arguments outlive it.
    ElasticFit(const SurfaceProblem& problem, const ForceModes& modes, double deformation_mm,
               const Pose& start);

    // Until it rests; the posterior is that of the end.
    void run();

    const Pose& pose() const { return pose_; }
    const ShapePosterior& posterior() const { return posterior_; }
    const SurfaceMatches& matches() const { return matches_; }
    // By what the variance of independent points is multiplied, and how many of them share an
    // error.
    double variance_scale() const { return variance_scale_; }
    double correlated() const { return correlated_; }
    // xyz each, model frame.
    const std::vector<float>& vertices() const { return vertices_; }
    Eigen::VectorXd node_shifts() const { return modes_->node_shifts(posterior_.shape); }

    // Places of the model that were matched and count, at rest, spread over them.
    std::vector<Eigen::Vector3f> seen_at_rest() const;
    // Nearest places of every point in the end.
    SurfaceMatches match_all() const;

  private:
    void deform();
    ShapeEquations equations(double scale, double variance_scale) const;
    // Returns by how much it moves the surface where it is seen, root mean square, mm.
    double move(double scale, double variance_scale);
    // The matched place in the model at rest.
    Eigen::Vector3d at_rest(size_t match) const;
    void measure_errors();

    const SurfaceProblem* problem_;
    const ForceModes* modes_;
    double deformation_mm_;
    Pose pose_;
    std::vector<Lattice::Place> places_;  // of the vertices
    std::vector<float> vertices_;
    std::unique_ptr<const TriangleTree> tree_;
    SurfaceMatches matches_;
    ShapePosterior posterior_;
    double variance_scale_ = 1, correlated_ = 1;
};

}  // namespace defrec
