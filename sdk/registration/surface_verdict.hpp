// Verdict on a pose by the points of a surface that are matched: errors that they share, what fits,
// and whether the registration may be used.
#pragma once
#include "sdk/registration/registration.hpp"
#include "sdk/registration/surface_matches.hpp"

namespace defrec {

// The model's own error is one for all points of a part of the surface, so that more points do not
// lessen it: the factor that it gives for the variance of independent points.
double model_share(const SurfaceMatches& matches);

// How many neighbours share an error (design_effect()) of the residuals in units of `scale`.
double residual_correlation(const SurfaceMatches& matches, double scale);

// The motion that moves the points along their normals by the least share counts as open below it:
// facets turn normals by about half the angle between them.
double least_open_share(const ModelSurface& model);

// The points' residuals and their summary; scale, correlated: of the matches. all: those of every
// point, of the same pose and shape.
void tell_residuals(const SurfaceMatches& matches, const SurfaceMatches& all, double correlated,
                    const SurfaceOptions& options, Registration& result);

// Verdict and reason, by the residuals, free motions and alternatives that the result has.
void judge(const SurfaceOptions& options, double worst_mm, Registration& result);

}  // namespace defrec
