// Draws a model's surface to points that were seen: point to plane, from one start.
#pragma once
#include <cstddef>
#include <vector>

#include "sdk/registration/pose.hpp"
#include "sdk/registration/surface_matches.hpp"

namespace defrec {

class SurfaceFit {
  public:
    // The problem outlives the fit. step: every so many points are compared.
    SurfaceFit(const SurfaceProblem& problem, const Pose& start, size_t step);

    // Widely: every point pulls, those that are far away less and less.
    void approach();
    // Finely: least squares with Tukey's weights by the points' errors. Until it rests.
    void refine();

    const Pose& pose() const { return pose_; }
    // Mean of Geman and McClure's function of approach()'s last width, 0..1.
    double wide_cost() const;
    const SurfaceMatches& matches() const { return matches_; }

  private:
    // A step of least squares with these weights, divided by the squared errors where is_fine;
    // returns by how far it moves the points, mm.
    double move(const std::vector<double>& weights, double damping, bool is_fine);

    Pose pose_;
    SurfaceMatches matches_;  // of every step-th point
};

}  // namespace defrec
