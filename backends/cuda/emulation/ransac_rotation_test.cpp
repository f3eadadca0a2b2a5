// The rotation nearest to a matrix, as kernels find it.
#include "backends/cuda/ransac_rotation.cuh"

#include "backends/definition/test_rotation.hpp"

TEST_CASE("a thread's nearest rotation is Kabsch's for every kind of matrix") {
    defrec::test::check_nearest_rotation([](const Eigen::Matrix3d& m) {
        float given[9];
        for (int i = 0; i < 9; ++i) given[i] = float(m(i / 3, i % 3));
        const defrec::cuda::Rotation got = defrec::cuda::nearest_rotation(given);
        Eigen::Matrix3d rotation;
        for (int i = 0; i < 9; ++i) rotation(i / 3, i % 3) = double(got.r[i]);
        return rotation;
    });
}
