// Linear isotropic elasticity of a cube with trilinear shape functions (Hughes, "The Finite Element
// Method", 1987, 4.4: selective reduced integration, so that nearly incompressible tissue does not
// lock).
#pragma once
#include <Eigen/Core>

namespace defrec {

using CubeStiffness = Eigen::Matrix<double, 24, 24>;

// Forces at the corners (x fastest, then y, then z; three components each) for displacements there,
// of a cube with edge 1 and Young's modulus 1; in proportion to either. poisson_ratio: below 0.5.
CubeStiffness cube_stiffness(double poisson_ratio);

}  // namespace defrec
