// The bytes of the files that `defrec track` writes.
#include "sdk/session/track_outputs.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <locale>

#include "include/defrec_c.h"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

TEST_CASE(
    "row 11: points.csv has fixed decimals whatever the locale, and empty fields for lost points") {
    struct Comma : std::numpunct<char> {
        char do_decimal_point() const override { return ','; }
    };
    const std::locale before = std::locale::global(std::locale(std::locale(), new Comma));
    const TestFolder folder;
    PointsFile file(folder / "points.csv");
    file.add({3,
              100,
              7,
              PointStatus::kTracked,
              {-1.23456, -0.00001, 80},
              {12.5, 0.0625},
              0.25,
              {0.0125, -0.0012345, -1e-9, 0.01, 0, 0.04},
              DEFREC_EVIDENCE_DEPTH | DEFREC_EVIDENCE_PHOTOMETRIC,
              2});
    file.add({3,
              100,
              8,
              PointStatus::kExtrapolated,
              {1, 2, 3},
              {1, 2},
              1.5,
              {0.75, 0, 0, 0.75, 0, 0.75},
              0,
              0});
    file.add({3, 100, 9, PointStatus::kLost, {1, 2, 3}, {1, 2}, 1.5, {1, 0, 0, 1, 0, 1}, 1, 0});
    file.commit();
    std::locale::global(before);
    CHECK(TestFolder::read(folder / "points.csv") ==
          "frame,timestamp_ms,id,x,y,z,u,v,status,expected_error_mm,xx,xy,xz,yy,yz,zz,evidence,"
          "piece\n"
          "3,100.000,7,-1.2346,0.0000,80.0000,12.500,0.062,tracked,0.2500,"
          "0.012500,-0.001234,0.000000,0.010000,0.000000,0.040000,both,2\n"
          "3,100.000,8,1.0000,2.0000,3.0000,1.000,2.000,extrapolated,1.5000,"
          "0.750000,0.000000,0.000000,0.750000,0.000000,0.750000,none,0\n"
          "3,100.000,9,,,,,,lost,,,,,,,,,\n");
    CHECK(evidence_name(DEFREC_EVIDENCE_DEPTH) == std::string("depth"));
    CHECK(evidence_name(DEFREC_EVIDENCE_PHOTOMETRIC) == std::string("photometric"));
}

TEST_CASE("frames.csv has a column for each stage that ran in any frame, its runs added up") {
    FrameRow first, second;
    first.state = "tracking";
    first.stage_ms = {{"stereo", 1.5}, {"align", 1}, {"align", 0.25}};
    first.features = 900;
    first.view_lag_frames = -0.5;
    first.vertical_offset_px = 2.25;
    first.roll_deg = 0.3;
    first.focal_ratio = 1.00125;
    first.rig_matches = 321;
    second.frame = 1;
    second.state = "lost";
    second.reasons = "dark|no-depth";
    second.faulty_views = "both";
    second.mean_residual_mm = std::numeric_limits<double>::quiet_NaN();
    second.stage_ms = {{"stereo", 2}, {"lm fine", 3}};
    const TestFolder folder;
    FrameLog frames;
    frames.add(first);
    frames.add(second);
    write_frames(folder / "frames.csv", frames);
    CHECK(
        TestFolder::read(folder / "frames.csv") ==
        "frame,timestamp_ms,state,reasons,faulty_views,epoch,age,features,matches,inliers,patches,"
        "observed_share,mean_residual_mm,view_lag_frames,vertical_offset_px,roll_deg,"
        "focal_ratio,rig_matches,frame_ms,stereo_ms,align_ms,lm_fine_ms\n"
        "0,0.000,tracking,,,0,0,900,0,0,0,0.0000,0.0000,-0.5000,2.2500,0.3000,1.0012,321,0.000,"
        "1.500,1.250,0.000\n"
        "1,0.000,lost,dark|no-depth,both,0,0,0,0,0,0,0.0000,,0.0000,0.0000,0.0000,1.0000,0,0.000,"
        "2.000,0.000,3.000\n");
}

TEST_CASE("a PLY file holds what its header says") {
    const float vertices[] = {0, 0, 80, 1, 0, 80, 0, 1, 80};
    const float normals[] = {0, 0, -1, 0, 0, -1, 0, 0, -1};
    const std::uint8_t status[] = {0, 1, 2};
    const float errors[] = {0.5F, 1, 2};
    const std::uint32_t triangles[] = {0, 2, 1};
    const TestFolder folder;
    write_ply(folder / "mesh.ply", {vertices, normals, status, errors, 3, triangles, 1});
    const std::string bytes = TestFolder::read(folder / "mesh.ply");
    const std::size_t header = bytes.find("end_header\n") + 11;
    CHECK(bytes.find("element vertex 3\n") != std::string::npos);
    CHECK(bytes.find("element face 1\n") != std::string::npos);
    CHECK(bytes.size() - header == 3 * (6 * 4 + 1 + 4) + 1 + 3 * 4);
    write_ply(folder / "plain.ply", {vertices, nullptr, nullptr, nullptr, 3, triangles, 1});
    const std::string plain = TestFolder::read(folder / "plain.ply");
    CHECK(plain.size() - plain.find("end_header\n") - 11 == 3 * 12 + 13);
}
