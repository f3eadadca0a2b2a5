// Registration of a model that has changed its shape: rigid first, then deformed as an elastic body
// where the surface that is seen says how.
#pragma once
#include <memory>

#include "sdk/registration/elastic/force_modes.hpp"
#include "sdk/registration/surface_registration.hpp"

namespace defrec {

// As register_surface(), and then elastic. A deformation that is not taken leaves the rigid
// registration, with the reason and with errors that hold what may be hidden. deformation_mm: root
// mean square over the model's surface, the standard deviation that is expected beforehand. Throws
// what register_surface() throws, and Error(DEFREC_ERROR_ARGUMENT) for a model that is not
// the closed surface of one body.
Registration register_elastic(const ModelSurface& model, const SeenSurface& seen,
                              const SurfaceOptions& options, double deformation_mm,
                              const Services* helpers);

// The second step, of a rigid registration of this problem and the modes of its model.
Registration deformed(Registration rigid, const std::shared_ptr<const ForceModes>& modes,
                      const SurfaceProblem& problem, const SurfaceOptions& options,
                      double deformation_mm, const Services* helpers);

}  // namespace defrec
