// `defrec register`: files in, files out, verdicts and exit codes.
#include "sdk/registration/program/run_register.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <string>

#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"
#include "sdk/registration/elastic/test_deformations.hpp"
#include "sdk/registration/program/inputs.hpp"
#include "sdk/registration/program/test_inputs.hpp"
#include "sdk/registration/test_organ.hpp"

using namespace defrec;
using namespace defrec::cli;

namespace {

std::string csv_of(const Pose& pose) {
    std::string text = "x,y,z,t\n";
    for (int i = 0; i < 3; ++i)
        text += row(
            {pose.rotation(i, 0), pose.rotation(i, 1), pose.rotation(i, 2), pose.translation[i]});
    return text;
}

// An organ, what a camera sees of it, and a start; once for all cases.
struct Scene {
    TestFolder folder;
    Pose truth;
    std::string model, surface, start;

    Scene() {
        std::mt19937 random(11);
        const TestMesh mesh = organ_mesh(4);
        truth = organ_pose(random, 110, 0.3);
        const TestView view = TestCamera(mesh, truth, {}).view(mesh, random);
        std::string text = obj_of(mesh);
        text += "g tumour\nv 10 0 -20\nv 16 0 -20\nv 10 6 -20\nf -3 -2 -1\n";
        model = folder.write("liver.obj", text);
        text = "x,y,z,xx,xy,xz,yy,yz,zz,status\n";
        for (std::size_t i = 0; i < view.places.size() / 3; ++i) {
            const float *p = &view.places[3 * i], *c = &view.covariances[6 * i];
            std::string line = row({p[0], p[1], p[2], c[0], c[1], c[2], c[3], c[4], c[5]});
            line.back() = ',';
            text += line + (i % 50 == 7 ? "lost\n" : "tracked\n");
        }
        surface = folder.write("surface.csv", text);
        start = folder.write("start.csv", csv_of(off_by(truth, {0, 0, 0}, 0.3, 15, random)));
    }
    RegisterOptions options(const std::string& out) const {
        RegisterOptions made;
        made.model = model;
        made.part = "liver";
        made.surface = surface;
        made.start = start;
        made.out = folder / out;
        made.quiet = true;
        return made;
    }
    nlohmann::json result(const std::string& out) const {
        return nlohmann::json::parse(TestFolder::read(folder / out + "/registration.json"));
    }
};

const Scene& scene() {
    static const Scene made;
    return made;
}

// Every pair that follows from the truth, but for the last so many.
std::string pairs_csv(const Pose& pose, int left_out, double shift_of_last = 0) {
    std::string text = "id,model_x,model_y,model_z,x,y,z,error_mm\n";
    const double places[5][3] = {
        {0, 0, -50}, {60, 10, -30}, {-40, 30, -35}, {10, -45, -20}, {-70, -10, -20}};
    for (int i = 0; i < 5 - left_out; ++i) {
        const Eigen::Vector3d model(places[i][0], places[i][1], places[i][2]);
        Eigen::Vector3d seen = pose * model;
        if (i == 4 - left_out) seen.x() += shift_of_last;
        text.append(std::to_string(i + 1)).append(",");
        text += row({model.x(), model.y(), model.z(), seen.x(), seen.y(), seen.z(), 0.5});
    }
    return text;
}

double off(const nlohmann::json& result, const Pose& truth, const Eigen::Vector3d& place) {
    Eigen::Vector3d found;
    for (std::size_t i = 0; i < 3; ++i)
        found[static_cast<int>(i)] = result["transform"][i][0].get<double>() * place.x() +
                                     result["transform"][i][1].get<double>() * place.y() +
                                     result["transform"][i][2].get<double>() * place.z() +
                                     result["transform"][i][3].get<double>();
    return (found - truth * place).norm();
}

std::string usage_of(const RegisterOptions& options) {
    try {
        run_register(options);
    } catch (const CliError& error) {
        CHECK(error.code() == ExitCode::kUsage);
        return error.what();
    }
    return "accepted";
}

}  // namespace

TEST_CASE("a surface is registered: transform, covariance, targets, picture, exit code 0") {
    RegisterOptions options = scene().options("surface");
    options.targets =
        scene().folder.write("targets.csv", "id,x,y,z,name\n7,5,5,-15,\n8,1,2,-9,tumour centre\n");
    CHECK(run_register(options) == 0);
    const auto result = scene().result("surface");
    CHECK(result["verdict"] == "registered");
    CHECK(off(result, scene().truth, {0, 0, 0}) < 1);
    REQUIRE(result["targets"].size() == 3);
    CHECK(result["targets"][2]["name"] == "tumour centre");
    CHECK(result["targets"][0]["name"] == "tumour");
    CHECK(result["targets"][0]["model"][0].get<double>() == doctest::Approx(12));
    CHECK(result["targets"][1]["name"] == "7");
    double trace = 0;
    for (std::size_t i = 0; i < 3; ++i)
        trace += result["targets"][1]["covariance_mm2"][i][i].get<double>();
    CHECK(result["targets"][1]["expected_error_mm"].get<double>() ==
          doctest::Approx(std::sqrt(trace)));
    CHECK(result["covariance"].size() == 6);
    CHECK(result["undetermined"].empty());
    CHECK(result["residuals"]["inlier_share"].get<double>() > 0.8);
    CHECK(result["notes"].dump().find("were not observed and were left out") != std::string::npos);
    const cv::Mat picture = cv::imread(scene().folder / "surface/registration.png");
    REQUIRE_FALSE(picture.empty());
    // Points on the surface are pale red and blue, outliers black, the model gray.
    int red = 0, blue = 0, black = 0;
    for (int y = 0; y < picture.rows; ++y)
        for (int x = 0; x < picture.cols; ++x) {
            const auto pixel = picture.at<cv::Vec3b>(y, x);
            red += pixel[2] > pixel[0] + 30;
            blue += pixel[0] > pixel[2] + 30;
            black += pixel[0] + pixel[1] + pixel[2] < 30;
        }
    CHECK(red > 1000);
    CHECK(blue > 1000);
    CHECK(black > 200);

    // The result is a start.
    options.start = scene().folder / "surface/registration.json";
    options.out = scene().folder / "again";
    CHECK(run_register(options) == 0);
    CHECK(off(scene().result("again"), scene().truth, {0, 0, 0}) < 1);
}

TEST_CASE("--deform: the organ that bent is deformed, with its model and targets as files") {
    const TestMesh mesh = organ_mesh(4);
    std::mt19937 random(21);
    const Displaced by = deformation_of(TestDeformation::kTwisted, mesh, 12, random);
    const Pose truth = organ_pose(random, 140, 0.2);
    const TestView view = TestCamera(displaced(mesh, by), truth, {}).view(mesh, random);
    std::string text = "x,y,z\n";
    for (std::size_t i = 0; i < view.places.size(); i += 3)
        text += row({view.places[i], view.places[i + 1], view.places[i + 2]});
    RegisterOptions options = scene().options("deformed");
    options.surface = scene().folder.write("twisted.csv", text);
    options.start =
        scene().folder.write("twisted_start.csv", csv_of(off_by(truth, {0, 0, 0}, 0.1, 5, random)));
    options.targets = scene().folder.write("deep.csv", "id,x,y,z\n7,60,0,-20\n");
    options.is_deformed = true;
    CHECK(run_register(options) == 0);
    const auto result = scene().result("deformed");
    INFO(result.dump());
    REQUIRE(result["deformation"]["applied"] == true);
    CHECK(result["deformation"]["rms_mm"].get<double>() > 1);
    CHECK(result["deformation"]["rigid_robust_mm"].get<double>() >
          result["residuals"]["robust_mm"].get<double>());
    const Eigen::Vector3d target(60, 0, -20), is = truth * by(target);
    Eigen::Vector3d found;
    for (std::size_t axis = 0; axis < 3; ++axis)
        found[static_cast<int>(axis)] = result["targets"][1]["position"][axis].get<double>();
    CHECK((found - is).norm() <
          0.7 * off(result, {truth.rotation, truth.translation + is - truth * target}, target));
    const std::string targets = TestFolder::read(scene().folder / "deformed/targets.csv");
    CHECK_SAYS(targets, "name,x,y,z,expected_error_mm\ntumour,");
    // The model as it is seen, which is a surface that can be read.
    const SurfaceFile model = read_surface_file(scene().folder / "deformed/model.ply");
    CHECK(model.places.size() == mesh.vertices.size() + 9);
    CHECK(model.error_column == "expected_error_mm");
    const Eigen::Vector3d place = truth * by(mesh.vertex(100));
    CHECK((Eigen::Map<const Eigen::Vector3f>(&model.places[300]).cast<double>() - place).norm() <
          6);

    // Without it there are none of these files, and an organ that is as it was is not deformed.
    options.is_deformed = false;
    options.surface = scene().surface;
    options.start = scene().start;
    CHECK(run_register(options) == 0);
    CHECK(scene().result("deformed")["deformation"].is_null());
    CHECK_FALSE(std::filesystem::exists(scene().folder / "deformed/model.ply"));
    options.is_deformed = true;
    CHECK(run_register(options) == 0);
    CHECK(scene().result("deformed")["deformation"]["applied"] == false);
    CHECK(std::filesystem::exists(scene().folder / "deformed/model.ply"));
}

TEST_CASE("row 193: --deform of a model that is not closed names its file") {
    RegisterOptions options = scene().options("open");
    TestMesh mesh = organ_mesh(3);
    mesh.triangles.resize(mesh.triangles.size() - 30);
    options.model = scene().folder.write("open.obj", obj_of(mesh));
    options.part.clear();
    options.is_deformed = true;
    const std::string refusal = refusal_of([&] { run_register(options); });
    CHECK_SAYS(refusal, "open.obj: the model is not closed");
}

TEST_CASE("a file that is no template names what writes one, and where a surface goes") {
    RegisterOptions options = scene().options("no_template");
    options.seen_template = scene().folder.write("template.ply", "ply\nformat ascii 1.0\n");
    options.surface.clear();
    const std::string refusal = refusal_of([&] { run_register(options); });
    CHECK_SAYS(refusal, "this is no template; `defrec track --save-template` writes one");
    CHECK_SAYS(refusal, "goes to --surface");
}

TEST_CASE("a registration that failed says what sizes tell, and is no start without a note") {
    RegisterOptions options = scene().options("small");
    TestMesh mesh = organ_mesh(4);
    for (float& value : mesh.vertices) value *= 0.1f;
    options.model = scene().folder.write("small.obj", obj_of(mesh));
    CHECK(run_register(options) == 9);
    CHECK_SAYS(scene().result("small")["notes"].dump(), "may be in another unit; see --unit");
    RegisterOptions again = scene().options("again");
    again.start = scene().folder / "small/registration.json";
    run_register(again);
    CHECK_SAYS(scene().result("again")["notes"].dump(), "has the verdict failed");
    CHECK(run_register(scene().options("again")) == 0);
    CHECK(scene().result("again")["notes"].dump().find("verdict") == std::string::npos);
}

TEST_CASE("pairs alone, and as the start of a surface") {
    RegisterOptions options;
    options.pairs = scene().folder.write("pairs.csv", pairs_csv(scene().truth, 0));
    options.out = scene().folder / "pairs";
    options.quiet = true;
    CHECK(run_register(options) == 0);
    auto result = scene().result("pairs");
    CHECK(result["method"] == "pairs");
    CHECK(result["pairs"].size() == 5);
    CHECK(off(result, scene().truth, {10, 20, 30}) < 0.001);

    RegisterOptions both = scene().options("both");
    both.start.clear();
    both.pairs = options.pairs;
    CHECK(run_register(both) == 0);
    result = scene().result("both");
    CHECK(result["method"] == "surface and pairs");
    CHECK(off(result, scene().truth, {0, 0, 0}) < 1);
    REQUIRE(result["pairs"].size() == 5);
    for (const auto& pair : result["pairs"]) CHECK(pair["fits"] == true);

    // The surface holds every motion, and still the pairs have a say.
    both.pairs = scene().folder.write(
        "shifted.csv",
        pairs_csv({scene().truth.rotation, scene().truth.translation + Eigen::Vector3d(6, 0, 0)},
                  0));
    CHECK(run_register(both) == 9);
    result = scene().result("both");
    CHECK(result["verdict"] == "failed");
    CHECK_SAYS(result["reason"].get<std::string>(), "contradict each other");
}

TEST_CASE("targets in metres, or behind the camera, are registered with a note") {
    RegisterOptions options;
    options.pairs = scene().folder.write("pairs.csv", pairs_csv(scene().truth, 0));
    options.out = scene().folder / "doubtful";
    options.quiet = true;
    const auto notes_of = [&](const std::string& rows) {
        options.targets = scene().folder.write("doubtful.csv", "id,x,y,z\n" + rows);
        CHECK(run_register(options) == 0);
        return scene().result("doubtful")["notes"].dump();
    };
    CHECK(notes_of("1,20,5,-40\n2,-10,5,-20\n") == "[]");
    CHECK_SAYS(notes_of("1,0.02,0.005,-0.04\n2,-0.01,0.005,-0.02\n"), "may be in metres");
    const Eigen::Vector3d behind = scene().truth.rotation.transpose() *
                                   (Eigen::Vector3d(0, 0, -90) - scene().truth.translation);
    CHECK_SAYS(notes_of("1,20,5,-40\n2,10,5,-40\n3," + row({behind.x(), behind.y(), behind.z()})),
               "1 of 3 targets lie behind the camera where the registration puts them (3)");
    options.is_tracked_camera = false;
    CHECK(notes_of("1,20,5,-40\n2,10,5,-40\n3," + row({behind.x(), behind.y(), behind.z()})) ==
          "[]");
}

TEST_CASE("row 173: exit code 9 where there is no registration, with the reason") {
    RegisterOptions options;
    options.pairs = scene().folder.write("contradict.csv", pairs_csv(scene().truth, 0, 60));
    options.out = scene().folder / "contradict";
    options.quiet = true;
    CHECK(run_register(options) == 9);
    CHECK(scene().result("contradict")["verdict"] == "failed");

    // Waves that the organ does not have.
    RegisterOptions other = scene().options("other");
    std::string text = "x,y,z\n";
    for (int i = 0; i < 400; ++i) {
        const double x = 3 * (i % 20) - 30, y = 3 * (i / 20) - 30;
        text += row({x, y, 80 + 6 * std::sin(0.3 * x)});
    }
    other.surface = scene().folder.write("waves.csv", text);
    CHECK(run_register(other) == 9);
    const auto result = scene().result("other");
    CHECK(result["verdict"] == "failed");
    CHECK_SAYS(result["reason"].get<std::string>(), "no pose fits");
}

TEST_CASE("exit code 2: options that do not fit together") {
    RegisterOptions options;
    options.out = scene().folder / "usage";
    CHECK_SAYS(usage_of(options), "give what was seen");
    options.surface = scene().surface;
    CHECK_SAYS(usage_of(options), "give both --model F and --surface F");
    options.model = scene().model;
    CHECK_SAYS(usage_of(options), "give about where the model lies");
    options.start = scene().start;
    CHECK_SAYS(usage_of(options), "has the parts liver, tumour");
    options.pairs = scene().start;
    CHECK_SAYS(usage_of(options), "give either --start or --pairs");
    options = RegisterOptions();
    options.pairs = scene().start;
    options.is_deformed = true;
    CHECK_SAYS(usage_of(options), "--deform draws a model to a surface");
    options.is_deformed = false;
    options.deformation_mm = 5;
    CHECK_SAYS(usage_of(options), "give --deform as well");
    options = RegisterOptions();
    options.model = scene().model;
    options.surface = scene().surface;
    options.start = scene().start;
    options.is_by_pairs_alone = true;
    CHECK_SAYS(usage_of(options), "--pairs-only registers by pairs: give --pairs F");
}

TEST_CASE("row 170: inputs that are refused, each with file and line") {
    const TestFolder& folder = scene().folder;
    const auto refused = [&](RegisterOptions options) {
        options.out = folder / "refused";
        const std::string refusal = refusal_of([&] { run_register(options); });
        CHECK_FALSE(std::filesystem::exists(options.out));
        return refusal;
    };
    RegisterOptions options = scene().options("refused");
    options.surface = folder.write("bad.csv", "x,y,z\n1,2,3\n1,2,nan\n");
    CHECK_SAYS(refused(options), "bad.csv:3: z: 'nan'");
    options.surface = folder.write("few.csv", "x,y,z\n1,2,3\n");
    CHECK_SAYS(refused(options), "few.csv: 1 points of the surface were given, expected 50");
    options.surface = folder.write("lost.csv", "x,y,z,status\n1,2,3,lost\n,,,lost\n");
    CHECK_SAYS(refused(options), "lost.csv:3: no point of the file was observed");
    options.surface = folder.write("empty.csv", "x,y,z\n");
    CHECK_SAYS(refused(options), "empty.csv:1: the file has no points");
    options.surface = folder.write("bad.ply",
                                   "ply\nformat ascii 1.0\nelement vertex 1\nproperty "
                                   "float x\nend_header\n1\n");
    CHECK_SAYS(refused(options), "no x, y and z");
    options = scene().options("refused");
    options.start = folder.write("scaled.csv", "x,y,z,t\n2,0,0,0\n0,2,0,0\n0,0,2,0\n");
    CHECK_SAYS(refused(options), "are no rotation: R R^T differs from 1 by 3.0000");
    options.start = folder.write("short.csv", "x,y,z,t\n1,0,0,0\n");
    CHECK_SAYS(refused(options), "three rows of [R | t]");
    options.start = folder.write("start.json", "{\"transform\": [[1, 2], 3]}");
    CHECK_SAYS(refused(options), "a registration.json was expected");
    options = RegisterOptions();
    options.quiet = true;
    options.pairs = folder.write("two.csv", pairs_csv(scene().truth, 3));
    CHECK_SAYS(refused(options), "two.csv: 2 pairs were given, expected 3 at least");
    options.pairs = folder.write("negative.csv",
                                 "id,model_x,model_y,model_z,x,y,z,error_mm\n1,1,2,3,4,5,6,-1\n");
    CHECK_SAYS(refused(options), "negative.csv:2: an error of 0 mm or more");
}

TEST_CASE("row 203: a target's name that is not UTF-8 is refused, with file and line") {
    RegisterOptions options = scene().options("refused");
    options.targets =
        scene().folder.write("latin1.csv", "id,x,y,z,name\n7,5,5,-15,a\n8,1,2,-9,v\xE4ne\n");
    CHECK_SAYS(refusal_of([&] { run_register(options); }),
               "latin1.csv:3: the name of the target is not UTF-8");
}

TEST_CASE("a surface of `defrec track --meshes`: observed vertices, with errors along the sight") {
    const std::string path = scene().folder.write(
        "tracked.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar "
        "status\nproperty float expected_error_mm\nelement face 1\nproperty list uchar uint "
        "vertex_indices\nend_header\n0 0 60 0 0 -1 0 0.5\n30 0 40 0 0 -1 0 0.5\n5 5 60 0 0 -1 2 "
        "9\n3 0 1 2\n");
    const SurfaceFile surface = read_surface_file(path);
    CHECK(surface.places.size() == 6);
    CHECK(surface.normals.size() == 6);
    CHECK(surface.left_out == 1);
    CHECK(surface.error_column == "expected_error_mm");
    REQUIRE(surface.covariances.size() == 12);
    const float* c = surface.covariances.data();
    CHECK(c[0] + c[3] + c[5] == doctest::Approx(0.25));
    CHECK(c[5] > 10 * c[0]);
    CHECK(c[6] + c[9] + c[11] == doctest::Approx(0.25));
    CHECK(c[6 + 2] == doctest::Approx(0.25 * 0.94 * 0.6 * 0.8));
}

TEST_CASE("a frame of points.csv whose first point is lost keeps the errors of the others") {
    const TestFolder& folder = scene().folder;
    SurfaceFile surface =
        read_surface_file(folder.write("points.csv",
                                       "frame,id,x,y,z,status,expected_error_mm,xx,xy,xz,yy,yz,zz\n"
                                       "3,1,,,,lost,,,,,,,\n"
                                       "3,2,1,2,60,tracked,0.5,0.01,0,0,0.02,0,0.2\n"
                                       "3,3,9,2,60,extrapolated,2,0.1,0,0,0.2,0,2\n"
                                       "3,4,5,2,60,tracked,0.5,0.01,0,0,0.02,0,0.3\n"));
    CHECK(surface.places == std::vector<float>{1, 2, 60, 5, 2, 60});
    CHECK(surface.left_out == 2);
    CHECK(surface.error_column == "xx..zz");
    CHECK(surface.covariances ==
          std::vector<float>{0.01F, 0, 0, 0.02F, 0, 0.2F, 0.01F, 0, 0, 0.02F, 0, 0.3F});
    surface = read_surface_file(folder.write("errors.csv",
                                             "x,y,z,status,expected_error_mm\n,,,lost,\n"
                                             "0,0,60,tracked,0.5\n"));
    CHECK(surface.error_column == "expected_error_mm");
    CHECK(surface.covariances.size() == 6);
}
