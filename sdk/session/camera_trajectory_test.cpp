// The bytes of trajectory.txt.
#include "sdk/session/camera_trajectory.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

TEST_CASE("a pose is the inverse of the tissue's motion, in metres and seconds") {
    // The tissue turns by 90 degrees about z, and is then 80 mm in front and 2 mm aside.
    const double motion[] = {0, -1, 0, 2, 1, 0, 0, 0, 0, 0, 1, 80};
    defrec_result result{};
    std::copy(std::begin(motion), std::end(motion), result.rigid_motion);
    CameraTrajectory trajectory;
    trajectory.add(33.3333, result);
    // Half a turn about x, of which qw is 0.
    const double half[] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0};
    std::copy(std::begin(half), std::end(half), result.rigid_motion);
    trajectory.add(1500, result);
    const TestFolder folder;
    trajectory.write(folder / "trajectory.txt");
    CHECK(TestFolder::read(folder / "trajectory.txt") ==
          "# left rectified camera in the template frame, s and m\n"
          "# timestamp tx ty tz qx qy qz qw\n"
          "0.033333 0.0000000 0.0020000 -0.0800000 0.000000000 0.000000000 -0.707106781 "
          "0.707106781\n"
          "1.500000 0.0000000 0.0000000 0.0000000 1.000000000 0.000000000 0.000000000 "
          "0.000000000\n");
    CHECK_THROWS_AS(trajectory.write(folder / "absent/trajectory.txt"), defrec::FileError);
}
