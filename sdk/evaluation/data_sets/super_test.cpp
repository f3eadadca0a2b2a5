// SuPer: metrics by hand, rendered data in, malformed copies.
#include <cmath>
#include <map>

#include "sdk/evaluation/data_sets/data_set.hpp"
#include "sdk/evaluation/layout_test.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;
using Json = nlohmann::json;

namespace {

const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made = (render_layout_to(folder.path(), "heartbeat", "super", 7), true);
    static_cast<void>(is_made);
    return folder;
}

// Mean over points of the mean over images of the distance from the label, worked out anew.
double mean_error(const fs::path& root, const fs::path& predictions) {
    const Json truth = read_json(root / "super/rgb/left_pts.json")["gt"];
    const Json found = read_json(predictions)["super"];
    std::map<std::size_t, std::pair<double, int>> of_points;
    for (const auto& [key, rows] : truth.items()) {
        if (key == "000000") continue;
        for (std::size_t i = 0; i < rows.size(); ++i) {
            if (rows[i][2] != 1 || truth["000000"][i][2] != 1) continue;
            auto& [sum, count] = of_points[i];
            sum += std::hypot(rows[i][0].get<double>() - found[key][i][0].get<double>(),
                              rows[i][1].get<double>() - found[key][i][1].get<double>());
            ++count;
        }
    }
    double mean = 0;
    for (const auto& [point, sums] : of_points)
        mean += sums.first / sums.second / static_cast<double>(of_points.size());
    return mean;
}

}  // namespace

TEST_CASE("means over points of their means over images, by hand") {
    const DataSet& set = data_set_of("super");
    Samples samples(set.sample_columns());
    samples.add({10, 0, 1, 1});
    samples.add({10, 1, 1, 6});
    samples.add({20, 0, 0, 3});
    std::vector<double> values = set.summarise(samples);
    CHECK(values[0] == 4);    // of 2 and 6
    CHECK(values[1] == 0.5);  // of 1 and 0
    CHECK(values[2] == doctest::Approx(2.0 / 3));
    Samples of_two(set.sample_columns());
    of_two.append(samples);
    of_two.append(samples);  // another clip, whose points are others
    values = set.summarise(of_two);
    CHECK(values[0] == 4);
    CHECK(values[1] == 0.5);
}

TEST_CASE("rendered data in, and the score is that of the predictions that were written") {
    const TestFolder out;
    REQUIRE(evaluate_set("super", data_set().path(), out.path()) == 0);
    const fs::path predictions = out.path() / "predictions/defrec/tracked_points.json";
    const double mean = result_of(out.path(), "super", "mean_px");
    CHECK(mean == doctest::Approx(mean_error(data_set().path(), predictions)));
    CHECK(mean < 2);
    CHECK(result_of(out.path(), "super", "found_share") > 0.8);
    CHECK(read_json(predictions)["super"].size() == 4);
}

TEST_CASE("labels that are moved or not valid change the score as they must") {
    const TestFolder root, out;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    const fs::path file = root.path() / "super/rgb/left_pts.json";
    Json truth = read_json(file);
    for (auto& [key, rows] : truth["gt"].items())
        if (key != "000000")
            for (auto& row : rows) row[1] = row[1].get<double>() + 30;
    std::ofstream(file) << truth;
    REQUIRE(evaluate_set("super", root.path(), out.path()) == 0);
    const double mean = result_of(out.path(), "super", "mean_px");
    CHECK(mean > 28);
    CHECK(mean < 32);
    CHECK(mean == doctest::Approx(mean_error(
                      root.path(), out.path() / "predictions/defrec/tracked_points.json")));
    for (auto& [key, rows] : truth["gt"].items())
        for (std::size_t i = 1; i < rows.size(); ++i) rows[i][2] = 0;
    std::ofstream(file) << truth;
    REQUIRE(evaluate_set("super", root.path(), out.path()) == 0);
    const std::string samples = TestFolder::read(out.path() / "clips/defrec/super/samples.csv");
    CHECK(std::count(samples.begin(), samples.end(), '\n') == 1 + 3);  // one point in three images
}

TEST_CASE("what is not as expected is named") {
    BrokenCopies copies(data_set().path() / "super");
    const Json truth = read_json(data_set().path() / "super/rgb/left_pts.json");
    const auto write = [&](const char* clip, const auto& change) {
        Json json = truth;
        change(json);
        std::ofstream(copies.copy(clip) / "rgb/left_pts.json") << json;
    };
    fs::rename(copies.copy("not_converted") / "rgb/left_pts.json",
               copies.root() / "not_converted/rgb/left_pts.npy");
    fs::remove(copies.copy("no_calibration") / "calibration.yaml");
    fs::remove(copies.copy("no_right") / "rgb/000003-right.png");
    write("no_gt", [](Json& json) { json.erase("gt"); });
    write("odd_key", [](Json& json) { json["gt"]["first"] = json["gt"]["000002"]; });
    write("no_image", [](Json& json) { json["gt"]["000100"] = json["gt"]["000002"]; });
    write("short_row", [](Json& json) { json["gt"]["000002"][3].erase(2); });
    write("fewer", [](Json& json) { json["gt"]["000002"].erase(0); });
    write("none_valid", [](Json& json) {
        for (auto& row : json["gt"]["000000"]) row[2] = 0;
    });
    copies.evaluate("super");
    copies.says("not_converted", "left_pts.json: this file was expected: made of left_pts.npy by");
    copies.says("no_calibration", "calibration.yaml: this file was expected");
    copies.says("no_right", "-right.png: number 3 is missing");
    copies.says("no_gt", "\"gt\"; labels by the images' numbers; was expected");
    copies.says("odd_key", "first: the number of an image was expected");
    copies.says("no_image", "image 100 is labelled; rgb/ has none of this number");
    copies.says("short_row", "000002: rows [u; v; valid] were expected");
    copies.says("none_valid", "image 0 is the first; a valid label was expected");
    copies.says("fewer", "as many points as in the other images were expected");
}
