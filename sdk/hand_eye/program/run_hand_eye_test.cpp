// `defrec handeye`: files in, file out, verdicts and exit codes.
#include "sdk/hand_eye/program/run_hand_eye.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "sdk/hand_eye/test_motion.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"
#include "sdk/io/text.hpp"

using namespace defrec;
using namespace defrec::cli;

namespace {

constexpr const char* kHeader = "time_s,x,y,z,qx,qy,qz,qw\n";

// unit: mm of a length in the file
std::string lines(const std::vector<TimedPose>& poses, char separator, double unit) {
    std::string text;
    for (const TimedPose& pose : poses) {
        const Eigen::Quaterniond turn(pose.pose.linear());
        const Eigen::Vector3d place = pose.pose.translation() / unit;
        append_fixed(text, pose.time_s, 6);
        for (const double value :
             {place.x(), place.y(), place.z(), turn.x(), turn.y(), turn.z(), turn.w()}) {
            text += separator;
            append_fixed(text, value, 9);
        }
        text += '\n';
    }
    return text;
}

std::string csv(const std::vector<TimedPose>& poses) { return kHeader + lines(poses, ',', 1); }

struct Files {
    TestFolder folder;
    TestPoses still, moving;
    Files() {
        TestRandom random(1);
        still = still_poses({}, 12, 60, {0.1, 0.05}, random);
        moving = moving_poses({}, 20, 0.25, {0.2, 0.1}, random);
    }
    HandEyeCommand command(const TestPoses& poses) const {
        HandEyeCommand made;
        made.camera_poses = folder.write("camera.csv", csv(poses.camera));
        made.tracker_poses = folder.write("tracker.csv", csv(poses.tracker));
        made.out = folder / "hand_eye.json";
        made.quiet = true;
        return made;
    }
    nlohmann::json result() const {
        return nlohmann::json::parse(TestFolder::read(folder / "hand_eye.json"));
    }
};

const Files& files() {
    static const Files made;
    return made;
}

double place(const nlohmann::json& result, std::size_t row) {
    return result["marker_from_camera"][row][3];
}

}  // namespace

TEST_CASE("poses in pairs: hand_eye.json has the transform, exit code 0") {
    HandEyeCommand command = files().command(files().still);
    command.is_paired = true;
    CHECK(run_hand_eye(command) == 0);
    const nlohmann::json result = files().result();
    const TestSetup setup;
    CHECK(result["verdict"] == "solved");
    for (std::size_t row = 0; row < 3; ++row)
        CHECK(std::abs(place(result, row) -
                       setup.truth.marker_from_camera.translation()[static_cast<int>(row)]) < 1);
    CHECK(result["covariance"].size() == 6);
    CHECK(result["poses"].size() == 12);
    CHECK(result["offset"]["estimated"] == false);
}

TEST_CASE("streams: TUM in metres and CSV in mm, the offset, and notes of the units") {
    HandEyeCommand command = files().command(files().moving);
    command.camera_poses = files().folder.write(
        "camera.txt", "# time x y z qx qy qz qw\n" + lines(files().moving.camera, ' ', 1000));
    CHECK(run_hand_eye(command) == 0);
    const nlohmann::json result = files().result();
    CHECK(std::abs(static_cast<double>(result["offset"]["offset_s"]) - 0.25) < 0.005);
    CHECK(std::abs(place(result, 2) - 250) < 1);
    CHECK_SAYS(result["notes"][0].get<std::string>(),
               "a TUM trajectory; lengths were taken to be in m");
    CHECK_SAYS(result["notes"][1].get<std::string>(), "lengths were taken to be in mm");
    // The same in centimetres, stated.
    command.camera_poses =
        files().folder.write("camera.txt", lines(files().moving.camera, '\t', 10));
    command.camera_unit = PoseUnit::kCentimetre;
    CHECK(run_hand_eye(command) == 0);
    CHECK(files().result()["notes"].size() == 1);
}

TEST_CASE("row 183: exit code 9 where it is refused; inverted files are read on request") {
    TestPoses poses = files().still;
    for (TimedPose& pose : poses.camera) pose.pose = pose.pose.inverse();
    HandEyeCommand command = files().command(poses);
    command.is_paired = true;
    CHECK(run_hand_eye(command) == 9);
    CHECK(files().result()["verdict"] == "failed");
    command.is_camera_inverted = true;
    CHECK(run_hand_eye(command) == 0);

    poses.camera.resize(2);
    poses.tracker.resize(2);
    command = files().command(poses);
    command.is_paired = true;
    CHECK(run_hand_eye(command) == 9);
    CHECK(files().result()["marker_from_camera"].is_null());
}

TEST_CASE("row 186: files that are refused, each with its line") {
    HandEyeCommand command = files().command(files().still);
    const auto refused = [&](const std::string& text) {
        command.camera_poses = files().folder.write("bad.csv", text);
        return refusal_of([&] { run_hand_eye(command); });
    };
    std::filesystem::remove(files().folder / "hand_eye.json");
    CHECK_SAYS(refused(std::string(kHeader) + "0,1,2,nan,0,0,0,1\n"), "bad.csv:2: z: 'nan'");
    CHECK_SAYS(refused(std::string(kHeader) + "0,1,2,3,0,0,0.1,1\n"),
               "bad.csv:2: qx,qy,qz,qw is no rotation: its length is 1.0050");
    CHECK_SAYS(refused(std::string(kHeader) + "1,1,2,3,0,0,0,1\n1,1,2,3,0,0,0,1\n"),
               "bad.csv:3: the time 1.000000 s is not after");
    CHECK_SAYS(refused("0 1 2 3 0 0 0 1\n# a comment\n1 1 2 3 0 0 0\n"),
               "bad.csv:3: the line has 7 numbers, expected 8");
    CHECK_SAYS(refused("0 1 2 x 0 0 0 1\n"), "bad.csv:1: z: 'x' is not a finite number");
    CHECK_SAYS(refused("time_s,x,y,z,qx,qy,qz\n"), "has no column 'qw'");
    CHECK_SAYS(refused(kHeader), "there are no poses");
    CHECK_SAYS(refused(""), "the file is empty");
    command.is_paired = true;
    CHECK_SAYS(refused(std::string(kHeader) + "1,1,2,3,0,0,0,1\n0,1,2,3,0,0,0,1\n"),
               "2 poses of the camera and 12 of the tracker were given");
    CHECK_FALSE(std::filesystem::exists(files().folder / "hand_eye.json"));
}

TEST_CASE("exit code 2: options that do not fit together, an output that is an input") {
    const auto usage = [](const HandEyeCommand& command) -> std::string {
        try {
            run_hand_eye(command);
        } catch (const CliError& error) {
            CHECK(error.code() == ExitCode::kUsage);
            return error.what();
        }
        return "accepted";
    };
    HandEyeCommand command = files().command(files().still);
    command.camera_error_mm = 0.1;
    CHECK_SAYS(usage(command), "errors are stated of both files");
    command = files().command(files().still);
    command.is_paired = true;
    command.offset_s = 0;
    CHECK_SAYS(usage(command), "poses in pairs have no offset");
    command.is_paired = false;
    command.max_offset_s = 1;
    CHECK_SAYS(usage(command), "give either --offset or --max-offset");
    command = files().command(files().still);
    command.out = command.tracker_poses;
    CHECK(usage(command) != "accepted");
}
