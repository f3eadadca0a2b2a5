// STIR 2026: metrics by hand, rendered data in, malformed copies.
#include <cmath>

#include "sdk/evaluation/data_sets/stir_2026_metrics.hpp"
#include "sdk/evaluation/layout_test.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;
using Json = nlohmann::json;

namespace {

const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made =
        (render_layout_to(folder.path(), "heartbeat", "stir-2026", 5), true);
    static_cast<void>(is_made);
    return folder;
}

// Average Jaccard of mono/preds.json against annotations.json, worked out anew.
double average_jaccard(const fs::path& data, const fs::path& predictions) {
    const Json truth = read_json(data / "seq00/annotations.json");
    const Json predicted = read_json(predictions)["seq00"];
    double sum = 0;
    for (const double limit : {2, 4, 8, 16, 32}) {
        int hits = 0, all = 0;
        for (const auto& [frame, of_frame] : predicted.items()) {
            if (frame == "0" || !truth.contains(frame + "/0")) continue;
            const Json& points = truth[frame + "/0"];
            for (std::size_t i = 0; i < points["left_x"].size(); ++i) {
                const double dx =
                    points["left_x"][i].get<double>() - of_frame["coords"][i][0].get<double>();
                const double dy =
                    points["left_y"][i].get<double>() - of_frame["coords"][i][1].get<double>();
                const bool visible = points["left_visibility"][i].get<bool>();
                const bool said = of_frame["visibilities"][i].get<bool>();
                const bool hit = visible && said && std::hypot(dx, dy) < limit;
                hits += hit;
                all += hit ? 1 : (visible ? 1 : 0) + (said ? 1 : 0);
            }
        }
        sum += static_cast<double>(hits) / all;
    }
    return sum / 5;
}

}  // namespace

TEST_CASE("Jaccard, accuracy and occlusion accuracy by hand, strictly within the thresholds") {
    const TrackingScores scores = tracking_scores({{true, true, 1},
                                                   {true, true, 2},  // not within 2
                                                   {true, false, 1},
                                                   {false, true, 1},
                                                   {false, false, 100},
                                                   {true, true, 100}});
    // Within 2: TP 1; FP 3 (the hidden one, 2 and 100 off); FN 3.
    CHECK(scores.jaccard[0] == doctest::Approx(1.0 / 7));
    CHECK(scores.jaccard[1] == doctest::Approx(2.0 / 6));
    CHECK(scores.accuracy[0] == doctest::Approx(2.0 / 4));
    CHECK(scores.accuracy[1] == doctest::Approx(3.0 / 4));
    CHECK(scores.average_jaccard == doctest::Approx((1.0 / 7 + 4 * 2.0 / 6) / 5));
    CHECK(scores.average_accuracy == doctest::Approx((0.5 + 4 * 0.75) / 5));
    CHECK(scores.occlusion_accuracy == doctest::Approx(4.0 / 6));
    CHECK(tracking_scores({}).average_jaccard == 0);
    CHECK(tracking_scores({{false, false, 0}}).average_jaccard == 0);
    CHECK(tracking_scores({{false, false, 0}}).occlusion_accuracy == 1);
}

TEST_CASE("rendered data in, and the score is that of the predictions that were written") {
    const TestFolder out;
    REQUIRE(evaluate_set("stir-2026", data_set().path(), out.path()) == 0);
    const double average = result_of(out.path(), "seq00", "average_jaccard_px");
    CHECK(average == doctest::Approx(average_jaccard(
                         data_set().path(), out.path() / "predictions/mono/defrec/preds.json")));
    CHECK(average > 0.45);  // some points are only extrapolated
    CHECK(result_of(out.path(), "seq00", "average_accuracy_px") > 0.95);
    CHECK(result_of(out.path(), "seq00", "accuracy_2_mm") > 0.9);
    const Json stereo = read_json(out.path() / "predictions/stereo/defrec/preds.json")["seq00"];
    CHECK(stereo.size() == 5);
    CHECK(stereo["4"]["latency_ms"].get<double>() > 0);
    const double z = stereo["4"]["coords"][0][2].get<double>();
    CHECK(z > 0.05);  // m
    CHECK(z < 0.12);
}

TEST_CASE("truth that is moved or hidden changes the score as it must") {
    const TestFolder root, out;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    const fs::path file = root.path() / "seq00/annotations.json";
    Json truth = read_json(file);
    for (auto& [key, frame] : truth.items())
        if (key != "0/0")
            for (auto& x : frame["left_x"]) x = x.get<double>() + 20;
    truth["2/1"] = "another instance, which does not count";
    std::ofstream(file) << truth;
    REQUIRE(evaluate_set("stir-2026", root.path(), out.path()) == 0);
    CHECK(result_of(out.path(), "seq00", "accuracy_16_px") < 0.05);  // a point may be off by 4
    CHECK(result_of(out.path(), "seq00", "accuracy_32_px") > 0.95);
    CHECK(result_of(out.path(), "seq00", "average_jaccard_px") ==
          doctest::Approx(
              average_jaccard(root.path(), out.path() / "predictions/mono/defrec/preds.json")));

    for (auto& [key, frame] : truth.items())
        if (key != "2/1")
            for (auto& visible : frame["left_visibility"]) visible = false;
    std::ofstream(file) << truth;
    REQUIRE(evaluate_set("stir-2026", root.path(), out.path()) == 0);
    CHECK(result_of(out.path(), "seq00", "average_jaccard_px") == 0);
    CHECK(result_of(out.path(), "seq00", "occlusion_accuracy_px") < 0.6);  // of those not seen
}

TEST_CASE("the videos' names are an option") {
    const TestFolder root, out;
    fs::copy(data_set().path(), root.path(), fs::copy_options::recursive);
    fs::rename(root.path() / "seq00/left.mp4", root.path() / "seq00/a.mp4");
    CHECK(evaluate_set("stir-2026", root.path(), out.path()) == 6);
    CHECK(reasons_of(out.path()).at("seq00").find("left.mp4: this file was expected") !=
          std::string::npos);
    CHECK(evaluate_set("stir-2026", root.path(), out.path(), {"--video", "a.mp4,right.mp4"}) == 0);
    CHECK(evaluate_set("stir-2026", root.path(), out.path(), {"--video", "a.mp4"}) == 6);
}

TEST_CASE("what is not as expected is named") {
    BrokenCopies copies(data_set().path() / "seq00");
    const Json truth = read_json(data_set().path() / "seq00/annotations.json");
    const auto write = [&](const char* clip, const auto& change) {
        Json json = truth;
        change(json);
        std::ofstream(copies.copy(clip) / "annotations.json") << json;
    };
    fs::remove(copies.copy("no_calibration") / "calib.json");
    fs::remove(copies.copy("no_video") / "right.mp4");
    std::ofstream(copies.copy("not_json") / "annotations.json") << "[]";
    write("odd_key", [](Json& json) { json["two"] = json["2/0"]; });
    write("no_start", [](Json& json) { json.erase("0/0"); });
    write("no_disparity", [](Json& json) { json["2/0"].erase("disparity"); });
    write("short", [](Json& json) { json["2/0"]["left_y"].erase(0); });
    write("fewer", [](Json& json) {
        for (auto& [name, values] : json["2/0"].items()) values.erase(0);
    });
    write("too_long", [](Json& json) { json["9/0"] = json["4/0"]; });
    copies.evaluate("stir-2026");
    copies.says("no_calibration", "calib.json: this file was expected");
    copies.says("no_video", "right.mp4: this file was expected");
    copies.says("not_json", "annotations.json: JSON with \"frame/instance\" as its keys");
    copies.says("odd_key", "two: keys like \"0/0\"");
    copies.says("no_start", "0/0; the points that are to be tracked; was expected");
    copies.says("no_disparity", "2/0: an array disparity was expected");
    copies.says("short", "2/0: arrays of the same length were expected");
    copies.says("fewer", "as in frame 0");
    copies.says("too_long", "frame 9 is annotated; the video's last one is 4");
}
