// `defrec register` with a surface that leaves a turn open, and pairs.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
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
}
