// `defrec register` with a surface that leaves a turn open, and pairs.
#include "sdk/registration/program/pairs_and_surface.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"
#include "sdk/registration/program/run_register.hpp"
#include "sdk/registration/program/test_inputs.hpp"

using namespace defrec;
using namespace defrec::cli;

namespace {

constexpr double kNoise = 0.5;  // mm, along each axis of a pair

// A spheroid, whose turn about its axis no surface shows, and what a camera sees of it.
struct Scene {
    TestFolder folder;
    Pose truth;
    std::string model, surface, targets;

    Scene() {
        std::mt19937 random(3);
        const TestMesh mesh = sphere_mesh(4, [](const Eigen::Vector3d& d) {
            return Eigen::Vector3d(40 * d.x(), 40 * d.y(), 60 * d.z());
        });
        truth = {rotation_of({0.7, 0.4, 0.2}), Eigen::Vector3d(5, -8, 120)};
        const TestView view = TestCamera(mesh, truth, {}).view(mesh, random);
        model = folder.write("spheroid.obj", obj_of(mesh));
        std::string text = "x,y,z,xx,xy,xz,yy,yz,zz\n";
        for (std::size_t i = 0; i < view.places.size() / 3; i += 3) {
            const float *p = &view.places[3 * i], *c = &view.covariances[6 * i];
            text += row({p[0], p[1], p[2], c[0], c[1], c[2], c[3], c[4], c[5]});
        }
        surface = folder.write("surface.csv", text);
        targets = folder.write("targets.csv", "id,x,y,z\n1,25,0,10\n2,0,-20,-30\n3,0,0,0\n");
    }

    // Six pairs, the places that were seen with noise; shift: of all, mm; wrong: of the last.
    std::string pairs(std::mt19937& random, bool is_stated, double shift = 0,
                      double wrong = 0) const {
        std::normal_distribution<double> noise(0, kNoise);
        std::string text =
            std::string("id,model_x,model_y,model_z,x,y,z") + (is_stated ? ",error_mm\n" : "\n");
        const double places[6][3] = {{40, 0, 0},   {0, -40, 0},   {0, 0, -60},
                                     {-25, 0, 30}, {20, -20, 15}, {-10, -30, -25}};
        for (int i = 0; i < 6; ++i) {
            const Eigen::Vector3d at(places[i][0], places[i][1], places[i][2]);
            Eigen::Vector3d seen =
                truth * at + Eigen::Vector3d(noise(random), noise(random), noise(random) + shift);
            if (i == 5) seen.x() += wrong;
            std::string line = row({at.x(), at.y(), at.z(), seen.x(), seen.y(), seen.z(), kNoise});
            if (!is_stated) line = line.substr(0, line.rfind(',')) + "\n";
            text.append(std::to_string(i + 1)).append(",").append(line);
        }
        return folder.write("pairs.csv", text);
    }

    RegisterOptions options(const std::string& pairs_file) const {
        RegisterOptions made;
        made.model = model;
        made.surface = surface;
        made.targets = targets;
        made.pairs = pairs_file;
        made.out = folder / "out";
        made.starts = 4;
        made.quiet = true;
        return made;
    }
    nlohmann::json result() const {
        return nlohmann::json::parse(TestFolder::read(folder / "out/registration.json"));
    }
};

Eigen::Vector3d vector_of(const nlohmann::json& json) {
    return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

const Scene& scene() {
    static const Scene made;
    return made;
}

}  // namespace

TEST_CASE("--deform: an open turn names --pairs-only, and how exactly pairs hold it") {
    std::mt19937 random(1);
    RegisterOptions options = scene().options(scene().pairs(random, true));
    options.is_deformed = true;
    CHECK(run_register(options) == 9);
    const auto open = scene().result();
    CHECK(open["verdict"] == "undetermined");
    CHECK(open["targets"][0]["expected_error_mm"].get<double>() > 100);
    CHECK_SAYS(open["reason"].get<std::string>(), "The pairs alone hold this to 0.");
    CHECK_SAYS(open["reason"].get<std::string>(), " degrees: give --pairs-only");

    options.is_deformed = false;
    options.is_by_pairs_alone = true;
    CHECK(run_register(options) == 0);
    CHECK(scene().result()["targets"][0]["expected_error_mm"].get<double>() < 1);
    // As the same command without what was seen.
    options.surface.clear();
    CHECK(run_register(options) == 0);
}

TEST_CASE("pairs hold the turn that a surface leaves open, with errors that hold over trials") {
    std::mt19937 random(2);
    for (const bool is_stated : {true, false}) {
        CAPTURE(is_stated);
        int within_two = 0, within_three = 0, count = 0;
        double squared = 0, expected = 0, along_surface = 0;
        for (int trial = 0; trial < 15; ++trial) {
            RegisterOptions options = scene().options(scene().pairs(random, is_stated));
            const int code = run_register(options);
            const auto result = scene().result();
            INFO(result["reason"].get<std::string>());
            REQUIRE(code == 0);
            CHECK(result["method"] == "surface and pairs");
            for (const auto& target : result["targets"]) {
                const double off =
                    (vector_of(target["position"]) - scene().truth * vector_of(target["model"]))
                        .norm();
                const double error = target["expected_error_mm"].get<double>();
                squared += off * off;
                expected += error * error;
                within_two += off <= 2 * error;
                within_three += off <= 3 * error;
                ++count;
            }
            along_surface += result["targets"][2]["expected_error_mm"].get<double>() / 15;
        }
        MESSAGE("off ", std::sqrt(squared / count), ", expected ", std::sqrt(expected / count),
                ", centre ", along_surface, " mm; within 2: ", within_two, ", 3: ", within_three,
                " of ", count);
        CHECK(within_two >= 0.93 * count);
        CHECK(within_three >= 0.98 * count);
        CHECK(std::sqrt(expected / count) < 0.6);
    }
}

TEST_CASE("both together are more exact than pairs alone") {
    std::mt19937 random(5);
    RegisterOptions options = scene().options(scene().pairs(random, true));
    REQUIRE(run_register(options) == 0);
    const auto both = scene().result();
    CHECK(both["residuals"]["used"].get<int>() > 500);
    CHECK(std::filesystem::exists(scene().folder / "out/registration.png"));
    options.is_by_pairs_alone = true;
    REQUIRE(run_register(options) == 0);
    const auto alone = scene().result();
    CHECK_FALSE(std::filesystem::exists(scene().folder / "out/registration.png"));
    for (std::size_t i = 0; i < 3; ++i)
        CHECK(both["targets"][i]["expected_error_mm"].get<double>() <
              alone["targets"][i]["expected_error_mm"].get<double>());
}

TEST_CASE("row 173: one wrong pair pulls nothing and is named") {
    for (const bool is_stated : {true, false}) {
        CAPTURE(is_stated);
        std::mt19937 random(6);
        const RegisterOptions options = scene().options(scene().pairs(random, is_stated, 0, 15));
        const int code = run_register(options);
        const auto result = scene().result();
        INFO(result.dump());
        REQUIRE(code == 0);
        CHECK(result["notes"].dump().find("Pair 6 contradicts the others and was left out") !=
              std::string::npos);
        REQUIRE(result["pairs"].size() == 6);
        for (const auto& pair : result["pairs"]) CHECK(pair["fits"] == (pair["id"] != 6));
        CHECK(result["pairs"][5]["residual_mm"].get<double>() > 12);
        CHECK((vector_of(result["targets"][0]["position"]) -
               scene().truth * Eigen::Vector3d(25, 0, 10))
                  .norm() < 1.5);
    }
}

TEST_CASE("row 211: a surface and pairs that contradict each other fail, with the worst pair") {
    std::mt19937 random(7);
    const RegisterOptions options = scene().options(scene().pairs(random, true, 4));
    CHECK(run_register(options) == 9);
    const auto result = scene().result();
    INFO(result.dump());
    CHECK(result["verdict"] == "failed");
    CHECK_SAYS(result["reason"].get<std::string>(),
               "the surface and the pairs contradict each other: they put the model ");
    CHECK_SAYS(result["reason"].get<std::string>(), "; pair ");
}

TEST_CASE("how probable sums of squares are") {
    // Tables of chi squared, 6 and 4 degrees of freedom, and of F(6, 12) and F(4, 9).
    CHECK(chance_of(12.592, 3, {}) == doctest::Approx(0.05).epsilon(0.001));
    CHECK(chance_of(13.277, 2, {}) == doctest::Approx(0.01).epsilon(0.001));
    CHECK(chance_of(6 * 2.996, 3, 12) == doctest::Approx(0.05).epsilon(0.001));
    CHECK(chance_of(4 * 6.422, 2, 9) == doctest::Approx(0.01).epsilon(0.001));
}
