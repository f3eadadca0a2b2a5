// A plan from `defrec register` to `defrec track`, on a rendered body with a tumour: exit codes,
// files, and that targets are where they are in truth.
#include <doctest/doctest.h>
#include <signal.h>

#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "sdk/cli/commands/test_program.hpp"
#include "sdk/cli/commands/test_run.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/mesh_file.hpp"
#include "sdk/io/text.hpp"
#include "sdk/scenes/writing/test_sequence.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 6;

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
    // The arguments of a registration by pairs, whose model goes into the plan.
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

// By frame and id.
std::map<std::pair<std::int64_t, std::int64_t>, Place> deep_truth() {
    std::map<std::pair<std::int64_t, std::int64_t>, Place> places;
    CsvReader csv(operation().folder / "truth_deep.csv", {"frame", "id", "x", "y", "z"});
    while (csv.next())
        places[{csv.integer(0), csv.integer(1)}] = {csv.number(2), csv.number(3), csv.number(4)};
    return places;
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
    CHECK(refused({"--start", pairs, "--model", scan, "--pairs-only"}) == 2);
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

TEST_CASE(
    "track follows a plan: targets beneath the surface, parts, meshes, the summary's counts") {
    const TestFolder folder;
    const std::string out = folder / "out";
    REQUIRE(run(operation().track(
                out, {"--plan", operation().plan(), "--plan-meshes", "2", "--seed", "3"})) == 0);
    const auto names =
        json_of(operation().folder / "registered/registration.json")["plan"]["targets"];
    const auto truth = deep_truth();
    CsvReader csv(out + "/plan.csv",
                  {"frame", "id", "part", "x", "y", "z", "status", "expected_error_mm", "target"});
    std::size_t targets = 0, organs = 0, tumours = 0, within_three = 0;
    while (csv.next()) {
        if (!csv.field(2).empty()) {
            CHECK(csv.is_empty(1));
            CHECK(csv.is_empty(8));
            organs += csv.field(2) == "organ";
            tumours += csv.field(2) == "tumour";
            continue;
        }
        REQUIRE(csv.field(6) != "lost");
        CHECK(csv.field(8) == names[static_cast<std::size_t>(csv.integer(1))].get<std::string>());
        const auto id =
            std::stoll(names[static_cast<std::size_t>(csv.integer(1))].get<std::string>());
        const Place& right = truth.at({csv.integer(0), id});
        const double off = std::hypot(csv.number(3) - right[0], csv.number(4) - right[1],
                                      csv.number(5) - right[2]);
        CHECK(off < 1);
        within_three += off < 3 * csv.number(7);
        ++targets;
    }
    CHECK(targets == kFrames * names.size());
    CHECK(static_cast<double>(within_three) > 0.95 * static_cast<double>(targets));
    CHECK(organs == kFrames);
    CHECK(tumours == kFrames);

    const auto summary = json_of(out + "/summary.json");
    CHECK(summary["input"]["plan"] == operation().plan());
    CHECK(summary["plan"]["targets"]["count"] == names.size());
    CHECK(summary["plan"]["targets"]["lost_share"] == 0);
    CHECK(summary["plan"]["parts"]["names"] == std::vector<std::string>{"organ", "tumour"});
    CHECK(summary["plan"]["meshes"] == kFrames / 2);
    CHECK(summary["files"].dump().find("plan.csv") != std::string::npos);

    for (int frame = 0; frame < kFrames; ++frame) {
        const std::string path = out + "/plan/00000" + std::to_string(frame) + ".ply";
        CAPTURE(path);
        CHECK(fs::exists(path) == (frame % 2 == 0));
    }
    const MeshFile mesh = read_mesh_file(out + "/plan/000004.ply"),
                   scan = read_mesh_file(operation().folder / "scan.obj");
    CHECK(mesh.triangles == scan.triangles);
    CHECK(mesh.vertices.size() == scan.vertices.size());

    // The same again, from its summary alone, and what an earlier run left in plan/ is gone.
    const std::string again = folder / "again";
    fs::create_directories(again + "/plan");
    std::ofstream(again + "/plan/000099.ply") << "of a longer run";
    REQUIRE(run({"track", "--quiet", "--like", out + "/summary.json", "--out", again}) == 0);
    CHECK(TestFolder::read(again + "/plan.csv") == TestFolder::read(out + "/plan.csv"));
    CHECK(TestFolder::read(again + "/plan/000004.ply") ==
          TestFolder::read(out + "/plan/000004.ply"));
    CHECK_FALSE(fs::exists(again + "/plan/000099.ply"));
}

TEST_CASE("track writes where points, targets and parts of a plan are when they are shown") {
    const TestFolder folder;
    const std::string out = folder / "out", again = folder / "again";
    REQUIRE(run(operation().track(out, {"--plan", operation().plan(), "--plan-meshes", "0",
                                        "--display-delay", "40"})) == 0);
    CsvReader tracked(out + "/plan.csv", {"frame", "part", "expected_error_mm", "x", "status"});
    CsvReader shown(out + "/display.csv", {"frame", "part", "expected_error_mm", "x", "status",
                                           "kind", "timestamp_ms", "display_ms", "basis"});
    std::size_t rows = 0, points = 0, moved = 0;
    while (shown.next()) {
        CHECK(shown.number(7) - shown.number(6) == doctest::Approx(40).epsilon(1e-4));
        if (shown.field(5) == "point") {
            ++points;
            continue;
        }
        ++rows;
        REQUIRE(tracked.next());
        CHECK(shown.integer(0) == tracked.integer(0));
        CHECK(shown.field(1) == tracked.field(1));
        CHECK(shown.field(5) == (shown.field(1).empty() ? "plan-target" : "plan-part"));
        CHECK(shown.field(4) == tracked.field(4));
        if (shown.field(4) == "lost") continue;
        CHECK(shown.number(2) >= tracked.number(2));
        moved += shown.number(3) != tracked.number(3);
        if (shown.integer(0) == 0) CHECK(shown.field(8) == "last");
    }
    CHECK_FALSE(tracked.next());
    CHECK(points > 0);
    CHECK(moved > rows / 4);
    const auto summary = json_of(out + "/summary.json");
    CHECK(summary["files"].dump().find("display.csv") != std::string::npos);
    REQUIRE(run({"track", "--quiet", "--like", out + "/summary.json", "--out", again}) == 0);
    CHECK(TestFolder::read(again + "/display.csv") == TestFolder::read(out + "/display.csv"));

    CHECK(run(operation().track(folder / "late", {"--display-delay", "101"})) == 2);
    CHECK(run(operation().track(folder / "late", {"--display-delay", "-1"})) == 2);
    CHECK_FALSE(fs::exists(folder / "late"));
}

TEST_CASE("a plan of another template, a damaged one and none are told: exit code 3") {
    const TestFolder folder;
    const std::string plan = operation().plan(), bytes = TestFolder::read(plan);
    const auto track = [&](const std::string& file, const std::vector<std::string>& more = {}) {
        std::vector<std::string> all{"--plan", file};
        all.insert(all.end(), more.begin(), more.end());
        return run(operation().track(folder / "out", all));
    };
    CHECK(track(folder / "absent.plan") == 3);
    CHECK(track(operation().folder / "scan.obj") == 3);
    CHECK(track(operation().folder / "organ.template") == 3);
    CHECK(track(folder.write("empty.plan", "")) == 3);
    CHECK_FALSE(fs::exists(folder / "out"));
    CHECK(track(folder.write("short.plan", bytes.substr(0, bytes.size() / 2))) == 3);
    std::string other = bytes;
    other[bytes.size() / 2] ^= 1;
    CHECK(track(folder.write("damaged.plan", other)) == 3);
    CHECK(track(plan, {"--template-frame", "3"}) == 3);
    CHECK_FALSE(fs::exists(folder / "out/summary.json"));
    CHECK(track(plan, {"--from-template", operation().folder / "organ.template"}) == 0);
}

TEST_CASE("the plan's file is not overwritten, nor what is read from the folder of its meshes") {
    const TestFolder folder;
    fs::create_directories(folder / "out/plan");
    for (const char* name : {"out/plan.csv", "out/plan/000001.ply"}) {
        const std::string path = folder / name;
        fs::copy(operation().plan(), path);
        CHECK(run(operation().track(folder / "out", {"--plan", path})) == 2);
        CHECK(TestFolder::read(path) == TestFolder::read(operation().plan()));
        fs::remove(path);
    }
    CHECK(run(operation().track(
              folder / "out", {"--plan", operation().plan(), "--trace", operation().plan()})) == 2);
    CHECK(run(operation().track(folder / "out", {"--plan-meshes", "2"})) == 2);
    CHECK(run(operation().track(folder / "out", {"--igtl-image"})) == 2);  // to nobody
}

TEST_CASE("a run that is killed while it follows a plan never looks finished") {
    const TestFolder folder;
    repeat_sequence(operation().folder, folder);
    const std::string out = folder / "out";
    REQUIRE(run(operation().track(out, {"--plan", operation().plan()})) == 0);
    REQUIRE(fs::exists(out + "/summary.json"));
    ChildProgram killed({"track", "--quiet", "--no-overlay", "--left", folder / "left", "--right",
                         folder / "right", "--calibration", operation().folder / "calibration.yaml",
                         "--plan", operation().plan(), "--out", out});
    // Longer than the first run was.
    const std::string late = out + "/plan/000020.ply";
    killed.wait_until([&] { return fs::exists(late); });
    killed.send(SIGKILL);
    CHECK(killed.exit_code() == -SIGKILL);
    CHECK_FALSE(fs::exists(out + "/summary.json"));
    REQUIRE(run(operation().track(out, {"--plan", operation().plan()})) == 0);
    CHECK_FALSE(fs::exists(late));
    CHECK(fs::exists(out + "/summary.json"));
}
