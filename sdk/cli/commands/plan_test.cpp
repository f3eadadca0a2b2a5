// A plan from `defrec register` to `defrec track`, on a rendered body with a tumour: exit codes,
// files, and that targets are where they are in truth.
#include <doctest/doctest.h>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "sdk/cli/commands/commands.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/mesh_file.hpp"
#include "sdk/io/text.hpp"
#include "sdk/scenes/writing/test_sequence.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 6;

int run(const std::vector<std::string>& arguments) {
    std::vector<const char*> argv{"defrec"};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    return run_program(static_cast<int>(argv.size()), argv.data());
}

using Place = std::array<double, 3>;

// The scanner's frame is turned about y and shifted against the camera's.
Place to_scan(const Place& p) {
    const double c = std::cos(2.1), s = std::sin(2.1);
    return {c * p[0] + s * p[2] - 40, p[1] + 25, -s * p[0] + c * p[2] + 900};
}

std::string text_of(const Place& p, char separator) {
    std::string text;
    for (const double value : p)
        text += (text.empty() ? std::string() : std::string(1, separator)) + format_fixed(value, 5);
    return text;
}

// A rendered operation and the scan that was made before it.
class Operation {
  public:
    Operation() {
        RenderOptions options;
        options.scene = "body-inclusion";
        options.out_dir = folder.path().string();
        options.width = 480;
        options.height = 270;
        options.frames = kFrames;
        render_sequence(options, {});
        write_scan();
        write_rows("pairs.csv", "truth.csv", 29, 0.5);
        write_rows("scan_targets.csv", "targets.csv", 40, {});
        REQUIRE(run(track(folder / "first",
                          {"--frames", "0:2", "--save-template", folder / "organ.template"})) == 0);
    }

    std::vector<std::string> track(const std::string& out,
                                   const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"track",
                                           "--quiet",
                                           "--no-overlay",
                                           "--left",
                                           folder / "left",
                                           "--right",
                                           folder / "right",
                                           "--calibration",
                                           folder / "calibration.yaml",
                                           "--out",
                                           out,
                                           "--backend",
                                           "cpu"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    }
    std::vector<std::string> registering(const std::string& out,
                                         const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"register", "--quiet",    "--out",
                                           out,        "--template", folder / "organ.template"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    }
    // What a registration by pairs with a model needs, and where its plan goes.
    std::vector<std::string> by_pairs(const std::string& out, const std::string& plan) const {
        return registering(
            out, {"--model", folder / "scan.obj", "--pairs", folder / "pairs.csv", "--pairs-only",
                  "--targets", folder / "scan_targets.csv", "--plan", plan});
    }
    // Made once.
    std::string plan() const {
        const std::string path = folder / "organ.plan";
        if (!fs::exists(path)) REQUIRE(run(by_pairs(folder / "registered", path)) == 0);
        return path;
    }

    TestFolder folder;

  private:
    void write_scan() const {
        std::string text;
        std::size_t base = 1;
        for (const auto& [name, file] :
             {std::pair("organ", "body.ply"), std::pair("tumour", "inclusion.ply")}) {
            const MeshFile mesh = read_mesh_file(folder / file);
            for (std::size_t i = 0; i < mesh.vertices.size(); i += 3)
                text.append("v ")
                    .append(text_of(to_scan({double{mesh.vertices[i]}, double{mesh.vertices[i + 1]},
                                             double{mesh.vertices[i + 2]}}),
                                    ' '))
                    .append("\n");
            text.append("g ").append(name).append("\n");
            for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
                text += "f";
                for (std::size_t k = 0; k < 3; ++k)
                    text.append(" ").append(std::to_string(mesh.triangles[i + k] + base));
                text += "\n";
            }
            base += mesh.vertices.size() / 3;
        }
        folder.write("scan.obj", text);
    }
    // Every so many rows of the first frame's truth, as targets of the scan, or as pairs where
    // there is an error.
    void write_rows(const char* name, const char* from, std::int64_t every,
                    std::optional<double> error_mm) const {
        std::string text = error_mm ? "id,model_x,model_y,model_z,x,y,z,error_mm\n" : "id,x,y,z\n";
        CsvReader csv(folder / from, {"id", "x", "y", "z"}, {"frame"});
        while (csv.next()) {
            if (!csv.is_empty(4) && csv.integer(4) != 0) break;
            if (csv.integer(0) % every != every - 1) continue;
            const Place place{csv.number(1), csv.number(2), csv.number(3)};
            text.append(csv.field(0)).append(",").append(text_of(to_scan(place), ','));
            if (error_mm)
                text.append(",")
                    .append(text_of(place, ','))
                    .append(",")
                    .append(format_fixed(*error_mm, 2));
            text += "\n";
        }
        folder.write(name, text);
    }
};

const Operation& operation() {
    static const Operation made;
    return made;
}

nlohmann::json json_of(const std::string& path) {
    return nlohmann::json::parse(TestFolder::read(path));
}

}  // namespace

TEST_CASE("register writes a plan: the model's parts, the targets in their order, exit code 0") {
    const std::string plan = operation().plan();
    const auto result = json_of(operation().folder / "registered/registration.json");
    CHECK(result["verdict"] == "registered");
    CHECK(result["method"] == "pairs");
    CHECK(result["plan"]["file"] == plan);
    REQUIRE(result["plan"]["targets"].size() > 4);
    CHECK(result["plan"]["targets"][0] == "39");
    CHECK(result["plan"]["targets"][1] == "79");

    // Nothing was compared, so there is no picture.
    CHECK_FALSE(fs::exists(operation().folder / "registered/registration.png"));
}

TEST_CASE("a registration that is not accepted gives no plan, unless a person has looked") {
    const TestFolder folder;
    // The block's face is flat: it may slide along itself.
    const std::vector<std::string> flat{
        "--model", operation().folder / "scan.obj",
        "--part",  "organ",
        "--start", operation().folder / "registered/registration.json",
        "--plan",  folder / "flat.plan"};
    operation().plan();
    CHECK(run(operation().registering(folder / "flat", flat)) == 9);
    CHECK_FALSE(fs::exists(folder / "flat.plan"));
    auto result = json_of(folder / "flat/registration.json");
    CHECK(result["verdict"] == "undetermined");
    CHECK(result["plan"].is_null());
    CHECK(result["notes"].dump().find("No plan was written") != std::string::npos);
    CHECK(fs::exists(folder / "flat/registration.png"));
    std::vector<std::string> looked_at = flat;
    looked_at.emplace_back("--looked-at");
    CHECK(run(operation().registering(folder / "flat", looked_at)) == 9);
    CHECK(fs::exists(folder / "flat.plan"));
    CHECK(json_of(folder / "flat/registration.json")["plan"]["file"] == folder / "flat.plan");

    const std::string pairs = folder.write("contradict.csv",
                                           "id,model_x,model_y,model_z,x,y,z,error_mm\n"
                                           "1,0,0,0,0,0,80,0.5\n2,30,0,0,90,0,80,0.5\n"
                                           "3,0,30,0,0,30,20,0.5\n4,30,30,0,30,30,80,0.5\n");
    const std::vector<std::string> failed{
        "--pairs",     pairs,    "--targets",           operation().folder / "scan_targets.csv",
        "--looked-at", "--plan", folder / "failed.plan"};
    CHECK(run(operation().registering(folder / "failed", failed)) == 9);
    CHECK(json_of(folder / "failed/registration.json")["verdict"] == "failed");
    CHECK_FALSE(fs::exists(folder / "failed.plan"));
}

TEST_CASE("what makes no plan is refused: exit codes 2 and 3, and no file changes") {
    const TestFolder folder;
    const std::string pairs = operation().folder / "pairs.csv", plan = folder / "new.plan",
                      scan = operation().folder / "scan.obj", out = folder / "out",
                      targets = operation().folder / "scan_targets.csv";
    const auto refused = [&](const std::vector<std::string>& more) {
        return run(operation().registering(out, more));
    };
    CHECK(run({"register", "--quiet", "--out", out, "--pairs", pairs, "--targets", targets,
               "--plan", plan}) == 2);                        // no template
    CHECK(refused({"--pairs", pairs, "--plan", plan}) == 2);  // nothing in it
    CHECK(refused({"--pairs", pairs, "--looked-at"}) == 2);   // at no plan
    CHECK(refused({"--pairs", pairs, "--model", scan, "--pairs-only"}) == 2);
    CHECK(refused({"--pairs", pairs, "--targets", targets, "--surface", scan, "--model", scan}) ==
          2);  // two surfaces
    const std::string before = TestFolder::read(pairs);
    CHECK(refused({"--pairs", pairs, "--targets", targets, "--plan", pairs}) == 2);
    CHECK(refused({"--pairs", pairs, "--targets", targets, "--plan",
                   operation().folder / "organ.template"}) == 2);
    CHECK(TestFolder::read(pairs) == before);
    CHECK(run({"register", "--quiet", "--out", out, "--pairs", pairs, "--targets", targets,
               "--template", pairs, "--plan", plan}) == 3);  // no template's file
    CHECK(refused({"--pairs", pairs, "--targets", folder.write("nan.csv", "id,x,y,z\n1,0,nan,0\n"),
                   "--plan", plan}) == 3);
    CHECK(run({"register", "--quiet", "--out", folder / "written", "--pairs", pairs, "--targets",
               targets, "--template", operation().folder / "organ.template", "--plan",
               folder / "absent/new.plan"}) == 7);
    CHECK_FALSE(fs::exists(out));
    CHECK_FALSE(fs::exists(plan));
}
