// The rotation nearest to a matrix, as ransac on the CPU finds it.
#include "backends/cpu/ransac_kernels.hpp"
#include "backends/definition/test_rotation.hpp"

TEST_CASE("the nearest rotation is Kabsch's for every kind of matrix") {
    defrec::test::check_nearest_rotation([](const Eigen::Matrix3d& m) {
        double given[9];
        for (int i = 0; i < 9; ++i) given[i] = m(i / 3, i % 3);
        float got[9];
        defrec::cpu::nearest_rotation(given, got);
        Eigen::Matrix3d rotation;
        for (int i = 0; i < 9; ++i) rotation(i / 3, i % 3) = double(got[i]);
        return rotation;
    });
}
